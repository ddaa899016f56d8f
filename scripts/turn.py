"""Walk a circle: python scripts/turn.py --speed 0.05 --yaw-rate 0.3."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("turn")
