"""Where on a height map a foot may stand (thesis, chapter 6: planned footholds over mapped terrain)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class RatingConfig:
    """What makes a good place for a foot."""

    least_confidence: float = 0.2  # below it a height is no better than unknown, 1
    edge: float = 0.008  # m by which heights of neighbouring cells differ where there is an edge
    least_distance: float = 0.013  # m from an edge or from unknown ground; nearer no foot stands
    distance: float = 0.050  # m from it; farther no place gets better
    foot: float = 0.025  # m, holes narrower than that count as ground beside which a foot may stand
    slope: float = 0.5  # rise per metre, steepest place to stand on

    def __post_init__(self) -> None:
        """Check ranges."""
        require_range(0.0, 1.0, least_confidence=self.least_confidence)
        require_nonnegative(least_distance=self.least_distance)
        require_positive(edge=self.edge, slope=self.slope, foot=self.foot)
        require_range(self.least_distance + 1e-3, 1.0, distance=self.distance)


@dataclass(frozen=True, kw_only=True, slots=True)
class Ground:
    """A height map with how well a foot stands on each of its cells.

    Attributes:
        map: heights.
        quality: (n, m) 1 where a foot stands well, towards 0 where it hardly does; 0 where it must not.
    """

    map: HeightMap
    quality: FloatArray


def rate_ground(map: HeightMap, config: RatingConfig | None = None) -> Ground:
    """Rate every cell of a map.

    A map shows edges a finger's width from where they are, feet land a little beside their places, and the
    last link leans over what stands beside: so a place is the better the farther it is from any edge.

    Args:
        map: heights and how far they are to be trusted.
        config: bounds.
    """
    config = config or RatingConfig()
    known = np.isfinite(map.height) & (map.confidence >= config.least_confidence)
    if not known.any():
        return Ground(map=map, quality=np.zeros(map.height.shape))
    height, even = _bridged(map.height, known, config.edge, max(1, math.ceil(config.foot / map.cell)))
    high = ndimage.maximum_filter(np.where(even, height, -np.inf), size=3)
    low = ndimage.minimum_filter(np.where(even, height, np.inf), size=3)
    sure = ndimage.minimum_filter(even, size=3, mode="nearest")
    free = sure & (high - low <= config.edge)
    # The cells on both sides of an edge are not free: the edge lies a cell beyond the last free one's middle.
    away = map.cell * (ndimage.distance_transform_edt(np.pad(free, 1))[1:-1, 1:-1] + 0.5)
    reach = config.distance - config.least_distance
    quality = np.clip((away - config.least_distance) / reach, 0.0, 1.0)
    slope = _slope(np.where(even, height, 0.0), even, map.cell)
    quality *= np.clip(2.0 - 2.0 * slope / config.slope, 0.0, 1.0) * np.clip(
        0.5 + 0.5 * map.confidence, 0.0, 1.0
    )
    return Ground(map=map, quality=np.where(free & known, quality, 0.0))


def _bridged(height: FloatArray, known: BoolArray, edge: float, foot: int) -> tuple[FloatArray, BoolArray]:
    """Heights with narrow holes filled where all around agrees, and which cells have one then.

    Nobody steps into such a hole, but next to it: it is narrower than a foot with what maps err (cells).
    """
    around = np.ones((5, 5), dtype=np.bool_)
    high = ndimage.maximum_filter(np.where(known, height, -np.inf), footprint=around)
    low = ndimage.minimum_filter(np.where(known, height, np.inf), footprint=around)
    count = ndimage.uniform_filter(known.astype(np.float64), size=5, mode="constant") * 25.0
    wide = ndimage.binary_opening(~known, np.ones((foot, foot), dtype=np.bool_))
    hole = ~known & ~wide & (count >= 11.5) & (high - low <= edge)
    return np.where(hole, 0.5 * (np.where(hole, high, 0.0) + np.where(hole, low, 0.0)), height), known | hole


def _slope(height: FloatArray, known: BoolArray, cell: float) -> FloatArray:
    """(n, m) rise per metre by Sobel's operator; infinite where a neighbour is unknown."""
    along = ndimage.sobel(height, axis=1, mode="nearest") / (8.0 * cell)
    across = ndimage.sobel(height, axis=0, mode="nearest") / (8.0 * cell)
    sure = ndimage.minimum_filter(known, size=3, mode="constant", cval=False)
    return np.where(sure, np.hypot(along, across), np.inf)
