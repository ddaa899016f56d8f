"""Whether this machine can draw without a screen."""

from __future__ import annotations

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim.graphics import chosen_library


def _why_not() -> str:
    try:
        chosen_library()
    except ConfigurationError as error:
        return str(error)
    return ""


needs_graphics = pytest.mark.skipif(bool(_why_not()), reason=_why_not())
"""For tests that take pictures: `make setup` installs what they need where it may."""
