import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.estimation import Estimator, EstimatorConfig, LevelConfig
from bluefoot_mpc.estimation.corrections import Settler
from bluefoot_mpc.estimation.filter import FilterState, initial_state
from bluefoot_mpc.estimation.ground import GroundEstimate
from bluefoot_mpc.estimation.level import LevelFloor, LevelState, forget_bias, height_row
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.parameters import GRAVITY

from .synthetic_motion import Motion, Sensors, geometry, make_run

CONFIG = LevelConfig()
BIAS = EstimatorConfig().imu.accel_bias
ALL = (0, 1, 2, 3)
FEET = np.array([[0.17, 0.16, -0.14], [0.15, -0.16, -0.14], [-0.16, 0.17, -0.14], [-0.17, -0.15, -0.14]])
LEVEL = GroundEstimate(np.array([0.002, -0.002]), known=True)
DT = 0.02


def state_with(feet, tilt=BIAS / GRAVITY) -> FilterState:
    """A settled filter over given feet (4, 3), m relative to the IMU, world axes; `tilt` rad of doubt."""
    state = initial_state((0.0, 0.0, 0.0, 1.0), tilt, EstimatorConfig())
    estimate, covariance = state.estimate.copy(), state.covariance.copy()
    estimate[7:19] = np.ravel(feet)
    covariance[6:18, 6:18] = 0.0002**2 * np.eye(12)
    # At rest the accelerometer ties the tilt to its bias: dv = g x tilt - bias.
    for angle, axis, sign in ((0, 22, 1.0), (1, 21, -1.0)):
        covariance[angle, axis] = covariance[axis, angle] = 0.99 * sign * tilt * BIAS
    return FilterState(estimate, covariance)


def tilted(feet, roll, pitch):
    """(4, 3) feet on a level floor as a wrong attitude shows them."""
    return np.asarray(feet) @ rotation_from_rpy(np.array([roll, pitch, 0.0])).T


def floor(config: LevelConfig = CONFIG) -> LevelFloor:
    return LevelFloor(config, BIAS, Settler())


@pytest.mark.parametrize("component", range(12))
def test_row_is_the_slope_of_the_height(component):
    """Finite differences of the true height by the error: estimates are E times the truth."""
    truth, size = tilted(FEET, 0.0, 0.0), 1e-6
    error = np.zeros(18)
    error[(0, 1, 2, *range(6, 15))[component]] = size
    seen = truth @ rotation_from_rpy(error[:3]).T + error[6:18].reshape(4, 3)
    for one, other in ((0, 3), (1, 2), (2, 1)):
        row, height = height_row(state_with(seen), one, other)
        before = height_row(state_with(truth), one, other)[1]
        assert row[:18] @ error / size == pytest.approx((height - before) / size, abs=1e-4)
        assert not row[18:].any()


def test_level_feet_remove_a_tilt_and_find_the_bias():
    roll, pitch = 0.0017, -0.0012
    law, state, memory = floor(), state_with(tilted(FEET, roll, pitch)), LevelState(level=True)
    for _ in range(500):
        state, memory = law.advance(state, memory, ALL, LEVEL, DT)
    assert memory.level
    assert 2.0 * state.estimate[0:2] == pytest.approx([-roll, -pitch], rel=0.15)
    assert state.accel_bias[0] == pytest.approx(GRAVITY * pitch, rel=0.2)
    assert state.accel_bias[1] == pytest.approx(-GRAVITY * roll, rel=0.2)


def test_the_plane_must_look_level_for_a_while():
    law, state, memory = floor(), state_with(FEET), LevelState()
    for _ in range(round(CONFIG.trust / DT) - 1):
        state, memory = law.advance(state, memory, ALL, LEVEL, DT)
        assert not memory.level
    again = law.advance(state, memory, ALL, GroundEstimate(np.array([0.0, 0.01]), known=True), DT)[1]
    assert again == LevelState()
    assert law.advance(state, memory, ALL, LEVEL._replace(known=False), DT)[1] == LevelState()
    for _ in range(3):
        same, memory = law.advance(state, memory, ALL, LEVEL, DT)
    assert memory.level
    assert same is state


def test_feet_at_other_heights_are_not_used_and_end_the_belief():
    law, memory = floor(), LevelState(level=True)
    feet = FEET.copy()
    feet[0, 2] += 0.010
    before = state = state_with(feet)
    # Only the diagonal that fits may be used meanwhile.
    state, memory = law.advance(state, memory, (0, 3), LEVEL, DT)
    assert state is before
    assert memory == LevelState(level=True, time=CONFIG.interval, wait=CONFIG.interval)
    steps = 0
    while memory.level:
        state, memory = law.advance(state, memory, (0, 3), LEVEL, CONFIG.interval)
        steps += 1
    assert memory == LevelState(time=-CONFIG.distrust)
    # Its attitude was drawn to the feet's plane, so this looks level for a while.
    assert not law.advance(state, memory, (0, 3), LEVEL, CONFIG.distrust)[1].level
    assert steps * CONFIG.interval == pytest.approx(CONFIG.doubt, abs=1.01 * CONFIG.interval)
    assert state.accel_bias == (0.0, 0.0, 0.0)


def test_more_bias_than_the_sensor_has_ends_the_belief():
    law, state = floor(), state_with(FEET)
    for size, level in ((2.5, True), (3.5, False)):
        state.estimate[22:24] = (0.0, size * BIAS)
        after, memory = law.advance(state, LevelState(level=True), ALL, LEVEL, DT)
        assert memory.level is level
        assert (after.accel_bias[1] == 0.0) is not level


def test_single_feet_and_short_intervals_cost_nothing():
    law, state = floor(), state_with(tilted(FEET, 0.001, 0.0))
    for used in ((), (0,), (0, 1), (2, 3)):
        assert law.advance(state, LevelState(level=True), used, LEVEL, DT)[0] is state
    waiting = LevelState(level=True, wait=0.1)
    after, memory = law.advance(state, waiting, ALL, LEVEL, DT)
    assert after is state
    assert memory.wait == pytest.approx(0.08)


def test_bumps_weaken_the_floors_say():
    rng, tilt = np.random.default_rng(0), []
    for bump in (0.0, 0.004):
        law, memory, state = (
            floor(replace(CONFIG, gate=1e6, max_bias=1e6)),
            LevelState(level=True),
            state_with(FEET),
        )
        for _ in range(30):
            feet = FEET.copy()
            feet[:, 2] += bump * rng.standard_normal(4)
            state.estimate[7:19] = feet.ravel()
            memory = law.advance(state, memory, ALL, LEVEL, CONFIG.interval)[1]
        after = law.advance(state_with(tilted(FEET, 0.0017, 0.0)), memory, ALL, LEVEL, CONFIG.interval)[0]
        tilt.append(abs(after.estimate[0]))
    assert 0.0 < tilt[1] < 0.2 * tilt[0]


def test_forgetting_the_bias_leaves_as_much_doubt_of_the_tilt():
    state = state_with(FEET, 0.0001)
    state.estimate[22:25] = 0.05
    after = forget_bias(state, BIAS)
    assert after.accel_bias == (0.0, 0.0, 0.0)
    np.testing.assert_allclose(np.diag(after.covariance)[21:24], BIAS**2)
    np.testing.assert_allclose(np.sqrt(np.diag(after.covariance)[:2]), math.hypot(0.0001, BIAS / GRAVITY))
    assert np.linalg.eigvalsh(after.covariance).min() > -1e-12
    assert state.accel_bias == (0.05, 0.05, 0.05)


def tilt_mean(run, config):
    """(2,) degrees, mean error of roll and pitch in the last ten seconds."""
    estimator = Estimator(geometry(), config)
    rpy = np.array([estimator.step(frame).rpy for frame in run.frames])
    return np.degrees((rpy - run.rpy)[run.time > run.time[-1] - 10.0, :2].mean(axis=0))


@pytest.mark.parametrize("seed", range(3))
def test_a_level_floor_shows_the_bias_while_walking_straight(seed):
    run = make_run(Motion(duration=15.0, yaw_rate=0.0), Sensors(), seed)
    config = EstimatorConfig()
    without = tilt_mean(run, replace(config, level=LevelConfig(enabled=False)))
    aided = tilt_mean(run, config)
    assert np.abs(without).max() > 0.07
    assert np.abs(aided).max() < 0.03


def test_a_ramp_is_not_taken_for_a_level_floor():
    """Gravity that leans forward by 1.2° in the robot's frame is a ramp: feet and trunk stand across it."""
    run = make_run(Motion(duration=15.0, yaw_rate=0.0), Sensors(accel_bias=0.0), 0)
    lean = np.array([math.radians(1.2) * GRAVITY, 0.0, 0.0])
    frames = [replace(f, imu=replace(f.imu, accel=f.imu.accel + lean)) for f in run.frames]
    error = tilt_mean(replace(run, frames=frames), EstimatorConfig())
    assert error[1] == pytest.approx(-1.2, abs=0.05)


def test_bad_settings_are_refused():
    for name in ("slope", "noise", "interval", "memory", "gate", "max_bias"):
        with pytest.raises(ConfigurationError, match=name):
            LevelConfig(**{name: 0.0})
