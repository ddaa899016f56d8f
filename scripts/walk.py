"""Walk straight: python scripts/walk.py --gait trot --speed 0.06."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("walk")
