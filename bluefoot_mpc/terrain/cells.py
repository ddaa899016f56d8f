"""The height of a map's cell from the points in it: upper estimates that know of the sensor's noise.

The thesis takes the highest point of a cell. Of k points with a noise of sigma it lies sigma sqrt(2 ln k) or
so too high on even ground, and one false echo decides it. So by default the expected excess of a high order
statistic is taken off, and the points around what is left are averaged.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import FloatArray

_BELOW, _ABOVE = 2.0, 3.5
"""Standard deviations about the corrected maximum within which points count: lower ones may lie beside an
edge, higher ones are false."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CellConfig:
    """How a cell's height comes from its points."""

    estimate: Literal["upper", "mean", "maximum"] = "upper"  # corrected and trimmed; plain; as printed
    points: int = 2  # in a cell that counts as known, at least
    trim: float = 0.2  # share of a cell's points that may be false, above
    noise: float = 0.003  # m, of a height, where the LIDAR's place is not known
    range_noise: float = 0.006  # m, standard deviation of an averaged range (URG-04LX within 1 m)
    tilt_noise_deg: float = 0.15  # degrees, of the trunk's estimated tilt from scan to scan
    trusted: float = 0.010  # m, standard deviation of a height with a confidence of one half

    def __post_init__(self) -> None:
        require_positive(points=self.points, noise=self.noise, trusted=self.trusted)
        require_nonnegative(range_noise=self.range_noise, tilt_noise_deg=self.tilt_noise_deg)
        require_range(0.0, 0.5, trim=self.trim)

    def height_noise(self, points: FloatArray, origin: FloatArray | None) -> FloatArray:
        """(k,) m, standard deviation of heights: range noise by a ray's steepness, tilt by its reach.

        Args:
            points: (k, 3) m.
            origin: (3,) m, the LIDAR in the same frame; None: the same noise for all.
        """
        if origin is None:
            return np.full(len(points), self.noise)
        ray = points - origin
        reach = np.hypot(ray[:, 0], ray[:, 1])
        steepness = ray[:, 2] / np.maximum(np.hypot(reach, ray[:, 2]), 1e-9)
        noise = np.hypot(self.range_noise * steepness, math.radians(self.tilt_noise_deg) * reach)
        return np.maximum(noise, 1e-4)


def cell_heights(
    index: NDArray[np.intp], height: FloatArray, noise: FloatArray, cells: int, config: CellConfig,
    away: FloatArray | None = None,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Height and confidence of every cell; NaN and 0 where there are too few points.

    Confidence is ``k / (k + 1) / (1 + (s / trusted)²)``: k points, s the height's standard deviation with the
    spread beyond the known noise (an edge within the cell, a slope, scans that do not fit) added in full.
    With the points' places in their cells it is less where they all lie to one side: they may be of the next
    cell's edge, spilled over by the noise along the ray, and the rest of the cell may be anything, or a hole.

    Args:
        index: (k,) cell of each point.
        height: (k,) m.
        noise: (k,) m, standard deviation of each height.
        cells: in all.
        config: how.
        away: (k, 2) each point's place in its cell, -1 to 1 from side to side; None: not known.

    Returns:
        (cells,) m and (cells,) 0..1.
    """
    count = np.bincount(index, minlength=cells)
    share = np.maximum(count, 1)
    variance = np.bincount(index, noise * noise, minlength=cells) / share
    mean = np.bincount(index, height, minlength=cells) / share
    spread = np.bincount(index, (height - mean[index]) ** 2, minlength=cells) / share
    upper = _order_statistics(index, height, count, config)
    known = count >= config.points
    sigma = np.sqrt(variance)
    used = share
    if config.estimate == "mean":
        upper = mean
    elif config.estimate == "upper":
        upper -= sigma * _excess(count, config.trim)
        above = (height - upper[index]) / np.maximum(sigma[index], 1e-9)
        near = (above >= -_BELOW) & (above <= _ABOVE)
        close = np.bincount(index[near], minlength=cells)
        used = np.maximum(close, 1)
        upper = np.where(close > 0, np.bincount(index[near], height[near], minlength=cells) / used, upper)
    uncertain = variance / used + np.maximum(spread - variance, 0.0)
    confidence = count / (count + 1.0) / (1.0 + uncertain / config.trusted**2)
    if away is not None:
        aside = [np.abs(np.bincount(index, part, minlength=cells)) / share for part in away.T]
        confidence *= 1.0 - np.maximum(*aside) ** 2
    return np.where(known, upper, np.nan), np.where(known, confidence, 0.0)


def _rank(count: NDArray[np.intp], trim: float) -> NDArray[np.intp]:
    """(cells,) which point counts from below, 1 the lowest: the highest but for a share that may be false."""
    return np.asarray(np.maximum(count - np.floor(trim * count).astype(np.intp), 1))


def _order_statistics(
    index: NDArray[np.intp], height: FloatArray, count: NDArray[np.intp], config: CellConfig
) -> FloatArray:
    """(cells,) m, the highest point of each cell, or with `upper` that of the rank which trimming leaves."""
    highest = np.zeros(len(count))
    if len(index) == 0:
        return highest
    order = np.lexsort((height, index))
    rank = _rank(count, config.trim if config.estimate == "upper" else 0.0)
    place = np.cumsum(count) - count + rank - 1
    some = count > 0
    highest[some] = height[order[place[some]]]
    return highest


def _excess(count: NDArray[np.intp], trim: float) -> FloatArray:
    """(cells,) standard deviations by which that order statistic of normal noise exceeds its mean (Blom)."""
    safe = np.maximum(count, 1)
    return np.asarray(ndtri((_rank(safe, trim) - 0.375) / (safe + 0.25)))
