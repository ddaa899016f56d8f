"""What the scripts in ``scripts/`` call: a scenario's own command line."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import NoReturn

from bluefoot_mpc.cli.main import main


def main_for(scenario: str | Path) -> NoReturn:
    """Run a scenario with the options on the command line, and exit.

    ``python scripts/walk.py --speed 0.06`` is then ``bluefoot run walk --speed 0.06``.

    Args:
        scenario: name of a scenario, or the path of the script that defines one (``__file__``).
    """
    sys.exit(main(["run", str(scenario), *sys.argv[1:]]))
