"""Move the trunk through its range of motion over planted feet: python scripts/pose.py --view."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("pose")
