"""What switches the compensator off by itself: a wrong prediction must never throw the robot."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.leveling.config import LevelingLimits
from bluefoot_mpc.types import FloatArray

PAUSE = 1.0
"""s without a reason before it acts again after a passing one."""


class Guard:
    """Watches the compensator and lets go.

    A passing reason (blind estimate, large tilt, missing prediction) pauses it; a
    fault of its own (diverged network, goals at their limits for long) stops it
    until `reset`.

    Attributes:
        stopped: why it has disengaged; empty while it has not.

    Args:
        limits: bounds.
    """

    def __init__(self, limits: LevelingLimits) -> None:
        self._limits = limits
        self._tilt = math.radians(limits.tilt_deg)
        self.reset()

    def reset(self) -> None:
        """Trust it again."""
        self.stopped = ""
        self._final = False
        self._clamped = self._pause = 0.0

    def watch(self, tilt: float, fault: str, doubt: str, dt: float) -> None:
        """Take the tick's evidence.

        Args:
            tilt: rad, of the trunk against its reference.
            fault: what stops it for good; empty without.
            doubt: what pauses it; empty without.
            dt: s.
        """
        if self._final:
            return
        if not doubt and not tilt <= self._tilt:
            doubt = f"the trunk tilts by more than {self._limits.tilt_deg:g} degrees"
        if fault:
            self._stop(fault)
        elif doubt:
            self.stopped, self._pause, self._clamped = doubt, PAUSE, 0.0
        elif self._pause > 0.0:
            self._pause -= dt
            self.stopped = self.stopped if self._pause > 0.0 else ""

    def cut(self, shift: FloatArray, dt: float) -> FloatArray:
        """(16,) rad, `shift` of the goals inside its limit; counts how long half of them are at it."""
        most = self._limits.shift
        inside: FloatArray = np.minimum(np.maximum(shift, -most), most)
        at_limit = 2 * int(np.count_nonzero(inside != shift)) >= len(shift)
        self._clamped = self._clamped + dt if at_limit else 0.0
        if self._clamped > self._limits.clamped:
            self._stop("half of the goals were at their limits for too long")
        return inside

    def _stop(self, reason: str) -> None:
        self.stopped, self._final = reason, True
