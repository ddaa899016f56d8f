"""Be pushed sideways while trotting: python scripts/push.py --impulse 2 --direction 90."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("push")
