"""What it costs to stand on each place of a height map, for each yaw: the cost tensor.

Thesis, chapter 6, terrain: variance of the heights under the four feet, sum of the squared gradients there,
and squared yaw. The feet are those of the stance, turned by the yaw and put on the nearest cells (the thesis
rounds up, which shifts all feet by half a cell). The heights under the feet of one yaw are shifted views of
one map, so that nothing loops over cells.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_range
from bluefoot_mpc.types import FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class CostConfig:
    """Weights of the cost tensor, and the feet that it stands on the map."""

    k_var: float = 4000.0  # 1/m^2, on the variance of the heights under the feet
    k_slope: float = 1.0  # on the sum of the squared slopes under the feet (k_delta of the thesis)
    k_yaw: float = 1.0  # 1/rad^2, on the squared yaw (k_theta of the thesis)
    spacing: float = 0.33  # m between neighbouring feet
    yaws: int = 36  # yaw indices in a turn
    yaw_range: float = math.pi  # rad to either side of forward; yaws beyond it cost infinitely

    def __post_init__(self) -> None:
        require_nonnegative(k_var=self.k_var, k_slope=self.k_slope, k_yaw=self.k_yaw)
        require_range(0.05, 1.0, spacing=self.spacing)
        require_range(2, 720, yaws=self.yaws)
        if self.yaws % 2:
            raise ConfigurationError(f"yaws = {self.yaws} must be even: straight ahead is one of them")
        require_range(0.0, math.pi, yaw_range=self.yaw_range)


def yaw_of(u: FloatArray | NDArray[np.intp] | float, yaws: int) -> FloatArray:
    """(...) rad from the map's x axis, yaw of yaw indices (also broken ones): gamma(u) = 2 pi u / l - pi."""
    return np.asarray(2.0 * math.pi * np.asarray(u, dtype=np.float64) / yaws - math.pi)


def yaw_index(yaw: float, yaws: int) -> int:
    """The yaw index that is nearest to a yaw (rad from the map's x axis)."""
    turned = math.remainder(yaw, 2.0 * math.pi)
    return round((turned + math.pi) * yaws / (2.0 * math.pi)) % yaws


def feet(spacing: float, yaw: FloatArray) -> FloatArray:
    """(..., 4, 2) m, x and y of the feet (FL, FR, RL, RR) from the trunk's centre, map's frame.

    Args:
        spacing: m between neighbouring feet.
        yaw: (...) rad from the map's x axis.
    """
    stance = 0.5 * spacing * np.array(((1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)))
    c, s = np.cos(yaw)[..., None], np.sin(yaw)[..., None]
    x, y = stance[:, 0], stance[:, 1]
    return np.stack((c * x - s * y, s * x + c * y), axis=-1)


def squared_slope(height: FloatArray, cell: float) -> FloatArray:
    """(n, m) rise over run, squared; NaN where the ground is unknown.

    Central differences; beside an unknown cell or an edge the difference to the side that is known, and level
    where neither is.

    Args:
        height: (n, m) m.
        cell: m, side of a cell.
    """
    total = np.where(np.isnan(height), np.nan, 0.0)
    for axis in range(2):
        rise = np.full((2, *height.shape), np.nan)
        ahead, behind = (np.moveaxis(part, axis, 0) for part in rise)
        step = np.diff(np.moveaxis(height, axis, 0), axis=0)
        ahead[:-1], behind[1:] = step, step
        known = np.isfinite(rise)
        count = np.maximum(known.sum(axis=0), 1)
        total += (np.where(known, rise, 0.0).sum(axis=0) / (count * cell)) ** 2
    return total


def cost_tensor(ground: HeightMap, config: CostConfig) -> FloatArray:
    """(n, m, l) cost of standing with the trunk's centre over cell (i, j) and the yaw of index u.

    Infinite where a foot would stand on unknown ground or off the map, and beyond the yaw's range.

    Args:
        ground: the map.
        config: weights and feet.
    """
    height = np.where(np.isfinite(ground.height), ground.height, np.nan)
    return tensor(height, squared_slope(height, ground.cell), ground.cell, config)


def tensor(height: FloatArray, slope: FloatArray, cell: float, config: CostConfig) -> FloatArray:
    """(n, m, l) costs, as `cost_tensor`, with slopes of one's own.

    Args:
        height: (n, m) m; NaN where no foot can stand.
        slope: (n, m) squared slope; NaN where no foot can stand.
        cell: m, side of a cell.
        config: weights and feet.
    """
    yaw = yaw_of(np.arange(config.yaws), config.yaws)
    used = np.flatnonzero(np.abs(yaw) <= config.yaw_range + 1e-9)
    offsets = np.rint(feet(config.spacing, yaw[used]) / cell).astype(np.intp)
    margin = int(np.abs(offsets).max(initial=0))
    # Differences to the middle height are small, so that a variance out of squares keeps its digits.
    known = np.isfinite(height)
    level = height - (height[known].mean() if known.any() else 0.0)
    heights = np.pad(level, margin, constant_values=np.nan)
    # var = sum(h^2) / 4 - (sum h)^2 / 16: the part that adds up over the feet is one map with the slopes.
    terms = np.pad(0.25 * config.k_var * level**2 + config.k_slope * slope, margin, constant_values=np.nan)
    n, m = height.shape
    costs = np.full((config.yaws, n, m), np.inf)
    total, part = np.empty((n, m)), np.empty((n, m))
    for u, places in zip(used.tolist(), (offsets + margin).tolist(), strict=True):
        _add_up(heights, places, total)
        _add_up(terms, places, part)
        np.multiply(total, total, out=total)
        total *= config.k_var / 16.0
        np.subtract(part, total, out=part)
        np.maximum(part, 0.0, out=part)
        np.add(part, config.k_yaw * float(yaw[u]) ** 2, out=costs[u])
    np.copyto(costs, np.inf, where=np.isnan(costs))
    return np.ascontiguousarray(costs.transpose(1, 2, 0))


def _add_up(padded: FloatArray, places: list[list[int]], total: FloatArray) -> None:
    """Sum a padded map over shifted places (x, y in cells) into `total`."""
    n, m = total.shape
    views = [padded[y : y + n, x : x + m] for x, y in places]
    np.add(views[0], views[1], out=total)
    for view in views[2:]:
        np.add(total, view, out=total)
