"""Dynamic terms against their laws and finite differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.legs import feet_in_base, foot_jacobians_in_base
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.types import FloatArray

STEP = 1e-6
SEEDS = range(5)


@pytest.fixture(scope="module")
def robot() -> RobotModel:
    return load_robot()


@pytest.fixture(scope="module")
def dynamics(robot: RobotModel) -> Dynamics:
    return Dynamics(robot)


def random_state(seed: int) -> tuple[FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    quaternion = rng.normal(size=4)
    q = np.concatenate(
        [rng.uniform(-1, 1, 3), quaternion / np.linalg.norm(quaternion), rng.uniform(-1.2, 1.2, 16)]
    )
    return q, rng.normal(size=22)


def shifted(robot: RobotModel, q: FloatArray, v: FloatArray, h: float) -> FloatArray:
    return np.array(pin.integrate(robot.pin_model, q, h * v))


@pytest.mark.parametrize("seed", SEEDS)
def test_mass_matrix_is_symmetric_positive_definite_and_gives_kinetic_energy(
    dynamics: Dynamics, seed: int
) -> None:
    q, v = random_state(seed)
    matrix = dynamics.mass_matrix(q)
    np.testing.assert_array_equal(matrix, matrix.T)
    assert np.linalg.eigvalsh(matrix)[0] > 0.0
    assert 0.5 * v @ matrix @ v == pytest.approx(dynamics.kinetic_energy(q, v), rel=1e-12)
    np.testing.assert_allclose(matrix[:3, :3], dynamics.mass * np.eye(3), atol=1e-14)


def test_rotors_add_their_inertia_to_the_joints_alone(robot: RobotModel, dynamics: Dynamics) -> None:
    q, v = random_state(0)
    with_rotors = Dynamics(robot, rotor_inertia=True)
    extra = with_rotors.mass_matrix(q) - dynamics.mass_matrix(q)
    expected = np.diag([0.0] * 6 + [robot.parameters.servo.armature] * 16)
    np.testing.assert_allclose(extra, expected, atol=1e-17)
    assert 0.5 * v @ with_rotors.mass_matrix(q) @ v == pytest.approx(with_rotors.kinetic_energy(q, v))
    np.testing.assert_array_equal(with_rotors.bias(q, v), dynamics.bias(q, v))


@pytest.mark.parametrize("seed", SEEDS)
def test_gravity_is_the_slope_of_potential_energy(robot: RobotModel, dynamics: Dynamics, seed: int) -> None:
    q, _ = random_state(seed)
    higher = [dynamics.potential_energy(shifted(robot, q, e, STEP)) for e in np.eye(22)]
    lower = [dynamics.potential_energy(shifted(robot, q, e, -STEP)) for e in np.eye(22)]
    slopes = np.subtract(higher, lower) / (2 * STEP)
    np.testing.assert_allclose(dynamics.gravity(q), slopes, atol=1e-7)
    assert dynamics.potential_energy(q) == pytest.approx(dynamics.mass * GRAVITY * dynamics.com(q)[2])


@pytest.mark.parametrize("seed", SEEDS)
def test_coriolis_forces_do_the_work_that_the_mass_matrix_takes(
    robot: RobotModel, dynamics: Dynamics, seed: int
) -> None:
    q, v = random_state(seed)
    coriolis = dynamics.coriolis(q, v)
    np.testing.assert_allclose(dynamics.coriolis_matrix(q, v) @ v, coriolis, atol=1e-12)
    before, after = shifted(robot, q, v, -STEP), shifted(robot, q, v, STEP)
    rate = (dynamics.mass_matrix(after) - dynamics.mass_matrix(before)) / (2 * STEP)
    assert v @ coriolis == pytest.approx(0.5 * v @ rate @ v, rel=1e-5, abs=1e-7)


@pytest.mark.parametrize("seed", SEEDS)
def test_foot_jacobians_and_drifts_are_derivatives(robot: RobotModel, dynamics: Dynamics, seed: int) -> None:
    q, v = random_state(seed)
    jacobians = dynamics.foot_jacobians(q)
    before, after = shifted(robot, q, v, -STEP), shifted(robot, q, v, STEP)
    velocity = (dynamics.foot_positions(after) - dynamics.foot_positions(before)) / (2 * STEP)
    np.testing.assert_allclose(jacobians @ v, velocity, atol=1e-8)
    change = (dynamics.foot_jacobians(after) - dynamics.foot_jacobians(before)) / (2 * STEP)
    np.testing.assert_allclose(dynamics.foot_drifts(q, v), change @ v, atol=1e-7)


@pytest.mark.parametrize("seed", SEEDS)
def test_pinocchio_agrees_with_the_closed_form_kinematics(
    robot: RobotModel, dynamics: Dynamics, seed: int
) -> None:
    q, _ = random_state(seed)
    rotation = pin.Quaternion(q[3:7]).matrix()
    feet = feet_in_base(robot.geometry, q[7:])
    np.testing.assert_allclose(dynamics.foot_positions(q), q[:3] + feet @ rotation.T, atol=1e-13)
    own = foot_jacobians_in_base(robot.geometry, q[7:])
    for leg in range(4):
        block = dynamics.foot_jacobians(q)[leg][:, 6 + 4 * leg : 10 + 4 * leg]
        np.testing.assert_allclose(block, rotation @ own[leg], atol=1e-13)


@pytest.mark.parametrize("seed", SEEDS)
def test_centroidal_momentum_is_mass_times_com_velocity_and_conserved(
    robot: RobotModel, dynamics: Dynamics, seed: int
) -> None:
    q, v = random_state(seed)
    momentum = dynamics.centroidal_momentum(q, v)
    np.testing.assert_allclose(dynamics.centroidal_matrix(q) @ v, momentum, atol=1e-12)
    before, after = shifted(robot, q, v, -STEP), shifted(robot, q, v, STEP)
    com_velocity = (dynamics.com(after) - dynamics.com(before)) / (2 * STEP)
    np.testing.assert_allclose(momentum[:3], dynamics.mass * com_velocity, atol=1e-8)
    # Free fall with limp joints: gravity changes the linear momentum, nothing the angular one.
    acceleration = np.linalg.solve(dynamics.mass_matrix(q), -dynamics.bias(q, v))
    h = 1e-5
    later = []
    for t in (h, -h):
        q_then = shifted(robot, q, v + 0.5 * t * acceleration, t)
        later.append(dynamics.centroidal_momentum(q_then, v + t * acceleration))
    rate = (later[0] - later[1]) / (2 * h)
    np.testing.assert_allclose(rate, [0, 0, -dynamics.mass * GRAVITY, 0, 0, 0], atol=1e-5)


def test_standing_robot_is_held_by_forces_at_its_feet(robot: RobotModel, dynamics: Dynamics) -> None:
    """Quarter weights at the feet of the default stance leave only the offset of the COM to the trunk."""
    q = robot.default_stance()
    forces = np.zeros((4, 3))
    forces[:, 2] = 0.25 * dynamics.mass * GRAVITY
    rest = dynamics.gravity(q) - np.einsum("lij,li->j", dynamics.foot_jacobians(q), forces)
    np.testing.assert_allclose(rest[:4], 0.0, atol=1e-12)
    assert abs(rest[4]) < dynamics.mass * GRAVITY * 1e-3
    assert np.abs(rest[6:]).max() < 0.3 * robot.parameters.servo.stall_torque


def test_results_do_not_share_memory(dynamics: Dynamics) -> None:
    (q1, v1), (q2, v2) = random_state(1), random_state(2)
    first = [
        dynamics.mass_matrix(q1), dynamics.bias(q1, v1), dynamics.gravity(q1),
        dynamics.foot_positions(q1), dynamics.foot_jacobians(q1), dynamics.foot_drifts(q1, v1),
        dynamics.com(q1), dynamics.centroidal_momentum(q1, v1), dynamics.centroidal_matrix(q1),
        dynamics.coriolis_matrix(q1, v1),
    ]  # fmt: skip
    kept = [value.copy() for value in first]
    for method in (
        dynamics.bias,
        dynamics.foot_drifts,
        dynamics.centroidal_momentum,
        dynamics.coriolis_matrix,
    ):
        method(q2, v2)
    for single in (dynamics.mass_matrix, dynamics.gravity, dynamics.foot_positions, dynamics.foot_jacobians):
        single(q2)
    dynamics.com(q2)
    dynamics.centroidal_matrix(q2)
    for value, copy in zip(first, kept, strict=True):
        np.testing.assert_array_equal(value, copy)
