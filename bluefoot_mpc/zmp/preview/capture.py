"""Capture point, and the shift of footholds after a hard push.

The capture point is where the robot would have to step to come to rest. A mild
push is the preview's matter: a correction of the footholds disturbs the rhythm
that stabilises a gait by itself, so it begins beyond a threshold only, and
ends below a lower one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class CaptureConfig:
    """When and how far footholds follow the capture point."""

    begin: float = 0.03  # m, error of the capture point that starts a correction
    end: float = 0.012  # m, error that ends it
    gain: float = 1.0  # shift per error beyond `end`
    max_shift: float = 0.04  # m

    def __post_init__(self) -> None:
        require_positive(begin=self.begin, max_shift=self.max_shift)
        require_nonnegative(end=self.end, gain=self.gain)
        if self.end > self.begin:
            raise ConfigurationError(f"end = {self.end!r} must not exceed begin = {self.begin!r}")


class FootholdShift(NamedTuple):
    """Correction of the footholds that lie ahead.

    Attributes:
        shift: (2,) m, the same for every foot that has not landed; zero when idle.
        active: True while a correction is under way; goes into the next call.
    """

    shift: FloatArray
    active: bool


def capture_point(position: FloatArray, velocity: FloatArray, height: float) -> FloatArray:
    """(2,) m, place at which the inverted pendulum would come to rest.

    Args:
        position: (2,) m, centre of mass.
        velocity: (2,) m/s.
        height: m, of the centre of mass above the ground.
    """
    return np.asarray(position + velocity * math.sqrt(height / GRAVITY))


def foothold_shift(
    measured: FloatArray, planned: FloatArray, active: bool, config: CaptureConfig
) -> FootholdShift:
    """How far footholds move after the capture point has left its plan.

    Args:
        measured: (2,) m, capture point of the estimated motion.
        planned: (2,) m, capture point of the plan at the same time and in the same frame.
        active: whether the previous call corrected.
        config: thresholds and bounds.
    """
    x, y = (measured - planned).tolist()
    error = math.hypot(x, y)
    # Not finite: no threshold is met.
    if not (config.end if active else config.begin) < error < math.inf:
        return FootholdShift(shift=np.zeros(2), active=False)
    size = min(config.gain * (error - config.end), config.max_shift)
    return FootholdShift(shift=np.array([x, y]) * (size / error), active=True)
