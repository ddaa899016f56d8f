"""Stand still on all feet: python scripts/stand.py --duration 10."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("stand")
