"""Heights that rays passed below are none."""

import numpy as np

from bluefoot_mpc.terrain.free_space import FreeSpaceConfig, carved
from bluefoot_mpc.types import HeightMap

CONFIG = FreeSpaceConfig()


def even(height=0.0):
    return HeightMap(
        time=0.0, cell=0.02, pose=np.array([0.0, -0.1, 0.0, 0.0]),
        height=np.full((10, 40), height), confidence=np.full((10, 40), 0.9),
    )  # fmt: skip


def rays(ends):
    ends = np.asarray(ends, dtype=float)
    return ends, np.tile([-0.3, 0.0, 0.25], (len(ends), 1))


def wall(x, low, high, count=12):
    """Ends on the face of something upright."""
    return [(x, 0.0, z) for z in np.linspace(low, high, count)]


def test_ground_that_rays_end_on_stays():
    ground = even()
    ends, origins = rays([(x, 0.0, 0.0) for x in np.linspace(0.1, 0.7, 300)])
    assert np.array_equal(carved(ground, ends, origins, CONFIG).height, ground.height)


def test_ground_over_a_gap_goes():
    """Rays met the far side of a gap, below its brink: what a map shows above the gap is not there."""
    ground = even()
    found = carved(ground, *rays(wall(0.50, -0.03, -0.005)), CONFIG)
    gone = np.isnan(found.height[5])
    assert gone[22:24].all()  # the cells before the wall
    assert not gone[26:].any()  # behind it
    assert not gone[:15].any()  # where the rays were still high
    assert not np.isnan(found.height[[2, 8]]).any()  # beside them
    assert (found.confidence[np.isnan(found.height)] == 0.0).all()


def test_a_few_stray_rays_take_nothing_away():
    ground = even()
    found = carved(ground, *rays(wall(0.50, -0.03, -0.02, count=1)), CONFIG)
    assert np.isfinite(found.height).all()


def test_rays_that_are_no_numbers_and_none_at_all_change_nothing():
    ground = even()
    for ends in (np.zeros((0, 3)), np.full((20, 3), np.nan)):
        found = carved(ground, *rays(ends.reshape(-1, 3)), CONFIG)
        assert np.array_equal(found.height, ground.height)
