import math

import numpy as np
import pytest

from bluefoot_mpc.wheels.frames import moved, rotation_world_to_robot, twist_in_robot, twist_in_world


def test_the_documents_rotation():
    t = 0.7
    expected = [[math.cos(t), math.sin(t), 0], [-math.sin(t), math.cos(t), 0], [0, 0, 1]]
    np.testing.assert_allclose(rotation_world_to_robot(t), expected)


def test_there_and_back():
    twist = np.array([0.3, -0.1, 0.5])
    np.testing.assert_allclose(twist_in_robot(twist_in_world(twist, 1.1), 1.1), twist, atol=1e-15)
    np.testing.assert_allclose(twist_in_world(np.array([1.0, 0, 0]), math.pi / 2), [0, 1, 0], atol=1e-15)


@pytest.mark.parametrize("rate", [0.0, 1e-9, 0.4, -2.0])
def test_moved_is_the_limit_of_small_steps(rate):
    twist, pose, start = np.array([0.3, 0.1, rate]), np.array([1.0, -2.0, 0.5]), np.array([1.0, -2.0, 0.5])
    n = 20000
    for _ in range(n):
        middle = pose[2] + 0.5 * rate * 2.0 / n
        pose = pose + 2.0 / n * twist_in_world(twist, middle)
    np.testing.assert_allclose(moved(start, twist, 2.0), pose, atol=1e-8)


def test_half_a_circle_ends_across():
    np.testing.assert_allclose(
        moved(np.zeros(3), np.array([1.0, 0, 2.0]), math.pi / 2), [0, 1, math.pi], atol=1e-15
    )
