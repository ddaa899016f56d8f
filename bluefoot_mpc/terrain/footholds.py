"""The best place for a foot near where it would land, and what its swing has to clear."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.frame import cells_of, heights_at, to_map, to_world
from bluefoot_mpc.terrain.ground import Ground
from bluefoot_mpc.types import BoolArray, FloatArray

Reach = Callable[[FloatArray], BoolArray]
"""(k,) whether a leg holds each of (k, 3) places, m in the odometry frame."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ChoiceConfig:
    """How far from its nominal place a foot may land, and what that costs."""

    radius: float = 0.075  # m, farthest
    spread: float = 0.050  # m away that weigh as much as all of the quality
    least_quality: float = 0.10  # worse places are none, 1
    keep: float = 0.25  # gain by which another place must be better than the one chosen before, 1

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(spread=self.spread)
        require_range(0.005, 0.3, radius=self.radius)
        require_range(0.0, 1.0, least_quality=self.least_quality)
        require_nonnegative(keep=self.keep)


@dataclass(frozen=True, kw_only=True, slots=True)
class FootholdChoice:
    """Where a foot goes.

    Attributes:
        place: (3,) m in the odometry frame, the ground there; NaN where nothing is good.
        quality: of the place, 0 where there is none.
        reason: why there is none, in few words; else empty.
    """

    place: FloatArray
    quality: float
    reason: str = ""

    @property
    def found(self) -> bool:
        """Whether there is a place."""
        return not self.reason


def choose(
    ground: Ground, nominal: FloatArray, reach: Reach, last: FloatArray | None, config: ChoiceConfig
) -> FootholdChoice:
    """The nearest good place, distance weighed against quality.

    Args:
        ground: rated map.
        nominal: (2,) m in the odometry frame, where the foot would land on level ground.
        reach: what the leg holds.
        last: (2,) m, the place chosen before for the same landing; None without.
        config: bounds and weights.
    """
    map, cell = ground.map, ground.map.cell
    if not np.isfinite(nominal).all():
        return _none("its nominal place is no number")
    x, y = to_map(map, nominal).tolist()
    rows, columns = (
        _window(centre, config.radius, cell, n) for centre, n in zip((y, x), map.height.shape, strict=True)
    )
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return _none("the map ends there")
    quality, height = ground.quality[rows, columns], map.height[rows, columns]
    at_y = (np.arange(rows.start, rows.stop)[:, None] + 0.5) * cell
    at_x = (np.arange(columns.start, columns.stop)[None, :] + 0.5) * cell
    away = np.hypot(at_x - x, at_y - y)
    fit = (quality >= config.least_quality) & np.isfinite(height) & (away <= config.radius)
    if not fit.any():
        return _none("no good ground near its nominal place")
    cost = (away / config.spread) ** 2 + 1.0 - quality
    if last is not None and np.isfinite(last).all():
        last_x, last_y = to_map(map, last).tolist()
        cost = cost - config.keep * (np.hypot(at_x - last_x, at_y - last_y) <= 0.75 * cell)
    i, j = np.nonzero(fit)
    spots = to_world(map, np.column_stack([at_x[0, j], at_y[i, 0]]))
    places = np.column_stack([spots, height[i, j] + map.pose[2]])
    held = reach(places)
    if not held.any():
        return _none("all good ground is out of the leg's reach")
    best = int(np.where(held, cost[i, j], np.inf).argmin())
    return FootholdChoice(place=places[best], quality=float(quality[i[best], j[best]]))


def highest_between(ground: Ground, start: FloatArray, goal: FloatArray, width: float) -> float:
    """M in the odometry frame, the highest known ground that a swing passes over; NaN where none is known.

    Args:
        ground: map.
        start: (2,) m in the odometry frame.
        goal: (2,) m.
        width: m, of the way.
    """
    way = np.asarray(goal, dtype=float)[:2] - np.asarray(start, dtype=float)[:2]
    length = math.hypot(*way.tolist())
    if not math.isfinite(length):
        return math.nan
    step = 0.5 * ground.map.cell
    along = np.linspace(0.0, 1.0, max(2, math.ceil(length / step) + 1))
    side = np.array((-way[1], way[0])) / length if length > 1e-9 else np.array((0.0, 1.0))
    aside = np.linspace(-0.5, 0.5, max(2, math.ceil(width / step) + 1)) * width
    places = np.asarray(start)[:2] + along[:, None, None] * way + aside[None, :, None] * side
    found = heights_at(ground.map, places)
    known = found[np.isfinite(found)]
    return float(known.max()) if len(known) else math.nan


def height_around(ground: Ground, place: FloatArray) -> float:
    """M in the odometry frame, height of the ground at a (2,) place (m); NaN where unknown."""
    i, j = cells_of(ground.map, place)
    return float(ground.map.height[i, j] + ground.map.pose[2]) if i >= 0 else math.nan


def _window(centre: float, radius: float, cell: float, count: int) -> slice:
    first = max(0, math.floor((centre - radius) / cell))
    return slice(first, min(count, math.floor((centre + radius) / cell) + 1))


def _none(reason: str) -> FootholdChoice:
    return FootholdChoice(place=np.full(3, np.nan), quality=0.0, reason=reason)
