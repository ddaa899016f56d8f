import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.constraints import (
    free_twists,
    radius_matrix,
    rank_of,
    rolling_matrix,
    sliding_matrix,
)
from bluefoot_mpc.wheels.ready import castor, differential, forward_wheel, omni, two_steer
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

L, R = 0.37, 0.05


def test_the_documents_differential_drive():
    robot = differential(L, R)
    assert [(w.alpha, w.beta) for w in robot.wheels] == [(math.pi / 2, 0.0), (-math.pi / 2, math.pi)]
    np.testing.assert_allclose(rolling_matrix(robot), [[1, 0, -L], [1, 0, L]], atol=1e-15)
    np.testing.assert_allclose(sliding_matrix(robot), [[0, 1, 0], [0, 1, 0]], atol=1e-15)
    np.testing.assert_allclose(radius_matrix(robot), R * np.eye(2), atol=1e-18)


def test_the_documents_motion_model_of_the_differential_drive():
    rows = np.vstack([rolling_matrix(differential(L, R)), sliding_matrix(differential(L, R))[:1]])
    expected = [[0.5, 0.5, 0], [0, 0, 1], [-0.5 / L, 0.5 / L, 0]]
    np.testing.assert_allclose(np.linalg.inv(rows), expected, atol=1e-15)


def test_the_documents_omni_robot():
    robot = omni(L, R)
    a = math.sqrt(3) / 2
    np.testing.assert_allclose(rolling_matrix(robot), [[a, -0.5, -L], [0, 1, -L], [-a, -0.5, -L]], atol=1e-15)
    np.testing.assert_allclose(radius_matrix(robot), R * np.eye(3), atol=1e-18)
    assert sliding_matrix(robot).shape == (0, 3)
    assert rank_of(sliding_matrix(robot), L) == 0


def test_the_documents_differential_drive_with_both_axes_outwards():
    wheels = [Wheel(kind="fixed", alpha=a, beta=0.0, length=L) for a in (math.pi / 2, -math.pi / 2)]
    rows = sliding_matrix(WheeledRobot(name="outwards", wheels=tuple(wheels)))
    np.testing.assert_allclose(rows, [[0, 1, 0], [0, -1, 0]], atol=1e-15)
    assert rank_of(rows, L) == 1


def test_the_documents_bicycle_with_fixed_wheels():
    wheels = [Wheel(kind="fixed", alpha=a, beta=math.pi / 2, length=L) for a in (0.0, math.pi)]
    rows = sliding_matrix(WheeledRobot(name="fixed bicycle", wheels=tuple(wheels)))
    np.testing.assert_allclose(rows, [[0, 1, L], [0, -1, L]], atol=1e-15)
    assert rank_of(rows, L) == 2


def test_fixed_rows_come_before_steered_ones_and_castors_forbid_nothing():
    robot = WheeledRobot(
        name="mixed",
        wheels=(forward_wheel("steered", 0.1, 0.0), castor(0.0, 0.1), forward_wheel("fixed", -0.1, 0.0)),
    )
    steering = np.array([0.5, 0.2, 0.0])
    rows = sliding_matrix(robot, steering)
    np.testing.assert_allclose(rows[0], sliding_matrix(robot, kinds=("fixed",))[0])
    np.testing.assert_allclose(rows[1], sliding_matrix(robot, steering, kinds=("steered",))[0])
    assert rows.shape == (2, 3)
    assert rolling_matrix(robot, steering).shape == (3, 3)


def test_free_twists_are_what_the_rows_permit():
    rows = sliding_matrix(two_steer(), np.array([0.4, -0.9, 0.0, 0.0]))
    free = free_twists(rows, 0.09)
    assert free.shape == (3, 1)
    np.testing.assert_allclose(rows @ free, 0.0, atol=1e-15)
    np.testing.assert_allclose(np.linalg.norm(free * [[1], [1], [0.09]]), 1.0)


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e3])
def test_rank_does_not_depend_on_the_robots_size(size):
    wheels = [Wheel(kind="fixed", alpha=a, beta=b, length=size) for a, b in ((0, 0), (2, 0.4), (4, 1.0))]
    robot = WheeledRobot(name="stuck", wheels=tuple(wheels))
    assert rank_of(sliding_matrix(robot), robot.size) == 3


@pytest.mark.parametrize(
    ("steering", "words"),
    [
        (np.zeros(3), "4 numbers"),
        (np.full(4, np.nan), "not finite"),
        (np.array([0.0, 0.0, 0.0, 0.0, 0.0]), "4 numbers"),
    ],
)
def test_wrong_steering_is_refused(steering, words):
    with pytest.raises(ConfigurationError, match=words):
        rolling_matrix(two_steer(), steering)


def test_a_fixed_wheel_cannot_be_steered():
    with pytest.raises(ConfigurationError, match="cannot be steered"):
        sliding_matrix(differential(), np.array([0.1, 0.0]))
