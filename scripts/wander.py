"""Wander through rooms by LIDAR: python scripts/wander.py --world maze --seed 3."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("wander")
