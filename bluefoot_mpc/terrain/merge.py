"""Height maps of several sweeps made one, along leg odometry that drifts.

All maps lie along the odometry frame's axes with their corners on a common grid (`Region.spanning`), so that
cells fall on each other and nothing is resampled. The merged map covers the newer one's region, which follows
the robot.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.filters import slopes
from bluefoot_mpc.terrain.frame import centres
from bluefoot_mpc.types import FloatArray, HeightMap

_NEARLY = 1e-6
"""Cells, and rad, by which grids may differ and still be one."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MergeConfig:
    """How far older heights are trusted."""

    drift: float = 0.03  # m of drift per metre walked
    turn_deg: float = 2.0  # degrees of drift in heading per metre walked
    steepness: float = 0.2  # rise per metre that even ground is taken to have, at least
    trusted: float = 0.010  # m, standard deviation of a height with a confidence of one half
    confident: float = 0.3  # confidence from which a newer height wins against an older one
    least: float = 0.2  # confidence below which a height is unknown
    agree: float = 2.0  # standard deviations within which two heights are averaged
    agree_most: float = 0.010  # m, beyond which they never are: they are of two sides of an edge

    def __post_init__(self) -> None:
        require_nonnegative(
            drift=self.drift, turn_deg=self.turn_deg, steepness=self.steepness, agree=self.agree,
            agree_most=self.agree_most,
        )  # fmt: skip
        require_positive(trusted=self.trusted)
        require_range(0.0, 1.0, confident=self.confident, least=self.least)


@dataclass(frozen=True, kw_only=True, slots=True)
class Walked:
    """What the robot did between two maps.

    Attributes:
        way: m, walked since the older map was merged.
        place: (2,) m, where the robot is now, odometry frame.
    """

    way: float
    place: FloatArray


def merge(
    old: HeightMap | None, new: HeightMap, walked: Walked | None = None, config: MergeConfig | None = None
) -> HeightMap:
    """The newer map, and where it does not know enough the older one as far as that is still trusted.

    A drift d of the odometry moves the older heights sideways, which makes an error of d times their
    steepness. That is added to their variance; confidence is ``1 / (1 + variance / trusted²)`` throughout.
    Heights of both maps that agree are averaged by their variances; else the newer one counts if it is
    confident, or the more confident one. What nobody is confident of becomes unknown.

    Args:
        old: the older map; None before there is one.
        new: the newest sweep's.
        walked: what lies between them; None: nothing.
        config: how far to trust.

    Raises:
        ConfigurationError: the maps' cells do not fall on each other.
    """
    config = config or MergeConfig()
    if old is None:
        return _thinned(new, new.height, new.confidence, new.time, config)
    height, confidence = _onto(old, new)
    if walked is not None and walked.way > 0.0:
        confidence = _decayed(old, height, confidence, new, walked, config)
    ours, theirs = _variance(new.confidence, config), _variance(confidence, config)
    both = np.isfinite(height) & np.isfinite(new.height)
    with np.errstate(invalid="ignore"):
        limit = np.minimum(config.agree * np.sqrt(ours + theirs), config.agree_most)
        near = both & (np.abs(height - new.height) <= limit)
    newer = np.isfinite(new.height) & (
        ~np.isfinite(height) | (new.confidence >= np.minimum(config.confident, confidence))
    )
    result = np.where(newer, new.height, height)
    trust = np.where(newer, new.confidence, confidence)
    share = theirs[near] / (ours[near] + theirs[near])
    result[near] = share * new.height[near] + (1.0 - share) * height[near]
    trust[near] = 1.0 / (1.0 + share * ours[near] / config.trusted**2)
    return _thinned(new, result, trust, max(old.time, new.time), config)


def _thinned(
    like: HeightMap, height: FloatArray, confidence: FloatArray, time: float, config: MergeConfig
) -> HeightMap:
    """A map in another's frame without what is hardly trusted."""
    known = np.isfinite(height) & (confidence >= config.least)
    return HeightMap(
        time=time, cell=like.cell, pose=like.pose.copy(), height=np.where(known, height, np.nan),
        confidence=np.where(known, confidence, 0.0),
    )  # fmt: skip


def _variance(confidence: FloatArray, config: MergeConfig) -> FloatArray:
    """(n, m) m² that stands for a confidence; very much for none."""
    safe = np.clip(confidence, 1e-6, 1.0 - 1e-6)
    return np.asarray(config.trusted**2 * (1.0 / safe - 1.0))


def _decayed(
    old: HeightMap, height: FloatArray, confidence: FloatArray, new: HeightMap, walked: Walked,
    config: MergeConfig,
) -> FloatArray:  # fmt: skip
    """(n, m) confidence of older heights after a walk, by the drift at each cell and its steepness."""
    reach = np.hypot(*np.moveaxis(centres(new) - walked.place, -1, 0))
    drift = walked.way * (config.drift + math.radians(config.turn_deg) * reach)
    steep = np.hypot(*slopes(height, old.cell))
    steep = np.maximum(np.nan_to_num(steep, nan=config.steepness), config.steepness)
    variance = _variance(confidence, config) + (drift * steep) ** 2
    return np.where(np.isfinite(height), 1.0 / (1.0 + variance / config.trusted**2), 0.0)


def _onto(old: HeightMap, new: HeightMap) -> tuple[FloatArray, FloatArray]:
    """Heights and confidence of a map on the cells of another: (n, m) m above its origin, and (n, m)."""
    away = (new.pose[:2] - old.pose[:2]) / new.cell
    turned = np.abs(np.array([old.pose[3], new.pose[3]])).max()
    if old.cell != new.cell or turned > _NEARLY or np.abs(away - np.rint(away)).max() > _NEARLY:
        raise ConfigurationError(
            f"maps at {old.pose.tolist()} with cells of {old.cell:g} m and at {new.pose.tolist()} "
            f"with cells of {new.cell:g} m have no common grid: make both with Region.spanning, "
            "and with cells of one size"
        )
    j, i = np.rint(away).astype(int).tolist()
    height, confidence = np.full(new.height.shape, np.nan), np.zeros(new.height.shape)
    (n, m), (rows, columns) = new.height.shape, old.height.shape
    a, b, c, d = max(i, 0), min(i + n, rows), max(j, 0), min(j + m, columns)
    if a < b and c < d:
        there = (slice(a - i, b - i), slice(c - j, d - j))
        height[there] = old.height[a:b, c:d] + (old.pose[2] - new.pose[2])
        confidence[there] = old.confidence[a:b, c:d]
    return height, confidence
