import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.wbc import WholeBodyModel

RPY = np.array([0.1, -0.15, 0.2])


@pytest.fixture(scope="module")
def robot():
    return load_robot()


def stances(robot, count):
    rng = np.random.default_rng(2)
    return [robot.stance_joints + rng.uniform(-0.25, 0.25, 16) for _ in range(count)]


def true_com(robot, joints):
    """(3,) m, centre of mass from the trunk's origin, in the trunk's axes, with every link's inertia."""
    model = WholeBodyModel.from_robot(robot).pin_model
    q = np.concatenate([np.zeros(6), [1.0], joints])
    return np.array(pin.centerOfMass(model, model.createData(), q))


def test_the_lumped_robot_weighs_what_the_robot_weighs(robot):
    masses = LegMasses(robot.parameters).masses
    model = WholeBodyModel.from_robot(robot)
    assert 9.80665 * masses.total == pytest.approx(model.weight, rel=1e-3)


def test_its_centre_of_mass_is_close_to_that_of_all_links_and_moves_alike(robot):
    lumped = LegMasses(robot.parameters)
    pairs = np.array([(lumped.com(joints), true_com(robot, joints)) for joints in stances(robot, 20)])
    np.testing.assert_allclose(pairs[:, 0, :2], pairs[:, 1, :2], atol=0.003)
    moved = pairs - pairs[:, :, :].mean(axis=0)
    np.testing.assert_allclose(moved[:, 0, :2], moved[:, 1, :2], atol=0.002)
    assert np.abs(moved[:, 1, :2]).max() > 0.004  # there was something to follow


def test_a_commanded_tilt_turns_everything_with_the_trunk(robot):
    masses, joints = LegMasses(robot.parameters), robot.stance_joints
    com = masses.com(joints)
    masses.turn(RPY)
    np.testing.assert_allclose(masses.com(joints), rotation_from_rpy(RPY) @ com, atol=1e-15)
    masses.turn(np.zeros(3))
    np.testing.assert_array_equal(masses.com(joints), com)
