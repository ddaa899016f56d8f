"""``python -m bluefoot_mpc.cli`` is the console script ``bluefoot``."""

import sys

from bluefoot_mpc.cli.main import main

if __name__ == "__main__":
    sys.exit(main())
