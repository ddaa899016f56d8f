"""Go to waypoints around obstacles: python scripts/goto.py --world room --seed 3."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("goto")
