"""The training target is Φ of ``M v̇ = Γ2 τ + Φ``: its sign and the rotors are not a matter of taste.

The paper prints the opposite sign for the target, with which the law would push the wrong way.
"""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.leveling.trunk_dynamics import disturbance
from bluefoot_mpc.model.dynamics import Dynamics
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios.leveling import UNCOMPENSATED_TROT
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import JointCommand, MotionCommand
from tests.control.closed_loop import walk
from tests.leveling.bench import ROBOT

DT = 0.02
FINE = 0.001


def r_squared(truth: np.ndarray, estimate: np.ndarray) -> np.ndarray:
    """Share of the variance of every column (samples in rows) that an estimate explains."""
    spread = ((truth - truth.mean(axis=0)) ** 2).sum(axis=0)
    return 1.0 - ((estimate - truth) ** 2).sum(axis=0) / spread


def random_states(count):
    """(q, v, τ, f) of any state, with forces of the ground on the feet in world axes."""
    rng = np.random.default_rng(11)
    for _ in range(count):
        q = pin.normalize(ROBOT.pin_model, rng.uniform(-1.0, 1.0, 23))
        yield q, rng.normal(0.0, 2.0, 22), rng.normal(0.0, 0.5, 16), rng.normal(0.0, 10.0, (4, 3))


@pytest.fixture(scope="module")
def samples():
    """ψ of Pinocchio, ψ of the law, and ψ of the law without rotors in M̂, (n, 22) each."""
    dynamics, bare = Dynamics(ROBOT, rotor_inertia=True), Dynamics(ROBOT)
    rows = []
    for q, v, torque, force in random_states(200):
        phi = np.einsum("lij,li->j", dynamics.foot_jacobians(q), force) - dynamics.bias(q, v)
        drive = np.concatenate([np.zeros(6), torque])
        after = v + DT * np.linalg.solve(dynamics.mass_matrix(q), drive + phi)
        found = [disturbance(body.mass_matrix(q), v, after, torque, DT) for body in (dynamics, bare)]
        rows.append((phi, *found))
    return np.array(rows).transpose(1, 0, 2)


def test_the_target_is_the_force_of_ground_gravity_and_motion(samples):
    phi, found, _ = samples
    np.testing.assert_allclose(found, phi, atol=1e-7)
    assert r_squared(phi, found).min() == pytest.approx(1.0, abs=1e-10)


def test_the_printed_target_has_the_wrong_sign(samples):
    phi, found, _ = samples
    assert r_squared(phi, -found).max() < -2.9


def test_without_rotors_in_the_mass_matrix_it_is_another_force(samples):
    phi, found, bare = samples
    joints = slice(6, None)
    assert np.abs(found - phi)[:, joints].max() < 1e-7
    assert r_squared(phi, bare)[joints].max() < 0.9
    assert r_squared(phi, bare)[joints].min() < 0.0


def commands_of_a_walk(seconds: float) -> list[JointCommand]:
    """Commands of a slow trot at 60 mm/s, one per command period."""
    robot = SimRobot(ROBOT, SimConfig(), 0)
    pipeline = Pipeline(ROBOT, build(ControlConfig, {"gait": {"trot": UNCOMPENSATED_TROT}}), robot.period)
    frame, commands = robot.reset(), []
    for _ in range(round(seconds / robot.period)):
        command = pipeline.step(frame, walk(0.06) if frame.time > 1.5 else MotionCommand()).command
        commands.append(command)
        frame = robot.step(command)
    return commands


def watched(robot_model, period: float) -> SimRobot:
    """The simulated robot seen at every physics step, contact forces included."""
    config = SimConfig()
    sensors = replace(config.sensors, imu_period=period)
    return SimRobot(robot_model, replace(config, command_period=period, sensors=sensors), 0)


@pytest.fixture(scope="module")
def fine():
    """A trot seen every millisecond: Φ of Pinocchio, and ψ from true speeds and motor torques, (n, 22)."""
    servo = replace(ROBOT.parameters.servo, coulomb_friction=0.0, load_friction=0.0)
    # Dry friction is no motor torque either: it would belong to Φ, but Pinocchio does not know it.
    robot = watched(RobotModel(replace(ROBOT.parameters, servo=servo)), FINE)
    dynamics = Dynamics(ROBOT, rotor_inertia=True)
    robot.reset()
    before, rows = robot.truth(), []
    for command in commands_of_a_walk(4.0):
        for _ in range(round(DT / FINE)):
            robot.step(command)
            after = robot.truth()
            if before.time > 2.5:
                q, v = before.q, before.v
                phi = np.einsum("lij,li->j", dynamics.foot_jacobians(q), after.foot_force)
                phi -= dynamics.bias(q, v)
                psi = disturbance(dynamics.mass_matrix(q), v, after.v, after.motor_torque, FINE)
                rows.append((phi, psi))
            before = after
    return np.array(rows).transpose(1, 0, 2)


# Measured: 0.998 and more on the trunk, 0.978 and more on the joints, and -2.9 at best with the other sign.
@pytest.mark.slow
def test_in_the_simulator_it_is_that_of_the_true_forces(fine):
    phi, psi = fine
    explained = r_squared(phi, psi)
    assert explained[:6].min() > 0.99
    assert explained[6:].min() > 0.95


@pytest.mark.slow
def test_in_the_simulator_the_printed_sign_explains_nothing(fine):
    phi, psi = fine
    assert r_squared(phi, -psi).max() < -2.5
