import math

import numpy as np
import pytest

from bluefoot_mpc.control.quick_inverse import QuickInverse
from bluefoot_mpc.model.legs import AnkleTable, feet_in_base, inverse
from bluefoot_mpc.model.robot import load_robot


@pytest.fixture(scope="module")
def legs():
    robot = load_robot()
    geometry = robot.geometry
    return geometry, AnkleTable(geometry), feet_in_base(geometry, robot.stance_joints)


def thorough(geometry, table, feet, shift=0.0):
    return inverse(geometry, feet, table.directions(feet) + shift)


@pytest.mark.parametrize("shift", [0.0, 0.1])
def test_answers_as_the_thorough_way_and_only_where_nothing_stands_against_it(legs, shift):
    geometry, table, stance = legs
    quick, rng = QuickInverse(geometry, table), np.random.default_rng(4)
    answered = 0
    for size in [0.01, 0.05, 0.15] * 60:
        feet = stance + rng.uniform(-size, size, (4, 3))
        wanted, found = thorough(geometry, table, feet, shift), quick.joints(feet, shift)
        if found is not None:
            answered += 1
            assert wanted.feasible
            np.testing.assert_allclose(found, wanted.joints, rtol=0.0, atol=1e-12)
    assert 60 < answered < 180


def test_leaves_feet_at_a_bend_of_the_table_to_the_search(legs):
    geometry, table, stance = legs
    quick, rng = QuickInverse(geometry, table), np.random.default_rng(5)
    bends = np.isnan(table.grid[:-1]).any(axis=1).reshape(4, -1)
    assert bends.any()
    for _ in range(2000):
        feet = stance + rng.uniform(-0.08, 0.08, (4, 3))
        if quick.joints(feet) is None and thorough(geometry, table, feet).feasible:
            break
    else:
        pytest.fail("no foot fell into a cell without an answer")


def test_refuses_what_is_out_of_reach_or_not_a_number(legs):
    geometry, table, stance = legs
    quick = QuickInverse(geometry, table)
    for value in (1.0, math.nan, math.inf):
        feet = stance.copy()
        feet[2, 0] = value
        assert quick.joints(feet) is None
    assert quick.joints(stance) is not None
