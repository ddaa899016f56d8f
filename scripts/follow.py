"""Follow a wheeled leader: python scripts/follow.py --leader mecanum --view."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("follow")
