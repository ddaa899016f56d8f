"""Where on a height map a foot may stand (thesis, chapter 6: planned footholds over mapped terrain)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class RatingConfig:
    """What makes a good place for a foot."""

    least_confidence: float = 0.2  # below it a height is no better than unknown, 1
    sole: float = 0.010  # m around a place that must be known and level
    level: float = 0.010  # m that heights within the sole may differ by
    brink: float = 0.018  # m around a place, in which the ground should not fall away
    drop: float = 0.010  # m by which it may fall there
    shank: float = 0.026  # m around a place, in which nothing should rise: the last link leans outward
    rise: float = 0.012  # m by which it may rise there
    slope: float = 0.5  # rise per metre, steepest place to stand on

    def __post_init__(self) -> None:
        """Check ranges."""
        require_range(0.0, 1.0, least_confidence=self.least_confidence)
        require_nonnegative(sole=self.sole, brink=self.brink, shank=self.shank)
        require_positive(level=self.level, drop=self.drop, rise=self.rise, slope=self.slope)


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

    Unknown ground, and what is next to it, gets nothing. Brinks, bumps, slopes and neighbours that rise
    make a place worse, up to a bound beyond which it is none.

    Args:
        map: heights and how far they are to be trusted.
        config: bounds.
    """
    config = config or RatingConfig()
    known = np.isfinite(map.height) & (map.confidence >= config.least_confidence)
    if not known.any():
        return Ground(map=map, quality=np.zeros(map.height.shape))
    high = np.where(known, map.height, -np.inf)
    low = np.where(known, map.height, np.inf)
    sole, brink, shank = (_disc(radius, map.cell) for radius in (config.sole, config.brink, config.shank))
    height = np.where(known, map.height, 0.0)
    bump = ndimage.maximum_filter(high, footprint=sole) - ndimage.minimum_filter(low, footprint=sole)
    fall = height - ndimage.minimum_filter(low, footprint=brink)
    climb = ndimage.maximum_filter(high, footprint=shank) - height
    slope = _slope(height, known, map.cell)
    quality = np.ones(map.height.shape)
    pairs = ((bump, config.level), (fall, config.drop), (climb, config.rise), (slope, config.slope))
    for value, most in pairs:
        quality *= np.clip(1.0 - np.where(known, value / most, 1.0), 0.0, 1.0) ** 0.5
    sure = ndimage.minimum_filter(known, footprint=sole, mode="constant", cval=False)
    quality *= np.where(sure, np.clip(map.confidence, 0.0, 1.0), 0.0)
    return Ground(map=map, quality=quality)


def _disc(radius: float, cell: float) -> BoolArray:
    """(k, k) True for cells whose centres are within `radius` m."""
    reach = int(radius / cell + 1e-9)
    away = np.arange(-reach, reach + 1) * cell
    return np.asarray(np.hypot(away[:, None], away[None, :]) <= radius + 1e-9)


def _slope(height: FloatArray, known: BoolArray, cell: float) -> FloatArray:
    """(n, m) rise per metre by Sobel's operator; infinite where a neighbour is unknown."""
    along = ndimage.sobel(height, axis=1, mode="nearest") / (8.0 * cell)
    across = ndimage.sobel(height, axis=0, mode="nearest") / (8.0 * cell)
    sure = ndimage.minimum_filter(known, size=3, mode="constant", cval=False)
    return np.where(sure, np.hypot(along, across), np.inf)
