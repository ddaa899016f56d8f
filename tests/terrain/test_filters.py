"""Filters that know of unknown cells."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from bluefoot_mpc.terrain.filters import close_gaps, dilate, median, slopes
from bluefoot_mpc.types import FloatArray

CELL = 0.02


def _rough(seed: int = 0) -> FloatArray:
    return np.asarray(np.random.default_rng(seed).uniform(0.0, 0.03, (30, 40)))


def _patchy() -> FloatArray:
    height = _rough()
    height[5:15, 10:25] = np.nan
    height[np.random.default_rng(1).random(height.shape) < 0.1] = np.nan
    return height


def test_without_unknown_cells_they_are_the_usual_filters() -> None:
    """Inside the border, as scipy has them; Sobel over eight cells is the slope."""
    height = _rough()
    inside = (slice(2, -2), slice(2, -2))
    assert dilate(height, 2)[inside] == pytest.approx(ndimage.maximum_filter(height, 5)[inside])
    assert median(height, 3)[inside] == pytest.approx(ndimage.median_filter(height, 3)[inside])
    forward, left = slopes(height, CELL)
    assert forward[inside] == pytest.approx(ndimage.sobel(height, axis=1)[inside] / (8.0 * CELL))
    assert left[inside] == pytest.approx(ndimage.sobel(height, axis=0)[inside] / (8.0 * CELL))


def test_slopes_of_a_plane_are_right_beside_unknown_cells() -> None:
    """A plane has one slope everywhere, however many of its cells were seen; too few give none."""
    i, j = np.mgrid[0:30, 0:40] * CELL
    height = np.where(np.isnan(_patchy()), np.nan, 0.3 * j - 0.1 * i)
    forward, left = slopes(height, CELL)
    known = np.isfinite(forward)
    assert known.sum() > 0.95 * np.isfinite(height).sum()
    assert not known[np.isnan(height)].any()
    assert forward[known] == pytest.approx(0.3)
    assert left[known] == pytest.approx(-0.1)
    alone = np.full((5, 5), np.nan)
    alone[2] = 0.0  # a row tells nothing across itself
    assert np.isnan(slopes(alone, CELL)[0]).all()


def test_unknown_cells_stay_unknown_and_are_not_counted() -> None:
    """Dilation and median look at known neighbours only."""
    height = _patchy()
    for filtered in (dilate(height, 1), median(height, 3), median(height, 3, spike=0.005)):
        assert (np.isnan(filtered) == np.isnan(height)).all()
    corner = np.array([[1.0, np.nan, np.nan], [2.0, 9.0, np.nan], [np.nan, np.nan, np.nan]])
    assert median(corner, 3)[1, 1] == 2.0
    assert median(corner, 3)[0, 0] == 2.0
    assert dilate(corner, 1)[0, 0] == 9.0
    empty = np.full((4, 4), np.nan)
    assert np.isnan(median(empty, 3)).all()
    assert np.isnan(dilate(empty, 1)).all()
    assert np.isnan(slopes(empty, CELL)[0]).all()


def test_the_median_takes_spikes_off_and_leaves_edges() -> None:
    """With a limit only what stands alone is replaced."""
    height = np.zeros((9, 9))
    height[:, 5:] = 0.02
    height[2, 2] = 0.03
    smooth = median(height + 0.001 * _rough()[:9, :9], 3, spike=0.01)
    assert smooth[2, 2] < 0.001
    assert (smooth[:, 5:] > 0.019).all()
    assert (smooth[:, :5] < 0.001).all()
    assert median(height, 1) == pytest.approx(height)


def test_narrow_gaps_are_bridged_and_wide_ones_are_not() -> None:
    """One unknown cell between two known ones gets the height between; two do not, nor one at an edge."""
    height = np.zeros((7, 12))
    height += 0.01 * np.arange(12) / 11
    height[:, 3] = height[:, 6] = height[:, 7] = np.nan
    filled, gaps = close_gaps(height, 1, 0.010)
    assert gaps[:, 3].all()
    assert gaps.sum() == 7
    assert filled[:, 3] == pytest.approx(0.01 * 3 / 11)
    assert np.isnan(filled[:, 6:8]).all()
    assert close_gaps(height, 2, 0.010)[1].sum() == 21
    height[:, 4:] += 0.03
    assert not close_gaps(height, 1, 0.010)[1].any()
    assert not close_gaps(height, 0, 0.010)[1].any()


def test_known_heights_are_not_spread_over_unknown_ground() -> None:
    """Beyond the border of what was seen nothing is invented, not even at a corner."""
    height = np.full((12, 12), np.nan)
    height[:6, :6] = 0.01
    filled, gaps = close_gaps(height, 2, 0.010)
    assert not gaps.any()
    assert np.isnan(filled[6:]).all()


def test_what_is_not_alone_is_no_spike() -> None:
    """Posts of a few cells and corners of blocks stay; a single false height goes."""
    for size in (2, 3, 4):
        height = np.zeros((12, 12))
        height[4 : 4 + size, 4 : 4 + size] = 0.06
        assert (median(height, 3, spike=0.01) == height).all()
    height = np.zeros((12, 12))
    height[6, 6] = 0.06
    assert (median(height, 3, spike=0.01) == 0.0).all()


def test_bridges_pass_unknown_cells_only() -> None:
    """A shadow beside a ridge stays unknown, also where the ridge is hardly known."""
    row = np.array([[0.0, 0.05, np.nan, 0.0]])
    assert np.isnan(close_gaps(row, 2, 0.01)[0][0, 2])
    doubtful = np.array([[0.0, np.nan, np.nan, 0.0]])
    seen = np.array([[True, True, False, True]])
    assert close_gaps(doubtful, 2, 0.01)[1][0, 1:3].all()
    assert not close_gaps(doubtful, 2, 0.01, seen)[1][0, 2]
