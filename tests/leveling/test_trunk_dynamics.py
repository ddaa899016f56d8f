"""Γ1 M̂⁻¹ and the nominal mass matrix: coupled, averaged over a gait, with rotors."""

import numpy as np
import pytest

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.leveling import compensator
from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.leveling.trunk_dynamics import TrunkDynamics, disturbance, nominal_mass_matrix
from bluefoot_mpc.model.dynamics import Dynamics
from tests.leveling.bench import ROBOT, STANCE, SWINGING

DYNAMICS = Dynamics(ROBOT, rotor_inertia=True)
STANDING = DYNAMICS.mass_matrix(ROBOT.default_stance())
TRUNK, JOINTS = slice(0, 6), slice(6, 22)


@pytest.fixture(scope="module")
def recorded():
    """(n, 16) rad, the joints that the pipeline records, and the nominal mass matrix of its compensator."""
    rows = []
    original = compensator.nominal_mass_matrix
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            compensator,
            "nominal_mass_matrix",
            lambda d, joints: (rows.append(joints), original(d, joints))[1],
        )
        Pipeline(ROBOT, ControlConfig(leveling=LevelingConfig(enabled=True)), 0.02)
    (joints,) = rows
    return joints, original(DYNAMICS, joints)


def test_the_nominal_matrix_is_the_mean_over_a_gait_that_swings_every_leg(recorded):
    joints, nominal = recorded
    assert len(joints) > 50
    assert np.ptp(joints, axis=0).min() > 0.02
    poses = [np.concatenate([np.zeros(6), [1.0], row]) for row in joints]
    feet = np.array([DYNAMICS.foot_positions(q) for q in poses])
    np.testing.assert_allclose(
        feet.mean(axis=0)[:, :2], ROBOT.parameters.stance.foot_position[:, :2], atol=0.03
    )
    assert np.ptp(feet[..., 0], axis=0).min() > 0.01
    matrices = [DYNAMICS.mass_matrix(q) for q in poses]
    np.testing.assert_allclose(nominal, np.mean(matrices, axis=0), atol=1e-14)


def test_the_nominal_matrix_couples_trunk_and_joints(recorded):
    _, nominal = recorded
    block = nominal[TRUNK, JOINTS]
    assert np.abs(block).max(axis=0).min() > 1e-4  # every joint moves the trunk
    assert np.abs(nominal[3:6, JOINTS]).max(axis=1).min() > 1e-3  # and turns it about every axis


def test_the_nominal_matrix_is_a_mass_matrix_near_that_of_the_stance(recorded):
    _, nominal = recorded
    np.testing.assert_allclose(nominal, nominal.T, atol=1e-12)
    assert np.linalg.eigvalsh(nominal).min() > 1e-4
    assert nominal[0, 0] == pytest.approx(DYNAMICS.mass)
    apart = np.linalg.norm(nominal - STANDING) / np.linalg.norm(STANDING)
    assert 1e-4 < apart < 0.05


def test_it_does_not_depend_on_where_the_robot_is_or_looks():
    q = np.concatenate([[3.0, -2.0, 0.5], [0.1, 0.2, 0.3, np.sqrt(1.0 - 0.14)], STANCE])
    np.testing.assert_allclose(DYNAMICS.mass_matrix(q), STANDING, atol=1e-12)


@pytest.mark.parametrize("mass", [STANDING, nominal_mass_matrix(DYNAMICS, SWINGING)])
def test_its_parts_are_those_of_the_dense_formula(mass):
    made = TrunkDynamics.of(mass)
    inverse = np.linalg.inv(mass)
    np.testing.assert_array_equal(made.mass, mass)
    np.testing.assert_allclose(made.from_force, inverse[3:6], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(made.from_torque, inverse[3:6, 6:], rtol=1e-10, atol=1e-10)
    np.testing.assert_allclose(made.to_torque, np.linalg.pinv(inverse[3:6, 6:]), rtol=1e-8, atol=1e-10)


def uncoupled(mass: np.ndarray) -> np.ndarray:
    """A mass matrix without its block between trunk and joints."""
    apart = mass.copy()
    apart[TRUNK, JOINTS] = apart[JOINTS, TRUNK] = 0.0
    return apart


@pytest.mark.parametrize("mass", [uncoupled(STANDING), np.diag(np.diag(STANDING)), np.eye(22)])
def test_a_matrix_without_coupling_is_refused(mass):
    with pytest.raises(ConfigurationError, match="couple.*from the model"):
        TrunkDynamics.of(mass)


def test_a_matrix_that_is_no_number_is_refused():
    with pytest.raises(ConfigurationError, match="couple"):
        TrunkDynamics.of(np.full((22, 22), np.nan))


def test_rotors_belong_in_it():
    bare = TrunkDynamics.of(Dynamics(ROBOT).mass_matrix(ROBOT.default_stance()))
    whole = TrunkDynamics.of(STANDING)
    # The gears show the trunk's torque mostly the rotors: far less turns it than without them.
    assert np.linalg.norm(whole.to_torque) > 10.0 * np.linalg.norm(bare.to_torque)


def test_the_target_of_standing_still_is_what_the_motors_hold():
    torque = np.linspace(-0.5, 0.5, 16)
    target = disturbance(STANDING, np.ones(22), np.ones(22), torque, 0.02)
    np.testing.assert_array_equal(target, np.concatenate([np.zeros(6), -torque]))


def test_the_target_leaves_its_arguments_alone():
    before, after, torque = np.zeros(22), np.ones(22), np.ones(16)
    disturbance(STANDING, before, after, torque, 0.02)
    assert not before.any()
    assert np.all(after == 1.0)
    assert np.all(torque == 1.0)
