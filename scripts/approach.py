"""Find a marker and walk up to it: python scripts/approach.py --seed 3."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("approach")
