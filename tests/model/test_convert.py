"""Conversion between η with Euler angles and Pinocchio's q and v."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.convert import (
    angular_velocity_map,
    eta_from_q,
    eta_rate_from_v,
    q_from_eta,
    rpy_rate_from_angular_velocity,
    v_from_eta_rate,
    velocity_map,
)
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.types import FloatArray

SEEDS = range(20)


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return load_robot()


def random_eta(seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    eta = rng.uniform(-1.0, 1.0, 22)
    eta[3:6] *= [3.1, 1.4, 3.1]
    return eta, rng.normal(size=22)


@pytest.mark.parametrize("seed", SEEDS)
def test_there_and_back_is_the_identity(seed: int) -> None:
    eta, rate = random_eta(seed)
    q = q_from_eta(eta)
    np.testing.assert_allclose(eta_from_q(q), eta, atol=1e-12)
    np.testing.assert_allclose(eta_rate_from_v(q, v_from_eta_rate(eta, rate)), rate, atol=1e-11)


@pytest.mark.parametrize("seed", SEEDS)
def test_velocity_is_the_finite_difference_of_q(robot: RobotModel, seed: int) -> None:
    eta, rate = random_eta(seed)
    h = 1e-5
    before, after = q_from_eta(eta - h * rate), q_from_eta(eta + h * rate)
    # Pinocchio's own difference on the group, in the base frame, is the reference.
    middle = q_from_eta(eta)
    difference = pin.difference(robot.pin_model, middle, after) - pin.difference(
        robot.pin_model, middle, before
    )
    np.testing.assert_allclose(v_from_eta_rate(eta, rate), difference / (2.0 * h), atol=1e-7)


@pytest.mark.parametrize("seed", SEEDS)
def test_angular_velocity_is_that_of_the_rotation(seed: int) -> None:
    eta, rate = random_eta(seed)
    h = 1e-6
    rpy, d_rpy = eta[3:6], rate[3:6]
    change = (rotation_from_rpy(rpy + h * d_rpy) - rotation_from_rpy(rpy - h * d_rpy)) / (2.0 * h)
    spin = rotation_from_rpy(rpy).T @ change
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    np.testing.assert_allclose(angular_velocity_map(rpy) @ d_rpy, omega, atol=1e-8)
    np.testing.assert_allclose(rpy_rate_from_angular_velocity(rpy, omega), d_rpy, atol=1e-6)


def test_matrix_agrees_with_the_function_and_keeps_kinetic_energy(robot: RobotModel) -> None:
    eta, rate = random_eta(3)
    transform = velocity_map(eta)
    v = v_from_eta_rate(eta, rate)
    np.testing.assert_allclose(transform @ rate, v, atol=1e-14)
    q = q_from_eta(eta)
    dynamics = Dynamics(robot)
    mass = transform.T @ dynamics.mass_matrix(q) @ transform
    assert 0.5 * rate @ mass @ rate == pytest.approx(dynamics.kinetic_energy(q, v), rel=1e-12)


def test_signs_of_the_house() -> None:
    """Pitch positive is nose-down, roll positive right side down, yaw to the left."""
    forward, left = np.array([1.0, 0, 0]), np.array([0, 1.0, 0])
    eta = np.zeros(22)
    for index, moved, axis, sign in ((4, forward, 2, -1), (3, -left, 2, -1), (5, forward, 1, 1)):
        eta[:] = 0.0
        eta[index] = 0.1
        q = q_from_eta(eta)
        turned = pin.Quaternion(q[3:7]).matrix() @ moved
        assert np.sign(turned[axis]) == sign


def test_inputs_are_left_alone() -> None:
    eta, rate = random_eta(1)
    q, kept = q_from_eta(eta), (eta.copy(), rate.copy())
    eta_rate_from_v(q, rate)
    v_from_eta_rate(eta, rate)
    np.testing.assert_array_equal((eta, rate), kept)
