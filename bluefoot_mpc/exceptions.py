"""Errors of the package: one root, each with the evidence and the valid choices.

Expected failures of a running robot (an unreachable foothold, an infeasible
problem, a late tick) are values with a status, not exceptions. What is raised
from here means wrong configuration, a programming error or a lost device.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class BlueFootError(Exception):
    """Root of every error that the package raises on purpose.

    Attributes:
        exit_status: process exit status that the command line returns for it.
    """

    exit_status = 2


class ConfigurationError(BlueFootError):
    """A configuration, parameter file or option has an impossible value."""


class UnknownNameError(ConfigurationError):
    """A name that must be one of a known set is not.

    Args:
        kind: what was looked up, e.g. ``"scenario"``.
        name: the name given.
        valid: the names that would have worked.
    """

    def __init__(self, kind: str, name: str, valid: Iterable[str]) -> None:
        self.kind = kind
        self.name = name
        self.valid = tuple(sorted(valid))
        close = difflib.get_close_matches(name, self.valid, n=1)
        hint = f" Did you mean '{close[0]}'?" if close else ""
        super().__init__(f"unknown {kind} '{name}'.{hint} Valid: {', '.join(self.valid)}")


class LogError(BlueFootError):
    """A log file is missing, truncated or not a log of this package."""


class DeviceError(BlueFootError):
    """A device refused to work, or was lost."""

    exit_status = 3


class SimulationError(BlueFootError):
    """The simulated physics left what can happen: no result of the run can be trusted."""

    exit_status = 1
