"""The robot as constants of the problem: any robot with named feet, and clear refusals."""

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.wbc import Actuators, WholeBodyModel
from tests.wbc.states import OTHERS, bluefoot, other


def test_bluefoot_has_its_servos() -> None:
    robot, model = load_robot(), bluefoot()
    servo = robot.parameters.servo
    assert model.joints == 16
    np.testing.assert_allclose(model.actuators.torque, servo.stall_torque)
    np.testing.assert_allclose(model.actuators.back_emf, servo.back_emf)
    np.testing.assert_allclose(model.actuators.armature, servo.armature)
    np.testing.assert_array_equal(model.actuators.upper, robot.upper)
    without = WholeBodyModel.from_robot(robot, rotor_inertia=False)
    assert not without.actuators.armature.any()
    assert model.weight == pytest.approx(1.9326 * 9.80665, rel=1e-4)
    assert 0.05 < model.size < 0.2


@pytest.mark.parametrize("name", OTHERS)
def test_other_robots_bring_their_limits(name: str) -> None:
    model = other(name)
    assert model.joints == 12
    assert np.isfinite(model.actuators.torque).all()
    assert not model.actuators.back_emf.any()


def test_a_robot_without_named_feet_lists_the_frames_there_are() -> None:
    with pytest.raises(ConfigurationError, match=r"no frame 'paw'.*FL_foot"):
        WholeBodyModel.from_pinocchio(load_robot().pin_model, ["paw"])
    with pytest.raises(ConfigurationError, match="trunk"):
        WholeBodyModel.from_pinocchio(load_robot().pin_model, ["trunk"])
    with pytest.raises(ConfigurationError, match="different"):
        WholeBodyModel.from_pinocchio(load_robot().pin_model, [])


def test_an_arm_on_a_table_is_refused() -> None:
    arm = pin.buildSampleModelManipulator()
    with pytest.raises(ConfigurationError, match="free flyer"):
        WholeBodyModel.from_pinocchio(arm, ["effector_body"])


def test_impossible_limits_are_refused() -> None:
    good = {name: np.ones(2) for name in ("torque", "back_emf", "speed", "upper", "armature")}
    Actuators(**good, lower=np.zeros(2))
    with pytest.raises(ConfigurationError, match="lower"):
        Actuators(**good, lower=np.ones(2))
    with pytest.raises(ConfigurationError, match="2 numbers"):
        Actuators(**good, lower=np.zeros(3))
    with pytest.raises(ConfigurationError, match="positive"):
        Actuators(**{**good, "torque": np.zeros(2)}, lower=np.zeros(2))
    with pytest.raises(ConfigurationError, match="negative"):
        Actuators(**{**good, "back_emf": -np.ones(2)}, lower=np.zeros(2))
    actuators = Actuators(**good, lower=np.zeros(2))
    with pytest.raises(ConfigurationError, match="do not fit"):
        WholeBodyModel.from_pinocchio(load_robot().pin_model, ["FL_foot"], actuators)


def test_missing_limits_mean_unlimited() -> None:
    model = load_robot().pin_model.copy()
    model.effortLimit = np.zeros(model.nv)
    assert np.isinf(Actuators.from_pinocchio(model).torque).all()
