from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.sim.config import SensorConfig, SimConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.sensors import Probe, Sensors
from bluefoot_mpc.sim.switches import FootSwitches
from bluefoot_mpc.types import JointCommand

RATE, FORCE, FIELD = [0.1, -0.2, 0.3], [1.0, 2.0, 9.8], [0.4, 0.0, -0.9]


class Rig:
    """Sensors on memory of their own: a steady motion, 0.25 duty, no contacts."""

    def __init__(self, config, seed=0, rows=4):
        self.rows, self.step = rows, 0
        self.probe = Probe(
            means=np.tile([*RATE, *FORCE], (rows, 1)),
            samples=np.tile([*FIELD, *np.zeros(16)], (rows, 1)),
            position=np.full(16, 0.3),
            duty=np.full(16, 0.25),
            temperature=np.full(16, 25.4),
            physics_period=0.001,
            frame_steps=5 * rows,
            window_steps=5,
        )
        self.sensors = Sensors(config, load_parameters().servo, self.probe, seed)

    def frame(self, count=None):
        count = self.rows if count is None else count
        self.step += 5 * count
        return self.sensors.measure(self.step, self.step - 5 * (count - 1), count, 12.0)


def imu_run(rig, frames):
    batches = [rig.frame().imu for _ in range(frames)]
    return tuple(np.vstack([getattr(b, name) for b in batches]) for name in ("gyro", "accel", "magnetometer"))


def test_imu_noise_has_the_stated_sizes():
    config = SensorConfig(gyro_bias=0.0, accel_bias=0.0, magnetometer_bias=0.0, gyro_drift=0.0)
    gyro, accel, field = imu_run(Rig(config), 2500)
    assert (gyro - RATE).std(axis=0) == pytest.approx(np.full(3, 0.01), rel=0.04)
    assert (accel - FORCE).std(axis=0) == pytest.approx(np.full(3, 0.1), rel=0.04)
    assert (gyro - RATE).mean(axis=0) == pytest.approx(np.zeros(3), abs=4e-4)
    seen = field[~np.isnan(field[:, 0])]
    assert len(seen) == 2500
    assert (seen - FIELD).std(axis=0) == pytest.approx(np.full(3, 0.01), rel=0.06)


def test_imu_biases_fill_their_range_over_seeds():
    rig, biases = Rig(SensorConfig()), []
    for seed in range(200):
        sensors = Sensors(SensorConfig(), load_parameters().servo, rig.probe, seed)
        biases.append(sensors.bias)
    biases = np.array(biases)
    for columns, size in ((biases[:, 0:3], 0.02), (biases[:, 3:6], 0.03), (biases[:, 6:9], 0.03)):
        assert 0.9 * size < np.abs(columns).max() <= size
        assert columns.std() == pytest.approx(size / np.sqrt(3), rel=0.1)


def test_gyro_bias_walks_by_its_drift_in_a_minute():
    # A second in a frame: what counts is the time, not the number of frames.
    rig, biases = Rig(SensorConfig(magnetometer_divider=10_000), rows=200), []
    for _ in range(80):
        biases.append(rig.sensors.bias[:3].copy())
        for _ in range(60):
            rig.frame()
    assert np.std(np.diff(biases, axis=0)) == pytest.approx(0.001, rel=0.15)
    few = rig.sensors.bias[:3].copy()
    for _ in range(200):
        rig.frame(count=0)
    assert np.array_equal(few, rig.sensors.bias[:3])


def test_another_sensor_noise_leaves_the_rest_alone():
    loud = imu_run(Rig(SensorConfig(gyro_noise=0.5, gyro_bias=0.0), 3), 5)
    quiet = imu_run(Rig(SensorConfig(), 3), 5)
    assert not np.array_equal(loud[0], quiet[0])
    assert np.array_equal(loud[1], quiet[1])
    assert np.array_equal(loud[2], quiet[2], equal_nan=True)


def test_magnetometer_comes_at_its_own_rate():
    _, _, field = imu_run(Rig(SensorConfig()), 3)
    assert (~np.isnan(field[:, 0])).nonzero()[0].tolist() == [0, 4, 8]
    _, _, uneven = imu_run(Rig(SensorConfig(magnetometer_divider=3)), 3)
    assert (~np.isnan(uneven[:, 0])).nonzero()[0].tolist() == [0, 3, 6, 9]


def test_frames_may_lack_samples():
    rig = Rig(SensorConfig(magnetometer_divider=3))
    counts = [4, 0, 1, 3, 2]
    frames = [rig.frame(count) for count in counts]
    assert [f.imu.gyro.shape for f in frames] == [(count, 3) for count in counts]
    times = np.concatenate([f.imu.time for f in frames])
    assert times == pytest.approx(0.005 * np.arange(1, 11), abs=1e-12)
    field = np.vstack([f.imu.magnetometer for f in frames])
    assert (~np.isnan(field[:, 0])).nonzero()[0].tolist() == [0, 3, 6, 9]
    assert np.abs(np.vstack([f.imu.accel for f in frames]) - FORCE).max() < 0.6


def switch_run(config, force_of_time, ticks, seed=0):
    """State of the first switch at 1 kHz, sampled at 200 Hz."""
    switches, states = FootSwitches(config, seed), []
    for tick in range(ticks):
        time = 0.005 * tick
        state, when = switches.measure([time], [float(force_of_time(time) > config.switch_threshold)], time)
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
        state, _ = switches.measure([time], [15.0 * (tick // 5 % 2 == 0)], time)
        changes += int((state != last).sum())
        last = state
    chatters = (changes / 4 - edges) / 2
    assert chatters / edges == pytest.approx(0.01, abs=0.003)


def test_servo_reports():
    servo, rig, speeds = load_parameters().servo, Rig(SensorConfig()), []
    for _ in range(400):
        rig.probe.position[:] += 0.02 * 0.5
        frame = rig.frame()
        assert np.abs(frame.joint_position - rig.probe.position).max() <= 0.5 * servo.step_angle + 1e-12
        speeds.append(frame.joint_speed)
    # The first speed has no position before.
    assert np.mean(speeds[1:]) == pytest.approx(0.5, abs=0.005)
    assert np.mean(speeds[0]) == pytest.approx(0.0, abs=0.1)
    assert np.std(speeds[1:]) == pytest.approx(0.1, rel=0.05)
    assert frame.joint_load == pytest.approx(np.full(16, 0.25), abs=0.1)
    assert frame.joint_temperature.tolist() == [25.0] * 16
    assert frame.joint_time.tolist() == [frame.time] * 16
    assert frame.time == pytest.approx(400 * 0.02)


@pytest.mark.parametrize(("force", "closed"), [([0.0, 0.0, 0.29], False), ([0.2, 0.2, 0.2], True)])
def test_each_switch_feels_its_own_foot(force, closed):
    for leg in range(4):
        rig = Rig(SensorConfig(switch_delay=0.0, switch_chatter=0.0))
        rig.probe.samples[:, 4 + 4 * leg : 7 + 4 * leg] = force
        frame = rig.frame()
        assert frame.contact.tolist() == [closed and other == leg for other in range(4)]
        assert frame.contact_time == pytest.approx(np.full(4, frame.time))


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
