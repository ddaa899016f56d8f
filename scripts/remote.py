"""Do what a station or a script says: python scripts/remote.py --set 'scenario.script="walk 5; sit 2"'."""

from bluefoot_mpc.cli.script import main_for

if __name__ == "__main__":
    main_for("remote")
