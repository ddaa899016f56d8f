import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.wheels.balance import BalancingDrive, make_drive
from bluefoot_mpc.wheels.balance_config import BalanceConfig, BalanceSensors
from bluefoot_mpc.wheels.balance_sensing import filter_model
from bluefoot_mpc.wheels.constraints import rolling_matrix, sliding_matrix
from bluefoot_mpc.wheels.drive import WheelDrive
from bluefoot_mpc.wheels.frames import moved
from bluefoot_mpc.wheels.pendulum import WheeledPendulum
from bluefoot_mpc.wheels.ready import READY, balancing, differential

DT = 0.02


def run(drive, wanted, seconds, dt=DT):
    return [drive.step(np.array(wanted, dtype=float), dt) for _ in range(round(seconds / dt))]


@pytest.mark.parametrize("seed", range(3))
def test_it_stays_up_and_follows_a_twist(seed):
    drive = BalancingDrive(seed=seed)
    states = run(drive, [0.12, 0.0, 0.0], 4.0) + run(drive, [0.12, 0.0, 0.6], 4.0)
    assert not any(state.fallen for state in states)
    assert max(abs(state.tilt) for state in states) < math.radians(6.0)
    mean = np.mean([state.twist for state in states[-150:]], axis=0)
    np.testing.assert_allclose(mean, [0.12, 0.0, 0.6], atol=0.01)
    states = run(drive, [0.0, 0.0, 0.0], 4.0)
    np.testing.assert_allclose(np.mean([s.twist for s in states[-100:]], axis=0), 0.0, atol=0.005)
    assert np.std([s.tilt for s in states[-100:]]) < math.radians(0.5)


def test_its_wheels_neither_slip_nor_slide():
    drive = BalancingDrive(seed=1)
    for state in run(drive, [0.1, 0.0, 0.5], 2.0):
        rolled = rolling_matrix(drive.robot) @ state.twist
        np.testing.assert_allclose(rolled, drive.config.body.wheel_radius * state.wheel_speed, atol=1e-12)
        np.testing.assert_allclose(sliding_matrix(drive.robot) @ state.twist, 0.0, atol=1e-12)
    turned = state.wheel_angle
    ahead = drive.config.body.wheel_radius * turned.mean()
    assert ahead == pytest.approx(drive.body_state[0], abs=1e-12)


def test_it_drives_a_figure_of_eight():
    drive, pose = BalancingDrive(seed=2), np.zeros(3)
    run(drive, [0.1, 0.0, 0.5], 2.0)
    for rate in (0.5, -0.5):
        for state in run(drive, [0.1, 0.0, rate], 2 * math.pi / 0.5):
            pose = moved(pose, state.twist, DT)
            assert not state.fallen
    assert np.hypot(*pose[:2]) < 0.1


def test_the_filter_sees_more_than_the_sensors_tell():
    drive = BalancingDrive(seed=3)
    error = []
    for _ in range(1500):
        drive.step(np.array([0.1, 0.0, 0.0]), 0.005)
        error.append(drive.estimate - drive.body_state)
    rms = np.sqrt(np.mean(np.square(error[400:]), axis=0))
    assert rms[2] < 0.005  # tilt rad: the accelerometer alone would give 0.01 when at rest
    assert rms[3] < 0.03
    assert rms[1] < 0.01


def test_without_the_regulator_it_falls_and_then_stays_where_it_lies():
    drive = BalancingDrive(config=BalanceConfig(torque_limit=1e-6), seed=0)
    states = run(drive, [0.1, 0.0, 0.0], 5.0)
    assert states[-1].fallen
    np.testing.assert_array_equal(states[-1].twist, 0.0)
    np.testing.assert_array_equal(states[-1].wheel_angle, states[-2].wheel_angle)
    assert abs(states[-1].tilt) >= drive.config.fall_angle


@pytest.mark.parametrize("impulse", [0.1, -0.1, 0.4])
def test_it_catches_a_push(impulse):
    drive = BalancingDrive(seed=4)
    run(drive, [0.0, 0.0, 0.0], 1.0)
    before = drive.body_state
    drive.push(impulse)
    assert (drive.body_state - before)[1] * impulse > 0.0
    states = run(drive, [0.0, 0.0, 0.0], 4.0)
    assert not states[-1].fallen
    assert max(abs(s.tilt) for s in states) > math.radians(2.0)
    assert abs(states[-1].tilt) < math.radians(1.0)


def test_a_push_adds_its_impulse():
    drive = BalancingDrive()
    drive.body_state = np.array([0.0, 0.0, 0.3, 0.0])
    drive.push(0.2)
    body = drive.config.body
    speed, rate = drive.body_state[[1, 3]]
    coupling = body.body_mass * body.body_height * math.cos(0.3)
    assert body.rolling_mass * speed + coupling * rate == pytest.approx(0.2)


@pytest.mark.parametrize("dt", [0.001, 0.005, 0.013, 0.1])
def test_any_step_will_do(dt):
    states = run(BalancingDrive(seed=5), [0.1, 0.0, 0.3], 5.0, dt)
    assert not states[-1].fallen
    np.testing.assert_allclose(states[-1].twist, [0.1, 0.0, 0.3], atol=0.03)


def test_seed_and_reset_decide_everything():
    first, other = BalancingDrive(seed=6), BalancingDrive(seed=7)
    a = run(first, [0.1, 0.0, 0.3], 1.0)[-1]
    first.reset()
    b, c = run(first, [0.1, 0.0, 0.3], 1.0)[-1], run(other, [0.1, 0.0, 0.3], 1.0)[-1]
    np.testing.assert_array_equal(a.twist, b.twist)
    np.testing.assert_array_equal(a.wheel_angle, b.wheel_angle)
    assert not np.array_equal(a.twist, c.twist)


def test_filter_model_has_the_right_signs():
    model = filter_model(BalanceConfig())
    still_but_tilted = np.array([0.0, 0.0, 0.1, 0.0, 0.0])
    encoder, gyro, accelerometer = model.measurement @ still_but_tilted
    assert encoder == pytest.approx(-0.1)
    assert gyro == 0.0
    assert accelerometer < -0.9  # held: -0.981; let go, the axle runs back besides


def test_friction_does_not_hold_it_back():
    """Torque against friction is known beforehand: path and heading do not lag for want of it."""
    config = BalanceConfig(body=WheeledPendulum(friction=0.02))
    drive = BalancingDrive(config=config, seed=9)
    left, right = run(drive, [0.12, 0.0, 0.6], 5.0)[-1].wheel_angle * config.body.wheel_radius
    ahead = 0.12 * (5.0 - 0.5 * 0.12 / config.max_acceleration)
    turned = 0.6 * (5.0 - 0.5 * 0.6 / config.max_yaw_acceleration)
    assert 0.5 * (left + right) == pytest.approx(ahead, abs=0.01)
    assert (right - left) / (2 * drive.robot.wheels[0].length) == pytest.approx(turned, abs=0.02)


def test_motors_never_give_more_than_they_can_and_staying_up_comes_first():
    drive, highest = BalancingDrive(config=BalanceConfig(torque_limit=0.1), seed=10), 0.0
    for tick in range(400):
        if tick % 100 == 50:
            drive.push(0.25)
        state = drive.step(np.array([0.0, 0.0, 2.0 if tick % 20 < 10 else -2.0]), 0.005)
        highest = max(highest, float(np.abs(drive.motor_torque).max()))
    assert not state.fallen
    assert highest == pytest.approx(0.1)


def test_worse_sensors_make_it_sway_more():
    noisy = BalanceConfig(sensors=BalanceSensors(gyro_noise=0.2, accelerometer_noise=2.0, encoder_steps=100))
    sway = [
        np.std([s.tilt for s in run(BalancingDrive(config=config, seed=8), [0, 0, 0], 4.0)])
        for config in (BalanceConfig(), noisy)
    ]
    assert sway[1] > 2.0 * sway[0]


def test_bad_input_is_refused():
    drive = BalancingDrive()
    for wanted, dt in ((np.array([np.nan, 0, 0]), DT), (np.zeros(2), DT), (np.zeros(3), 0.0)):
        with pytest.raises(ConfigurationError):
            drive.step(wanted, dt)
    with pytest.raises(ConfigurationError, match="cannot balance"):
        BalancingDrive(READY["omni"]())
    with pytest.raises(ConfigurationError, match="wheel radius"):
        BalancingDrive(differential(0.08, 0.035))
    with pytest.raises(ConfigurationError, match="fall_angle"):
        BalanceConfig(fall_angle=2.0)
    with pytest.raises(ConfigurationError, match="encoder_steps"):
        BalanceSensors(encoder_steps=0)
    assert BalancingDrive(balancing()).robot.wheels == balancing().wheels


def test_drives_by_name():
    for name in READY:
        drive = make_drive(name)
        assert isinstance(drive, BalancingDrive if name == "balancing" else WheelDrive)
        assert drive.step(np.array([0.1, 0.0, 0.0]), DT).wheel_speed.shape == (len(drive.robot.wheels),)
    with pytest.raises(UnknownNameError, match="Did you mean 'mecanum'"):
        make_drive("mekanum")
