import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.formulas import (
    MECANUM_DIRECTIONS,
    ackermann_angles,
    front_way,
    front_wheel_motion,
    mecanum_forward,
    mecanum_inverse,
    radians_per_second,
    rear_axle_motion,
    turning_radius,
)


def test_front_way_as_in_the_document():
    along, across = front_way(0.4, 0.3)
    assert (along, across) == pytest.approx((0.4 * math.cos(0.3), 0.4 * math.sin(0.3)))


def test_front_wheel_and_rear_axle_tell_the_same_turn():
    radius, wheelbase, angle, turns = 0.03, 0.18, 0.4, 1.5
    speed, rate = front_wheel_motion(radius, wheelbase, radians_per_second(turns), angle)
    assert speed == pytest.approx(2 * math.pi * radius * turns)
    assert rate == pytest.approx(2 * math.pi * radius * turns * math.sin(angle) / wheelbase)
    rear, same = rear_axle_motion(radius, wheelbase, radians_per_second(turns) * math.cos(angle), angle)
    assert rear == pytest.approx(speed * math.cos(angle))
    assert same == pytest.approx(rate)
    assert turning_radius(wheelbase, angle) == pytest.approx(rear / rate)


def test_ackermann_angles_point_at_one_centre():
    left, right = ackermann_angles(0.2, 0.12, 0.4)
    radius = turning_radius(0.2, 0.4)
    assert 0.2 / math.tan(left) == pytest.approx(radius - 0.06)
    assert 0.2 / math.tan(right) == pytest.approx(radius + 0.06)
    assert left > 0.4 > right
    assert ackermann_angles(0.2, 0.12, -0.4) == pytest.approx((-right, -left))
    assert ackermann_angles(0.2, 0.12, 0.0) == (0.0, 0.0)
    assert turning_radius(0.2, 0.0) == math.inf


@pytest.mark.parametrize(
    ("angle", "words"), [(math.pi / 2, "between"), (1.4, "inside the track"), (math.nan, "between")]
)
def test_ackermann_angles_that_no_car_has(angle, words):
    with pytest.raises(ConfigurationError, match=words):
        ackermann_angles(0.2, 0.15, angle)


def test_mecanum_matrices_are_each_others_inverse_and_agree_with_the_table():
    forward, inverse = mecanum_forward(0.05, 0.3, 0.4), mecanum_inverse(0.05, 0.3, 0.4)
    np.testing.assert_allclose(forward @ inverse, np.eye(3), atol=1e-15)
    np.testing.assert_allclose(forward, np.linalg.pinv(inverse), atol=1e-15)
    motions = {
        "forward": [1, 0, 0], "backward": [-1, 0, 0], "left": [0, 1, 0], "right": [0, -1, 0],
        "clockwise": [0, 0, -1], "counter-clockwise": [0, 0, 1],
    }  # fmt: skip
    for name, signs in MECANUM_DIRECTIONS.items():
        twist = forward @ np.array(signs)
        np.testing.assert_allclose(np.sign(np.round(twist, 12)), motions[name])
