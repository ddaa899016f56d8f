"""How fast the ground lets the robot go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_nonnegative, require_range
from bluefoot_mpc.terrain.frame import heights_at
from bluefoot_mpc.types import FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class PaceConfig:
    """Speed over the roughness of the ground."""

    even: float = 0.004  # m, spread of the heights under the robot up to which it goes at full speed
    rough: float = 0.020  # m, spread from which it goes at the least
    least: float = 0.7  # of the full speed
    half_side: float = 0.20  # m, half the side of the square of ground that counts, around the trunk
    spacing: float = 0.04  # m between the places that are looked at

    def __post_init__(self) -> None:
        require_nonnegative(even=self.even)
        require_range(0.01, 1.0, half_side=self.half_side, spacing=self.spacing)
        require_range(self.even + 1e-6, 1.0, rough=self.rough)
        require_range(0.05, 1.0, least=self.least)


def paces(ground: HeightMap, route: FloatArray, config: PaceConfig) -> FloatArray:
    """(k,) share of the full speed that is allowed at each pose of a route.

    Args:
        ground: the map.
        route: (k, 3) x, y (m) and yaw (rad), odometry frame.
        config: what counts as rough.
    """
    count = max(1, round(config.half_side / config.spacing))
    axis = np.linspace(-config.half_side, config.half_side, 2 * count + 1)
    around = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
    found = heights_at(ground, route[:, None, :2] + around)
    spread = _spread(found)
    share = (spread - config.even) / (config.rough - config.even)
    return np.asarray(1.0 - (1.0 - config.least) * np.clip(share, 0.0, 1.0))


def _spread(values: FloatArray) -> FloatArray:
    """(k,) standard deviation of each row's numbers; 0 in rows without any."""
    known = np.isfinite(values)
    count = np.maximum(known.sum(axis=1), 1)
    filled = np.where(known, values, 0.0)
    mean = filled.sum(axis=1) / count
    square = (np.where(known, values - mean[:, None], 0.0) ** 2).sum(axis=1) / count
    return np.asarray(np.sqrt(square))
