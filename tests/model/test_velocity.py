import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import (
    LegGeometry,
    damped_inverse,
    feet_in_base,
    foot_jacobians_in_base,
    foot_velocities_in_world,
    joint_velocities,
)
from bluefoot_mpc.model.parameters import load_parameters
from tests.model.leg_samples import random_joints, uneven_geometry

BLUEFOOT = LegGeometry.from_parameters(load_parameters())


def feet_in_world(geometry, position, rotation, joints):
    return position + feet_in_base(geometry, joints) @ rotation.T


def moving_robot(geometry, rng):
    joints = random_joints(geometry, rng, 1)[0]
    rotation = rotation_from_rpy(rng.uniform(-0.5, 0.5, 3))
    return joints, rotation, rng.normal(size=6), rng.normal(size=16)


@pytest.mark.parametrize("geometry", [BLUEFOOT, uneven_geometry()], ids=["bluefoot", "uneven"])
def test_foot_velocities_are_finite_differences_of_a_moving_trunk(geometry):
    rng = np.random.default_rng(1)
    position, step = np.array([0.3, -0.2, 0.1]), 1e-6
    for _ in range(20):
        joints, rotation, twist, rates = moving_robot(geometry, rng)
        ends = []
        for sign in (-1.0, 1.0):
            time = sign * step
            turned = rotation @ pin.exp3(time * twist[3:])
            moved = position + time * rotation @ twist[:3]
            ends.append(feet_in_world(geometry, moved, turned, joints + time * rates))
        expected = (ends[1] - ends[0]) / (2 * step)
        feet, jacobians = feet_in_base(geometry, joints), foot_jacobians_in_base(geometry, joints)
        velocities = foot_velocities_in_world(rotation, twist, feet, jacobians, rates)
        np.testing.assert_allclose(velocities, expected, atol=1e-7)


def test_joint_velocities_bring_the_wanted_foot_velocities():
    rng = np.random.default_rng(2)
    for _ in range(20):
        joints, rotation, twist, _ = moving_robot(BLUEFOOT, rng)
        joints[2::4] = rng.uniform(-1.4, -0.5, 4)
        joints[3::4] = rng.uniform(-1.0, -0.3, 4)
        feet, jacobians = feet_in_base(BLUEFOOT, joints), foot_jacobians_in_base(BLUEFOOT, joints)
        wanted = rng.normal(size=(4, 3))
        rates = joint_velocities(rotation, twist, feet, jacobians, wanted, damping=1e-12)
        reached = foot_velocities_in_world(rotation, twist, feet, jacobians, rates)
        np.testing.assert_allclose(reached, wanted, atol=1e-5)


def test_standing_feet_follow_from_the_trunk_alone():
    """A trunk that turns on the spot over planted feet: only hip_yaw moves, against it."""
    joints = np.tile(np.radians([0.0, 9.11, -79.16, -28.95]), 4)
    feet, jacobians = feet_in_base(BLUEFOOT, joints), foot_jacobians_in_base(BLUEFOOT, joints)
    twist = np.array([0.0, 0.0, 0.0, 0.0, 0.0, 1.0])
    rates = joint_velocities(np.eye(3), twist, feet, jacobians, np.zeros((4, 3)), damping=1e-10)
    radius, reach = np.hypot(*feet[0, :2]), np.hypot(*feet[0, :2]) - 0.09215
    np.testing.assert_allclose(rates.reshape(4, 4)[:, 0], -radius / reach, rtol=1e-6)
    np.testing.assert_allclose(rates.reshape(4, 4)[:, 1:], 0.0, atol=1e-9)


def test_damped_inverse_solves_its_normal_equations():
    rng = np.random.default_rng(3)
    stack = rng.normal(size=(5, 3, 4))
    for damping in (0.1, np.array([0.1, 0.2, 0.3, 0.4])):
        inverse = damped_inverse(stack, damping)
        weights = np.diag(np.broadcast_to(damping, 4))
        for matrix, found in zip(stack, inverse, strict=True):
            expected = np.linalg.inv(matrix.T @ matrix + weights) @ matrix.T
            np.testing.assert_allclose(found, expected, atol=1e-12)


def test_damped_inverse_tends_to_the_pseudo_inverse_and_stays_bounded_when_singular():
    joints = np.tile(np.radians([10.0, 9.0, -79.0, -29.0]), 4)
    jacobians = foot_jacobians_in_base(BLUEFOOT, joints)
    np.testing.assert_allclose(
        damped_inverse(jacobians, 1e-12), np.linalg.pinv(jacobians), rtol=1e-4, atol=1e-6
    )
    stretched = foot_jacobians_in_base(BLUEFOOT, np.zeros(16))
    assert np.linalg.matrix_rank(stretched[0]) == 2
    # No singular value sigma gives more than sigma / (sigma² + lambda) <= 1 / (2 sqrt(lambda)).
    assert np.linalg.norm(damped_inverse(stretched, 1e-4)[0], 2) <= 50.0


@pytest.mark.parametrize("damping", [0.0, -1.0, np.array([1.0, 1.0, 0.0, 1.0])])
def test_damping_that_is_not_positive_is_refused(damping):
    with pytest.raises(ConfigurationError, match="must be positive"):
        damped_inverse(np.zeros((3, 4)), damping)
