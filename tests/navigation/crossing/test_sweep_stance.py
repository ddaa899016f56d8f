"""Where the trunk stands over its feet while it sweeps, against the legs' own inverse."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import inverse, to_leg_frame, widest_directions
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.navigation.crossing.sweep_stance import ENOUGH, best_shift, reach_left
from tests.navigation.crossing.test_sweeper import state

FEET = np.array(
    [[0.158, 0.157, -0.113], [0.158, -0.157, -0.113], [-0.158, 0.157, -0.113], [-0.158, -0.157, -0.113]]
)
"""m from the trunk's origin, level axes."""
PITCH = math.radians(31.0)


@pytest.fixture(scope="module")
def legs():
    return load_robot().geometry


def standing(feet=FEET):
    return replace(state(0.0, 0.0), foot_position_in_base=feet)


def room(feet, legs, shift, pitch=PITCH):
    return float(reach_left(feet, legs, pitch, np.atleast_2d(shift))[0])


@pytest.mark.parametrize("seed", range(12))
def test_where_reach_is_left_the_inverse_holds_the_pose_and_elsewhere_it_does_not(legs, seed):
    rng = np.random.default_rng(seed)
    feet, shift = FEET + rng.uniform(-0.03, 0.03, (4, 3)), rng.uniform(-0.03, 0.03, 3)
    left = room(feet, legs, shift)
    if abs(left) < 0.003:  # neither here nor there
        return
    in_base = (feet - shift) @ rotation_from_rpy(np.array([0.0, PITCH, 0.0]))
    found = inverse(legs, in_base, widest_directions(legs, to_leg_frame(legs, in_base)))
    assert found.feasible == (left > 0.0), found.describe()


def test_a_trunk_that_reaches_far_enough_stays_where_it_is_wanted(legs):
    preferred = np.array([0.004, 0.0, 0.0])
    assert room(FEET, legs, preferred) > ENOUGH
    np.testing.assert_array_equal(best_shift(standing(), legs, PITCH, preferred), preferred)


@pytest.mark.parametrize(
    "moved", [(2, (-0.03, 0.02, 0.0)), (3, (-0.02, -0.01, -0.02)), (1, (-0.05, 0.03, 0.02))]
)
def test_after_a_walk_it_shifts_to_where_it_reaches_further(legs, moved):
    foot, by = moved
    feet = FEET.copy()
    feet[foot] += by
    preferred = np.zeros(3)
    assert room(feet, legs, preferred) < ENOUGH
    shift = best_shift(standing(feet), legs, PITCH, preferred)
    assert room(feet, legs, shift) > room(feet, legs, preferred)
    assert np.abs(shift).max() < 0.04
    assert shift[2] >= -0.012


def test_feet_that_are_no_numbers_change_nothing(legs):
    preferred = np.array([0.01, 0.0, 0.0])
    shift = best_shift(standing(FEET * np.nan), legs, PITCH, preferred)
    np.testing.assert_array_equal(shift, preferred)
