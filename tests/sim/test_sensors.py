from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.sim.config import SensorConfig, SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.sensors import FootSwitches, Imu, ServoSensors
from bluefoot_mpc.types import JointCommand

TRUTH = np.tile([0.1, -0.2, 0.3, 1.0, 2.0, 9.8, 0.4, 0.0, -0.9], (4, 1))


def imu_run(imu, frames):
    batches = [
        imu.measure(np.arange(4) * 0.005 + k * 0.02, TRUTH[:, :6], TRUTH[:, 6:]) for k in range(frames)
    ]
    return tuple(np.vstack([getattr(b, name) for b in batches]) for name in ("gyro", "accel", "magnetometer"))


def test_imu_noise_has_the_stated_sizes():
    config = SensorConfig(gyro_bias=0.0, accel_bias=0.0, magnetometer_bias=0.0, gyro_drift=0.0)
    gyro, accel, field = imu_run(Imu(config, 0), 2500)
    assert (gyro - TRUTH[0, 0:3]).std(axis=0) == pytest.approx(np.full(3, 0.01), rel=0.04)
    assert (accel - TRUTH[0, 3:6]).std(axis=0) == pytest.approx(np.full(3, 0.1), rel=0.04)
    assert (gyro - TRUTH[0, 0:3]).mean(axis=0) == pytest.approx(np.zeros(3), abs=4e-4)
    seen = field[~np.isnan(field[:, 0])]
    assert len(seen) == 2500
    assert (seen - TRUTH[0, 6:9]).std(axis=0) == pytest.approx(np.full(3, 0.01), rel=0.06)


def test_imu_biases_fill_their_range_over_seeds():
    biases = np.array([Imu(SensorConfig(), seed).gyro_bias for seed in range(200)])
    assert 0.018 < np.abs(biases).max() <= 0.02
    assert biases.std() == pytest.approx(0.02 / np.sqrt(3), rel=0.1)
    accel = np.array([Imu(SensorConfig(), seed).accel_bias for seed in range(200)])
    assert 0.027 < np.abs(accel).max() <= 0.03


def test_gyro_bias_walks_by_its_drift_in_a_minute():
    changes = []
    rare = SensorConfig(magnetometer_divider=10_000)
    for seed in range(80):
        imu = Imu(rare, seed)
        before = imu.gyro_bias
        for k in range(12):
            # Five seconds in one batch: what counts is the time, not the number of frames.
            imu.measure(np.arange(1000) * 0.005 + 5 * k, np.zeros((1000, 6)), np.zeros((1000, 3)))
        changes.append(imu.gyro_bias - before)
    assert np.std(changes) == pytest.approx(0.001, rel=0.15)


def test_another_sensor_noise_leaves_the_rest_alone():
    loud = imu_run(Imu(SensorConfig(gyro_noise=0.5, gyro_bias=0.0), 3), 5)
    quiet = imu_run(Imu(SensorConfig(), 3), 5)
    assert not np.array_equal(loud[0], quiet[0])
    assert np.array_equal(loud[1], quiet[1])
    assert np.array_equal(loud[2], quiet[2], equal_nan=True)


def test_magnetometer_comes_at_its_own_rate():
    _, _, field = imu_run(Imu(SensorConfig(), 0), 3)
    assert (~np.isnan(field[:, 0])).nonzero()[0].tolist() == [0, 4, 8]


def switch_run(config, force_of_time, ticks, seed=0):
    """State of the first switch at 1 kHz, sampled at 200 Hz."""
    switches, states = FootSwitches(config, seed), []
    for tick in range(ticks):
        time = 0.005 * tick
        force = np.zeros((1, 4))
        force[0, 0] = force_of_time(time)
        state, when = switches.measure([time], force, time)
        assert when <= time - config.switch_delay + 1e-9
        states.append(bool(state[0]))
    return states


def test_switch_is_late_and_has_a_threshold():
    config = SensorConfig(switch_chatter=0.0)
    states = switch_run(config, lambda t: 1.0 if t >= 0.1 else 0.29, 40)
    assert states.index(True) * 0.005 == pytest.approx(0.110)
    assert all(states[22:])
    late = switch_run(SensorConfig(switch_chatter=0.0, switch_delay=0.025), lambda t: float(t >= 0.1), 40)
    assert late.index(True) * 0.005 == pytest.approx(0.125)


def test_chattering_edge_falls_back_once():
    states = switch_run(SensorConfig(switch_chatter=1.0), lambda t: float(t >= 0.1), 40)
    assert np.diff(np.array(states, dtype=int)).nonzero()[0].size == 3
    assert states[22]
    assert not states[23]
    assert not states[24]
    assert all(states[25:])


def test_one_edge_in_a_hundred_chatters():
    switches, edges, changes = FootSwitches(SensorConfig(), 1), 2500, 0
    last = np.zeros(4, dtype=bool)
    for tick in range(5 * edges):
        time = 0.005 * tick
        force = np.full((1, 4), float(tick // 5 % 2 == 0))
        state, _ = switches.measure([time], force, time)
        changes += int((state != last).sum())
        last = state
    chatters = (changes / 4 - edges) / 2
    assert chatters / edges == pytest.approx(0.01, abs=0.003)


def test_servo_reports():
    config, servo = SensorConfig(), load_parameters().servo
    reports = ServoSensors(config, servo, 0)
    position, speeds = np.full(16, 0.3), []
    for _ in range(400):
        position = position + 0.02 * 0.5
        seen, speed, load = reports.measure(position, np.full(16, 0.25), 0.02)
        assert np.abs(seen - position).max() <= 0.5 * servo.step_angle + 1e-12
        speeds.append(speed)
    assert np.mean(speeds[1:]) == pytest.approx(0.5, abs=0.005)
    assert np.std(speeds[1:]) == pytest.approx(0.1, rel=0.05)
    assert load == pytest.approx(np.full(16, 0.25), abs=0.1)


def test_robot_measures_gravity_field_and_contacts():
    model = load_robot()
    robot = SimRobot(model, SimConfig())
    stand = JointCommand(position=model.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16))
    frames = [robot.step(stand) for _ in range(100)]
    accel = np.vstack([f.imu.accel for f in frames]).mean(axis=0)
    gyro = np.vstack([f.imu.gyro for f in frames]).mean(axis=0)
    assert accel == pytest.approx([0.0, 0.0, 9.80665], abs=0.06)
    assert np.abs(gyro).max() < 0.022
    field = np.nanmean(np.vstack([f.imu.magnetometer for f in frames]), axis=0)
    dip = np.radians(65.0)
    assert field == pytest.approx([np.cos(dip), 0.0, -np.sin(dip)], abs=0.04)
    assert all(len(f.imu.time) == 4 for f in frames)
    assert np.diff(np.concatenate([f.imu.time for f in frames])) == pytest.approx(np.full(399, 0.005))


def test_accelerometer_feels_its_lever_arm():
    parameters = load_parameters()
    sensors = replace(parameters.sensors, imu=(0.1, 0.0, 0.0))
    model = RobotModel(replace(parameters, sensors=sensors))
    robot = SimRobot(model, SimConfig())
    robot.data.qpos[2] += 2.0
    robot.data.qvel[:] = 0.0
    robot.data.qvel[5] = 8.0
    stand = JointCommand(position=model.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16))
    # The first window still holds the jump to this state.
    accel = robot.step(stand).imu.accel[1]
    # Falling freely, all that is left is the centripetal part towards the centre of mass.
    assert accel == pytest.approx([-0.1 * 64.0, 0.0, 0.0], abs=0.6)
