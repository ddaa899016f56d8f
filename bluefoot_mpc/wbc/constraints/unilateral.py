"""The ground pushes and never pulls, and takes its load gradually when contacts change."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import BoolArray, FloatArray

_LEAST = 1e-3  # share of a foot's cap that stays: an even share of the weight divides by the sum
_SPARE = 1.5  # of the weight, what the caps together must allow


class ForceRamp:
    """Largest normal force per foot: grows after touch-down, fades before the scheduled lift-off.

    Where the ramps together would not carry the robot (two pairs of feet that
    change at once), all of them are raised in proportion.

    Args:
        feet: number of feet.
        limit: N, largest normal force of a foot under full load.
        ramp: s, from nothing to full.
        weight: N, of the robot.
    """

    def __init__(self, feet: int, limit: float, ramp: float, weight: float) -> None:
        self._limit, self._ramp, self._weight = limit, ramp, weight
        self._loaded = np.empty(feet)
        self.reset()

    def reset(self) -> None:
        """Every foot carries fully."""
        self._loaded.fill(1.0)

    def step(self, contact: BoolArray, remaining: FloatArray | None, dt: float) -> FloatArray:
        """(feet,) N, caps of this tick; 0 without contact.

        Args:
            contact: (feet,) which feet stand.
            remaining: (feet,) s until the scheduled lift-off; None: none is scheduled.
            dt: s since the last tick.
        """
        if self._ramp > 0.0:
            np.minimum(self._loaded + dt / self._ramp, 1.0, out=self._loaded)
        else:
            self._loaded.fill(1.0)
        self._loaded *= contact
        share = self._loaded
        if remaining is not None and self._ramp > 0.0:
            share = np.minimum(share, np.maximum(remaining / self._ramp, 0.0)) * contact
        share = np.maximum(share, _LEAST * contact)
        total = self._limit * float(share.sum())
        if 0.0 < total < _SPARE * self._weight:
            share = share * (_SPARE * self._weight / total)
        return np.asarray(share * self._limit)
