"""Change from trot to walk and back without stopping: python scripts/transition.py --speed 0.04."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("transition")
