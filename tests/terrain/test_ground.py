"""Where feet may stand: the rating of a map, the choice of a foothold, and what a swing must clear."""

import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.footholds import ChoiceConfig, choose, height_around, highest_between
from bluefoot_mpc.terrain.frame import cells_of
from bluefoot_mpc.terrain.ground import RatingConfig, rate_ground
from bluefoot_mpc.types import HeightMap

CELL = 0.01


def ground_map(height: np.ndarray, confidence: float = 1.0) -> HeightMap:
    return HeightMap(
        time=0.0, cell=CELL, pose=np.array([-0.2, -0.3, 0.0, 0.0]), height=height,
        confidence=np.where(np.isfinite(height), confidence, 0.0),
    )  # fmt: skip


def kerb() -> HeightMap:
    """60 x 60 cells; from x = 0.1 m on the ground is 30 mm higher."""
    height = np.zeros((60, 60))
    height[:, 30:] = 0.03
    return ground_map(height)


def quality(ground, x: float, y: float = 0.0) -> float:
    i, j = cells_of(ground.map, np.array([x, y]))
    return float(ground.quality[i, j])


def easy(places: np.ndarray) -> np.ndarray:
    return np.ones(len(places), dtype=bool)


def test_feet_keep_off_edges_and_stand_well_away_from_them():
    ground = rate_ground(kerb())
    assert quality(ground, 0.095) == quality(ground, 0.105) == 0.0
    assert 0.0 < quality(ground, 0.125) < 1.0
    assert quality(ground, 0.155) == quality(ground, 0.035) == 1.0


def test_unknown_ground_is_none_and_a_small_hole_in_even_ground_spoils_only_itself():
    height = np.zeros((60, 60))
    height[:, 40:] = np.nan
    height[30, 15] = np.nan
    ground = rate_ground(ground_map(height))
    assert quality(ground, 0.25) == quality(ground, 0.195) == 0.0
    assert quality(ground, -0.045, 0.005) == 0.0
    assert quality(ground, -0.035, 0.005) == 1.0
    assert not rate_ground(ground_map(np.full((5, 5), np.nan))).quality.any()
    assert not rate_ground(ground_map(np.zeros((60, 60)), confidence=0.1)).quality.any()


def test_steep_ground_is_none_and_a_ramp_of_ten_degrees_is_good():
    slope = np.tile(np.arange(60) * CELL, (60, 1))
    assert quality(rate_ground(ground_map(np.tan(np.radians(10.0)) * slope)), 0.1) == pytest.approx(1.0)
    assert quality(rate_ground(ground_map(0.6 * slope)), 0.1) == 0.0


def test_the_nearest_good_place_is_chosen_and_nothing_unknown():
    ground = rate_ground(kerb())
    choice = choose(ground, np.array([0.1, 0.0]), easy, None, ChoiceConfig())
    assert choice.found
    assert choice.quality == quality(ground, *choice.place[:2])
    assert 0.015 <= abs(choice.place[0] - 0.1) < 0.05
    assert choice.place[2] == pytest.approx(0.03 if choice.place[0] > 0.1 else 0.0)
    assert choose(ground, np.array([0.0, 0.0]), easy, None, ChoiceConfig()).place[:2] == pytest.approx(
        [0.0, 0.0], abs=0.75 * CELL
    )


@pytest.mark.parametrize("nominal", [(5.0, 0.0), (np.nan, 0.0)])
def test_where_there_is_no_map_there_is_no_foothold(nominal):
    choice = choose(rate_ground(kerb()), np.array(nominal), easy, None, ChoiceConfig())
    assert not choice.found
    assert choice.reason
    assert np.isnan(choice.place).all()


def test_what_the_leg_does_not_hold_is_not_chosen():
    ground = rate_ground(kerb())

    def low(places):
        return places[:, 2] < 0.01

    choice = choose(ground, np.array([0.12, 0.0]), low, None, ChoiceConfig())
    assert choice.found
    assert choice.place[2] == 0.0
    nowhere = choose(ground, np.array([0.12, 0.0]), lambda places: places[:, 2] > 1.0, None, ChoiceConfig())
    assert "reach" in nowhere.reason


def test_a_choice_stays_while_another_is_hardly_better():
    ground = rate_ground(ground_map(np.zeros((60, 60))))
    last = np.array([0.015, 0.005])
    assert choose(ground, np.array([0.006, 0.005]), easy, last, ChoiceConfig()).place[:2] == pytest.approx(
        last
    )
    assert choose(ground, np.array([0.006, 0.005]), easy, None, ChoiceConfig()).place[0] == pytest.approx(
        0.005
    )


def test_a_swing_clears_the_highest_between():
    height = np.zeros((60, 60))
    height[28:32, 30] = 0.04
    ground = rate_ground(ground_map(height))
    assert highest_between(ground, np.array([0.0, 0.0]), np.array([0.2, 0.0]), 0.03) == pytest.approx(0.04)
    assert highest_between(ground, np.array([0.0, 0.1]), np.array([0.2, 0.1]), 0.03) == 0.0
    assert np.isnan(highest_between(ground, np.array([9.0, 0.1]), np.array([9.2, 0.1]), 0.03))
    assert height_around(ground, np.array([0.105, 0.0])) == pytest.approx(0.04)
    assert np.isnan(height_around(ground, np.array([9.0, 0.0])))


@pytest.mark.parametrize("wrong", [{"edge": 0.0}, {"least_confidence": 2.0}, {"distance": 0.001}])
def test_ratings_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ConfigurationError):
        RatingConfig(**wrong)


def test_no_way_from_nowhere():
    assert math.isnan(highest_between(rate_ground(kerb()), np.array([np.nan, 0.0]), np.zeros(2), 0.03))


@pytest.mark.parametrize(("width", "spoils"), [(1, False), (2, False), (3, True)])
def test_a_crack_that_a_foot_fits_into_has_edges(width, spoils):
    height = np.zeros((60, 60))
    height[:, 30 : 30 + width] = np.nan
    assert (rate_ground(ground_map(height)).quality[30, 29] == 0.0) == spoils


def test_the_corner_of_what_is_unknown_is_an_edge_too():
    height = np.zeros((60, 60))
    height[30:, 30:] = np.nan
    quality = rate_ground(ground_map(height)).quality
    assert quality[29, 31] == quality[31, 29] == quality[29, 29] == 0.0
