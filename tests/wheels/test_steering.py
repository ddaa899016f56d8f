import math

import numpy as np
import pytest

from bluefoot_mpc.wheels.ready import READY, castor, forward_wheel
from bluefoot_mpc.wheels.steering import steering_for, trailing_angle, turn_for
from bluefoot_mpc.wheels.wheel import castor_rate, rolling_direction, sliding_row


def test_a_steered_wheel_turns_the_short_way_and_may_roll_backwards():
    wheel = forward_wheel("steered", 0.1, 0.0)
    assert turn_for(wheel, np.array([-1.0, 0.0, 0.0]), 0.0, 0.1) == pytest.approx(0.0, abs=1e-15)
    assert turn_for(wheel, np.array([-1.0, 0.0, 0.0]), 3.0, 0.1) == pytest.approx(math.pi)
    assert turn_for(wheel, np.array([0.0, 1.0, 0.0]), 0.1, 0.1) == pytest.approx(math.pi / 2)
    assert turn_for(wheel, np.array([0.0, 1.0, 0.0]), -0.1, 0.1) == pytest.approx(-math.pi / 2)


def test_a_wheel_in_the_centre_of_rotation_stays_as_it_is():
    wheel = forward_wheel("steered", 0.1, 0.0)
    assert turn_for(wheel, np.array([0.0, -0.1 * 0.5, 0.5]), 0.77, 0.1) == 0.77
    np.testing.assert_array_equal(steering_for(READY["two_steer"](), np.zeros(3)), 0.0)


@pytest.mark.parametrize("offset", [-0.02, 0.02])
@pytest.mark.parametrize("rate", [0.0, 1.0, -2.5])
def test_a_castor_comes_to_rest_where_it_trails(offset, rate):
    wheel, twist = castor(0.05, 0.08, offset=offset), np.array([0.2, 0.1, rate])
    angle = trailing_angle(wheel, twist, 0.0)
    assert sliding_row(wheel, angle) @ twist == pytest.approx(0.0, abs=1e-12)
    for start in (angle + 0.5, angle - 2.0, angle + 3.0):
        turn = start
        for _ in range(4000):
            turn += 1e-3 * castor_rate(wheel, twist, turn)
        assert math.remainder(turn - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-6)
    # The contact lies behind the pivot as the pivot moves.
    pivot = twist[:2] + rate * np.array([-0.08, 0.05])
    assert (offset * rolling_direction(wheel, angle)) @ pivot < 0.0


def test_a_castor_that_only_turns_has_no_angle_of_rest():
    wheel = castor(0.0, 0.0)
    assert trailing_angle(wheel, np.array([0.0, 0.0, 1.0]), 0.3) == 0.3
