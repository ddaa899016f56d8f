"""The simulated body behind emulated devices."""

import math

import numpy as np
import pytest

from bluefoot_mpc.io.emulation.shafts import COUNT, MIDDLE, ShaftDrive
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.plant import SimPlant
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import N_JOINTS, JointCommand


@pytest.fixture
def standing(model: RobotModel) -> Posture:
    return Posture(joints=model.stance_joints, height=float(model.default_stance()[2]))


@pytest.fixture(scope="module")
def model() -> RobotModel:
    from bluefoot_mpc.model.robot import load_robot

    return load_robot()


def hold(plant: SimPlant, joints: np.ndarray, **registers) -> None:
    for index, angle in enumerate(joints):
        plant.drive(index, ShaftDrive(enabled=True, goal=MIDDLE + round(angle / COUNT), **registers))


def test_it_begins_limp_and_sinks_without_torque(model, standing):
    plant = SimPlant(model, SimConfig(settle_time=0.005), standing)
    before = plant.truth().q[2]
    plant.advance(0.3)
    assert plant.truth().q[2] < before - 0.02
    assert np.abs(plant.truth().motor_torque).max() == 0.0


def test_driven_shafts_hold_the_body_as_the_simulated_robot_does(model, standing):
    # It must not sag before it is held: friction would keep it from coming up all the way.
    plant = SimPlant(model, SimConfig(settle_time=0.005), standing)
    hold(plant, model.stance_joints)
    plant.advance(1.0)
    robot = SimRobot(model, SimConfig())
    command = JointCommand(position=model.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16))
    for _ in range(50):
        robot.step(command)
    np.testing.assert_allclose(plant.truth().q[2], robot.truth().q[2], atol=1e-3)
    np.testing.assert_allclose(plant.truth().q[7:], robot.truth().q[7:], atol=0.02)


def test_time_passes_in_any_pieces_alike(model, standing):
    ends = []
    for pieces in ([0.2], [0.0013, 0.0047, 0.0999, 0.1, 0.15, 0.2], np.linspace(0.0, 0.2, 57)):
        plant = SimPlant(model, SimConfig(), standing, seed=3)
        hold(plant, model.stance_joints)
        for time in pieces:
            plant.advance(float(time))
        ends.append((plant.truth().q, plant.samples(0.0).gyro))
    for q, gyro in ends[1:]:
        np.testing.assert_array_equal(q, ends[0][0])
        np.testing.assert_array_equal(gyro, ends[0][1])


def test_samples_come_at_the_imus_rate_and_once(model, standing):
    plant = SimPlant(model, SimConfig(), standing)
    plant.advance(0.1)
    batch = plant.samples(0.0)
    np.testing.assert_allclose(batch.time, 0.005 * np.arange(1, 21), atol=1e-9)
    assert len(plant.samples(float(batch.time[-3])).time) == 2
    assert len(plant.samples(0.1).time) == 0
    assert plant.samples(0.1).gyro.shape == (0, 3)


def test_a_zero_of_its_own(model, standing):
    plant = SimPlant(model, SimConfig(), standing)
    plant.begin(1000.0)
    plant.advance(1000.05)
    assert plant.truth().time == pytest.approx(1000.05)
    assert plant.samples(1000.0).time[0] == pytest.approx(1000.005)
    assert plant.switches()[1] == pytest.approx(1000.05, abs=0.02)


def test_registers_act(model, standing):
    plant = SimPlant(model, SimConfig(), standing)
    hold(plant, model.stance_joints)
    plant.advance(0.5)
    raised = np.array(model.stance_joints)
    raised[3] += 0.5
    hold(plant, raised, speed=20)
    plant.advance(0.6)
    slow = plant.state(3).angle - model.stance_joints[3]
    assert 0.0 < slow < 0.2 * math.radians(0.1 * 20 * 0.111 * 6.0) * 10.0
    plant.drive(3, ShaftDrive(enabled=False))
    plant.advance(0.7)
    assert plant.state(3).load == 0.0
    plant.drive(7, ShaftDrive(enabled=True, is_wheel=True, speed=512 | 1 << 10))
    plant.advance(0.75)
    assert plant.state(7).load == pytest.approx(-512 / 1023.0)


def test_the_supply_can_be_changed_until_reset(model, standing):
    plant = SimPlant(model, SimConfig(), standing)
    plant.advance(0.05)
    before = plant.voltage()
    plant.set_supply(9.0)
    plant.advance(0.1)
    assert plant.voltage() < before - 2.0
    assert plant.current() > 0.0
    plant.reset()
    assert plant.voltage() == pytest.approx(before, abs=0.11)


def test_truth_remembers_a_touch_between_two_looks(model, standing):
    plant = SimPlant(model, SimConfig(settle_time=0.005), standing)
    plant.advance(2.0)
    assert plant.truth().touching
    assert len(plant.truth().motor_torque) == N_JOINTS
    assert not plant.truth().touching  # nothing has passed since
