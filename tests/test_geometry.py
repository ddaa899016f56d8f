import itertools
import math

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.geometry import (
    convex_hull,
    quaternion_from_rpy,
    rotation_from_quaternion,
    rotation_from_rpy,
    rotation_z,
    rpy_from_quaternion,
    rpy_from_rotation,
    signed_margin,
    skew,
    wrap_angle,
    wrap_angles,
)

SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@pytest.mark.parametrize("turns", [-3, -1, 0, 1, 2])
@pytest.mark.parametrize("angle", [-3.0, -1e-9, 0.0, 0.5, 3.0, math.pi])
def test_wrapping_keeps_the_angle_and_the_half_open_range(angle, turns):
    wrapped = wrap_angle(angle + 2.0 * math.pi * turns)
    assert wrapped == pytest.approx(angle, abs=1e-12) or abs(wrapped) == pytest.approx(math.pi)
    assert -math.pi < wrapped <= math.pi
    assert wrap_angles(np.array([angle + 2.0 * math.pi * turns]))[0] == pytest.approx(wrapped, abs=1e-14)


def test_half_a_turn_is_positive_and_what_is_in_range_is_not_rounded():
    assert wrap_angle(-math.pi) == math.pi
    assert wrap_angle(math.pi) == math.pi
    assert wrap_angle(0.1) == 0.1
    np.testing.assert_array_equal(wrap_angles(np.array([-math.pi, 0.0])), [math.pi, 0.0])


def test_skew_is_the_cross_product():
    a, b = np.random.default_rng(0).normal(size=(2, 3))
    np.testing.assert_allclose(skew(a) @ b, np.cross(a, b), atol=1e-15)


@pytest.mark.parametrize("seed", range(5))
def test_orientations_agree_with_pinocchio_and_with_each_other(seed):
    rpy = np.random.default_rng(seed).uniform(-1.5, 1.5, 3)
    rotation = rotation_from_rpy(rpy)
    np.testing.assert_allclose(rotation, pin.rpy.rpyToMatrix(*rpy), atol=1e-15)
    quaternion = quaternion_from_rpy(rpy)
    np.testing.assert_allclose(rotation_from_quaternion(quaternion), rotation, atol=1e-15)
    np.testing.assert_allclose(pin.Quaternion(*quaternion[[3, 0, 1, 2]]).matrix(), rotation, atol=1e-15)
    np.testing.assert_allclose(rpy_from_rotation(rotation), rpy, atol=1e-14)
    np.testing.assert_allclose(rpy_from_quaternion(quaternion), rpy, atol=1e-14)
    np.testing.assert_allclose(
        rotation_z(rpy[2]), rotation_from_rpy(np.array([0.0, 0.0, rpy[2]])), atol=1e-15
    )


def test_pitch_survives_rounding_at_its_end():
    rotation = rotation_from_rpy(np.array([0.0, 0.5 * math.pi, 0.0]))
    rotation[2, 0] = -1.0 - 1e-12
    assert rpy_from_rotation(rotation)[1] == pytest.approx(0.5 * math.pi)


def test_the_hull_of_a_cloud_holds_every_point_and_is_counter_clockwise():
    points = np.random.default_rng(3).normal(size=(60, 2))
    hull = convex_hull(points)
    assert min(signed_margin(point, hull) for point in points) > -1e-12
    area = sum(a[0] * b[1] - a[1] * b[0] for a, b in itertools.pairwise([*hull, hull[0]]))
    assert area > 0.0


def test_the_hull_drops_points_on_its_edges():
    middles = 0.5 * (SQUARE + np.roll(SQUARE, -1, axis=0))
    hull = convex_hull(np.vstack([SQUARE, middles, [[0.5, 0.5]]]))
    assert sorted(map(tuple, hull.tolist())) == sorted(map(tuple, SQUARE.tolist()))


def test_hulls_of_few_points():
    np.testing.assert_array_equal(convex_hull(np.array([[1.0, 2.0], [1.0, 2.0]])), [[1.0, 2.0]])
    line = convex_hull(np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]))
    np.testing.assert_array_equal(np.sort(line, axis=0), [[0.0, 0.0], [2.0, 2.0]])


@pytest.mark.parametrize(
    ("point", "margin"),
    [
        ((0.5, 0.5), 0.5), ((0.5, 0.9), 0.1), ((0.25, 0.5), 0.25), ((0.5, 0.0), 0.0),
        ((0.5, 1.2), -0.2), ((1.3, 0.5), -0.3), ((1.3, 1.4), -0.5), ((-3.0, -4.0), -5.0),
    ],
)  # fmt: skip
def test_margins_of_a_square(point, margin):
    assert signed_margin(np.array(point), SQUARE) == pytest.approx(margin, abs=1e-12)


def test_margins_of_segments_and_points_are_negative_distances():
    segment = np.array([[0.0, 0.0], [2.0, 0.0]])
    assert signed_margin(np.array([1.0, 0.0]), segment) == 0.0
    assert signed_margin(np.array([1.0, -0.5]), segment) == pytest.approx(-0.5)
    assert signed_margin(np.array([5.0, 4.0]), segment) == pytest.approx(-5.0)
    assert signed_margin(np.array([3.0, 4.0]), np.zeros((1, 2))) == pytest.approx(-5.0)
