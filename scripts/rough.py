"""Cross rough ground: python scripts/rough.py --world stones --seed 3."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("rough")
