"""Level the trunk in windows, as the paper did: python scripts/level.py --speed 0.06 --level narx."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("level")
