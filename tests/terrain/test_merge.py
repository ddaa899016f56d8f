"""Maps of several sweeps made one."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.height_map import Region
from bluefoot_mpc.terrain.merge import MergeConfig, Walked, merge
from bluefoot_mpc.types import HeightMap

CELL = 0.02


def _map(height: float, confidence: float = 0.8, x: float = 0.0, time: float = 1.0) -> HeightMap:
    region = Region.spanning((x, x + 0.4), (-0.2, 0.2), CELL)
    shape = (region.n, region.m)
    return HeightMap(
        time=time, cell=CELL, pose=region.pose, height=np.full(shape, height),
        confidence=np.full(shape, confidence),
    )  # fmt: skip


def _walked(way: float) -> Walked:
    return Walked(way=way, place=np.zeros(2))


def test_the_first_map_is_taken_as_it_is_but_for_doubtful_cells() -> None:
    """Below the least confidence a height is unknown."""
    new = _map(0.01)
    new.confidence[0, 0] = 0.15
    merged = merge(None, new)
    assert np.isnan(merged.height[0, 0])
    assert merged.confidence[0, 0] == 0.0
    assert np.isfinite(merged.height).sum() == merged.height.size - 1
    assert np.isfinite(new.height).all()  # what was given is not changed


def test_cells_fall_on_each_other_when_the_region_moves_on() -> None:
    """The older map fills what the newer does not know, cell by cell, in its own place."""
    old = _map(0.0)
    old.height[:] = np.arange(old.height.size).reshape(old.height.shape) * 1e-4
    new = _map(np.nan, 0.0, x=0.1, time=2.0)
    new.height[3, 4], new.confidence[3, 4] = 0.5, 0.8
    merged = merge(old, new)
    assert merged.pose.tolist() == new.pose.tolist()
    assert merged.time == 2.0
    expected = np.full(new.height.shape, np.nan)
    expected[:, :15] = old.height[:, 5:]
    expected[3, 4] = 0.5
    np.testing.assert_allclose(merged.height, expected, atol=1e-12)
    far = merge(old, _map(np.nan, 0.0, x=4.0))
    assert np.isnan(far.height).all()


def test_newer_heights_win_where_they_are_confident() -> None:
    """Heights that differ are not averaged: the newer one counts, unless hardly anything speaks for it."""
    old = _map(0.0)
    assert merge(old, _map(0.05, 0.5)).height == pytest.approx(0.05)
    assert merge(old, _map(0.05, 0.25)).height == pytest.approx(0.0)
    assert merge(_map(0.0, 0.21), _map(0.05, 0.25)).height == pytest.approx(0.05)


def test_heights_that_agree_are_averaged() -> None:
    """By their variances; together they are trusted more than either."""
    merged = merge(_map(0.002, 0.5), _map(0.004, 0.8))
    assert merged.height == pytest.approx((0.002 * 1.0 + 0.004 * 4.0) / 5.0)
    assert (merged.confidence > 0.8).all()


def test_trust_fades_with_the_way_walked() -> None:
    """Steep ground first, for drift moves heights sideways; what is too uncertain becomes unknown."""
    old = _map(0.0)
    old.height[:, 10:] = 0.03
    nothing = _map(np.nan, 0.0)
    seen = [merge(old, nothing, _walked(way)).confidence for way in (0.0, 0.5, 2.0)]
    for before, after in itertools.pairwise(seen):
        assert (after < before).all()
    assert (seen[1][:, 9:11] < 0.7 * seen[1][:, 4:6]).all()
    worn = merge(old, nothing, _walked(2.0))
    assert np.isnan(worn.height[:, 9:11]).any()
    assert np.isfinite(worn.height[:, :5]).all()
    assert np.isnan(merge(old, nothing, _walked(100.0)).height).all()
    steady = MergeConfig(drift=0.0, turn_deg=0.0)
    assert merge(old, nothing, _walked(3.0), steady).confidence == pytest.approx(old.confidence)


def test_heights_of_maps_at_different_levels_are_compared_in_one_frame() -> None:
    """A map's origin may lie higher than the other's."""
    lifted = replace(_map(0.0), pose=np.array([0.0, -0.2, 0.1, 0.0]))
    assert merge(lifted, _map(np.nan, 0.0)).height == pytest.approx(0.1)


@pytest.mark.parametrize(
    "pose", [[0.01, -0.2, 0.0, 0.0], [0.0, -0.2, 0.0, 0.1]], ids=["between cells", "turned"]
)
def test_maps_without_a_common_grid_are_refused(pose: list[float]) -> None:
    """The message says how to make them fit."""
    with pytest.raises(ConfigurationError, match=r"Region\.spanning"):
        merge(replace(_map(0.0), pose=np.array(pose)), _map(0.0))
    with pytest.raises(ConfigurationError, match="size"):
        merge(replace(_map(0.0), cell=0.04), _map(0.0))
