"""Filters of height maps that know of unknown cells (thesis, chapter 6, terrain).

Every function takes and gives (n, m) arrays whose NaN cells are unknown. Known heights are never spread over
an unknown area: a cell that no ray met stays unknown, but for gaps between known cells, which `close_gaps`
bridges.
"""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import BoolArray, FloatArray

_OFFSETS = tuple((i, j) for i in (-1, 0, 1) for j in (-1, 0, 1))
"""Sideways and forward steps to a cell's neighbours and to itself."""
COMPANY = 3
"""Cells of a square, itself included, that have a height before it is believed against the median."""
_SOBEL = {0: 2.0, 1: 1.0}
"""Weight of a neighbour by its distance sideways of the direction of the derivative."""


def neighbours(height: FloatArray, radius: int = 1) -> FloatArray:
    """((2 radius + 1)², n, m) each cell's square of neighbours, itself included; NaN beyond the border."""
    n, m = height.shape
    wide = np.pad(height, radius, constant_values=np.nan)
    size = 2 * radius + 1
    return np.stack([wide[i : i + n, j : j + m] for i in range(size) for j in range(size)])


def dilate(height: FloatArray, radius: int) -> FloatArray:
    """(n, m) highest known height within `radius` cells, in rows and columns; unknown cells stay unknown.

    Args:
        height: (n, m) m.
        radius: cells; 0 leaves the map as it is.
    """
    if radius == 0:
        return height.copy()
    highest = np.fmax.reduce(neighbours(height, radius), axis=0)
    return np.where(np.isnan(height), np.nan, highest)


def median(height: FloatArray, size: int, spike: float = 0.0) -> FloatArray:
    """(n, m) heights, spikes replaced by the median of the known ones around; unknown cells stay unknown.

    Args:
        height: (n, m) m.
        size: cells along the square's side, odd; 1 leaves the map as it is.
        spike: m off the median from which a height is replaced, if fewer than `COMPANY` cells of its square
            are within as much of it; 0 replaces all, the plain filter.
    """
    if size == 1:
        return height.copy()
    # NaN sorts to the end: the known ones of every square come first.
    rising = np.sort(neighbours(height, size // 2), axis=0)
    known = np.count_nonzero(~np.isnan(rising), axis=0)
    low, high = np.maximum(known - 1, 0) // 2, known // 2
    high = np.minimum(high, len(rising) - 1)
    middle = 0.5 * (
        np.take_along_axis(rising, low[None], axis=0)[0] + np.take_along_axis(rising, high[None], axis=0)[0]
    )
    off = np.abs(height - middle)  # NaN at unknown cells, which so stay
    if spike == 0.0:
        return np.where(off >= spike, middle, height)
    # The corner of a block, or a post, is off as well, but not alone.
    alike = np.count_nonzero(np.abs(rising - height) < spike, axis=0)
    return np.where((off >= spike) & (alike < COMPANY), middle, height)


def close_gaps(
    height: FloatArray, width: int, step: float, seen: BoolArray | None = None
) -> tuple[FloatArray, BoolArray]:
    """Heights with narrow gaps bridged, and which cells were.

    An unknown cell is a gap if known cells lie on both sides of it, in its row, column or a diagonal, with at
    most `width` unknown cells between them, at heights that differ by no more than `step`. It gets the height
    on the straight line between them; of several such pairs the one with the least difference counts. A gap
    at an edge, such as the shadow of a block, stays unknown: nobody knows where the edge is.

    Args:
        height: (n, m) m.
        width: cells; 0 leaves the map as it is.
        step: m.
        seen: (n, m) cells of which something is known that bridges must not pass; None: those with a height.

    Returns:
        (n, m) m and (n, m) True where a cell was a gap.
    """
    filled = height.copy()
    if width == 0:
        return filled, np.zeros(height.shape, dtype=np.bool_)
    best = np.full(height.shape, step)
    unknown = np.isnan(height)
    n, m = height.shape
    wide = np.pad(height, width, constant_values=np.nan)
    passable = np.pad(unknown if seen is None else ~seen, width)

    def there(i: int, j: int) -> tuple[slice, slice]:
        return slice(width + i, width + i + n), slice(width + j, width + j + m)

    for i, j in ((0, 1), (1, 0), (1, 1), (1, -1)):
        for before in range(1, width + 1):
            for after in range(1, width + 2 - before):
                one, two = wide[there(-before * i, -before * j)], wide[there(after * i, after * j)]
                difference = np.abs(two - one)
                better = unknown & (difference <= best)  # false where either is unknown
                for k in range(1 - before, after):
                    better &= passable[there(k * i, k * j)]
                filled[better] = ((one * after + two * before) / (before + after))[better]
                best[better] = difference[better]
    return filled, unknown & ~np.isnan(filled)


def slopes(height: FloatArray, cell: float, least: int = 4) -> tuple[FloatArray, FloatArray]:
    """Rise per metre forward (along j) and to the left (along i); NaN where the cell is unknown.

    Where all of a cell's neighbours are known these are Sobel's two kernels over ``8 cell``, which makes them
    slopes. Where some are not, it is the plane through the known ones by weighted least squares: with Sobel's
    weights (1, 2, 1 across the direction of the derivative) and all nine known, that is the same number.

    Args:
        height: (n, m) m.
        cell: m, side of a cell.
        least: known cells of the nine that a slope needs; fewer, or a row of them, give NaN.

    Returns:
        (n, m) and (n, m).
    """
    around = neighbours(height)
    known = ~np.isnan(around)
    values = np.where(known, around, 0.0)
    count = np.count_nonzero(known, axis=0)
    forward = _slope(values, known, along=1)
    left = _slope(values, known, along=0)
    poor = np.isnan(height) | (count < least)
    scale = 1.0 / cell
    return np.where(poor, np.nan, forward * scale), np.where(poor, np.nan, left * scale)


def _slope(values: FloatArray, known: BoolArray, along: int) -> FloatArray:
    """(n, m) slope, in heights per cell, of the weighted least-squares plane in one of its two directions."""
    w = np.array([_SOBEL[abs(offset[1 - along])] for offset in _OFFSETS])
    x = np.array([float(offset[along]) for offset in _OFFSETS])
    y = np.array([float(offset[1 - along]) for offset in _OFFSETS])
    moments = np.tensordot(np.stack((w, w * x, w * y, w * x * x, w * x * y, w * y * y)), known, axes=1)
    heights = np.tensordot(np.stack((w, w * x, w * y)), values, axes=1)
    s, sx, sy, sxx, sxy, syy = moments
    z, xz, yz = heights
    # Normal equations of z = c + a x + b y without c, solved for a by Cramer's rule.
    a11, a12, a22 = sxx * s - sx * sx, sxy * s - sx * sy, syy * s - sy * sy
    b1, b2 = xz * s - sx * z, yz * s - sy * z
    determinant = a11 * a22 - a12 * a12
    regular = determinant > 1e-6
    return np.where(regular, (b1 * a22 - b2 * a12) / np.where(regular, determinant, 1.0), np.nan)
