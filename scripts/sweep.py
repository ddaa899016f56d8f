"""Sweep the ground ahead with the LIDAR and map it: python scripts/sweep.py --world rubble --seed 3."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("sweep")
