"""The plane on which a walk over mapped ground stands: what the trunk's height, pitch and roll follow."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray

_LEAST_SPREAD = 1e-3
"""m², of the feet about their middle: closer together they show no slope."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SupportConfig:
    """How the trunk follows its support."""

    level_time: float = 0.4  # s, with which it follows the mean height of the feet
    even_deg: float = 3.0  # degrees of slope that blocks under single feet make: the trunk stays level
    tilt_share: float = 0.7  # of the slope beyond that, which the trunk takes on, 1
    tilt_time: float = 3.0  # s, with which it does: a cycle of steps over blocks shows no slope
    max_tilt_deg: float = 8.0  # degrees, most pitch or roll of it

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(level_time=self.level_time, tilt_time=self.tilt_time)
        require_range(0.0, 1.0, tilt_share=self.tilt_share)
        require_range(0.0, 20.0, max_tilt_deg=self.max_tilt_deg, even_deg=self.even_deg)


class SupportPlane:
    """Follows the plane through the places where feet stand and land next.

    Attributes:
        level: m, its height in the gait's world.
        tilt: (2,) rad, roll and pitch (nose down positive) that the trunk takes on.

    Args:
        config: times and bounds.
    """

    def __init__(self, config: SupportConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Even ground."""
        self.level = 0.0
        self.tilt = np.zeros(2)

    def step(self, feet: FloatArray, dt: float, *, walking: bool) -> None:
        """Follow for one tick.

        Args:
            feet: (4, 3) m in b', where each foot stands or lands next, upwards in the gait's world.
            dt: s.
            walking: False while the feet rest: then the trunk goes level, as sweeps count from there.
        """
        config = self._config
        self.level += min(1.0, dt / config.level_time) * (float(feet[:, 2].mean()) - self.level)
        slope = _tilt(feet) if walking else np.zeros(2)
        beyond = np.sign(slope) * np.maximum(np.abs(slope) - math.radians(config.even_deg), 0.0)
        wanted = config.tilt_share * beyond
        most, time = math.radians(config.max_tilt_deg), config.tilt_time if walking else config.level_time
        self.tilt = self.tilt + min(1.0, dt / time) * (np.clip(wanted, -most, most) - self.tilt)


def _tilt(feet: FloatArray) -> FloatArray:
    """(2,) rad, roll and pitch of the plane nearest to (4, 3) feet, m."""
    x, y, z = (feet - feet.mean(axis=0)).T.tolist()
    xx, yy, xy = (sum(map(math.prod, zip(a, b, strict=True))) for a, b in ((x, x), (y, y), (x, y)))
    xz, yz = (sum(map(math.prod, zip(a, z, strict=True))) for a in (x, y))
    determinant = xx * yy - xy * xy
    if determinant < _LEAST_SPREAD**2:
        return np.zeros(2)
    ahead, left = (xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant
    return np.array([math.atan(left), -math.atan(ahead)])
