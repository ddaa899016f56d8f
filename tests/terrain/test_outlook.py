"""The ground ahead from the side, and the levels of a sweep over it."""

import math

import numpy as np
import pytest

from bluefoot_mpc.terrain.outlook import OutlookConfig, outlook
from bluefoot_mpc.terrain.sweep import SweepConfig, levels, levels_along, pitch_for
from bluefoot_mpc.types import HeightMap
from tests.terrain.flat_floor import HEIGHT, MOUNTS

LIFT = MOUNTS.lidar[2]
AHEAD = np.arange(0.0, 1.6, 0.02)
SLOPE = math.tan(math.radians(10.0))


def ground(height_of, known=lambda x: np.full(x.shape, True)) -> HeightMap:
    """A map from -0.5 m on, whose heights depend on x alone."""
    x = np.broadcast_to(-0.5 + 0.01 * (np.arange(300) + 0.5), (100, 300))
    here = known(x)
    return HeightMap(
        time=0.0, cell=0.01, pose=np.array([-0.5, -0.5, 0.0, 0.0]),
        height=np.where(here, height_of(x), np.nan), confidence=here.astype(float),
    )  # fmt: skip


def flat(x):
    return np.zeros(x.shape)


def test_heights_are_those_of_the_strip_and_hold_on_beyond_what_is_known():
    found = outlook(ground(lambda x: -0.1 * x, lambda x: x < 1.0), np.zeros(3))
    near = (found.distance > 0.1) & (found.distance < 0.9)
    np.testing.assert_allclose(found.height[near], -0.1 * found.distance[near], atol=0.002)
    np.testing.assert_allclose(found.height[found.distance > 1.1], -0.1, atol=0.002)


def test_the_floor_of_gaps_is_no_way_down():
    def stones(x):
        return np.where(x % 0.18 < 0.12, 0.0, -0.08)

    assert outlook(ground(stones), np.zeros(3)).drop < 0.015
    assert outlook(ground(lambda x: -SLOPE * np.clip(x - 0.6, 0.0, 0.4)), np.zeros(3)).drop > 0.06


def test_the_strip_turns_with_the_robot():
    found = outlook(ground(lambda x: 0.1 * x), np.array([1.0, 0.0, math.pi]), OutlookConfig(far=1.0))
    assert found.height[0] > found.height[20] > found.height[40]


def test_what_is_known_ends_at_a_gap_and_not_at_a_crack():
    crack = outlook(ground(flat, lambda x: (abs(x - 0.5) > 0.015) & (x < 1.2)), np.zeros(3))
    gap = outlook(ground(flat, lambda x: (abs(x - 0.5) > 0.05) & (x < 1.2)), np.zeros(3))
    assert crack.known_until == pytest.approx(1.18, abs=0.02)
    assert gap.known_until == pytest.approx(0.44, abs=0.02)


def test_nothing_known_is_no_outlook():
    assert outlook(ground(flat, lambda x: x < -2.0), np.zeros(3)) is None


def test_level_ground_and_ground_that_rises_are_swept_as_ever():
    config = SweepConfig()
    for heights in (np.zeros(len(AHEAD)), 0.1 * AHEAD, np.where(AHEAD > 0.6, -0.02, 0.0)):
        np.testing.assert_array_equal(
            levels_along(config, HEIGHT, LIFT, AHEAD, heights), levels(config, HEIGHT, LIFT)
        )


def test_on_ground_that_drops_the_lines_are_as_near_to_each_other_as_on_level_ground():
    config = SweepConfig()
    drop = -SLOPE * np.clip(AHEAD - 0.5, 0.0, 0.4)
    found = levels_along(config, HEIGHT, LIFT, AHEAD, drop)
    assert (np.diff(found) > 0.0).all()
    assert config.pitch_min_deg <= math.degrees(found[0])
    assert config.pitch_max_deg < math.degrees(found[-1]) <= config.steepest_deg
    met = np.sort([meets(pitch, drop) for pitch in found])
    on_slope = met[(met > 0.5) & (met < 0.9)]
    assert np.diff(on_slope).max() <= config.ground_step + 0.003
    # As level ground is swept, lines on the slope would be farther apart than the map bridges.
    as_level = np.sort([meets(pitch, drop) for pitch in levels(config, HEIGHT, LIFT)])
    assert np.diff(as_level[(as_level > 0.5) & (as_level < 0.9)]).max() > 0.03


def test_behind_a_brink_nothing_is_looked_at():
    step = np.where(AHEAD > 0.6, -0.06, 0.0)
    found = levels_along(SweepConfig(), HEIGHT, LIFT, AHEAD, step)
    met = np.sort([meets(pitch, step) for pitch in found])
    assert not ((met > 0.64) & (met < 0.70)).any()


@pytest.mark.parametrize("height", [math.nan, 0.0])
def test_without_a_height_the_outlook_does_not_count(height):
    drop = -SLOPE * AHEAD
    config = SweepConfig()
    np.testing.assert_array_equal(
        levels_along(config, height, LIFT, AHEAD, drop), levels(config, height, LIFT)
    )


def meets(pitch: float, heights) -> float:
    """M ahead, where the LIDAR's plane first meets the ground of which heights over `AHEAD` are given."""
    x = np.arange(0.05, AHEAD[-1], 0.001)
    needed = pitch_for(x, HEIGHT - np.interp(x, AHEAD, heights), LIFT)
    below = np.flatnonzero(needed <= pitch)
    return float(x[below[0]]) if len(below) else math.inf


def test_the_gap_is_as_wide_as_what_is_unknown():
    def until(width):
        map = ground(flat, lambda x: (abs(x - 0.5) > 0.5 * width) & (x < 1.2))
        return outlook(map, np.zeros(3), OutlookConfig(gap=0.05)).known_until

    assert until(0.04) == pytest.approx(1.18, abs=0.02)
    assert until(0.08) == pytest.approx(0.45, abs=0.02)
