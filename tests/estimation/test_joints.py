import math

import numpy as np
import pytest

from bluefoot_mpc.estimation.config import JointFilterConfig
from bluefoot_mpc.estimation.joints import (
    MAX_READ_DELAY,
    JointFilter,
    advance_joints,
    initial_joints,
    known_legs,
    speed_lag,
)
from bluefoot_mpc.exceptions import ConfigurationError

CONFIG = JointFilterConfig()
DT = 0.02
ALL = np.ones(16, dtype=bool)


def track(positions: np.ndarray) -> np.ndarray:
    state = initial_joints()
    speeds = []
    for k, value in enumerate(positions):
        state = advance_joints(state, np.full(16, value), ALL, DT if k else 0.0, CONFIG)
        speeds.append(state.velocity[0])
    return np.array(speeds)


def test_constant_speed_has_no_error():
    speeds = track(0.3 + 2.0 * DT * np.arange(60))
    np.testing.assert_allclose(speeds[30:], 2.0, atol=1e-9)


def test_lag_is_the_stated_one():
    # A constant acceleration leaves acceleration times lag.
    t = DT * np.arange(80)
    speeds = track(0.5 * 3.0 * t * t)
    assert (3.0 * t - speeds)[-1] / 3.0 == pytest.approx(speed_lag(CONFIG, DT), abs=1e-9)
    assert speed_lag(CONFIG, DT) < 0.5 * DT


def test_no_jump_at_the_first_reading_nor_after_a_loss():
    state = advance_joints(initial_joints(), np.full(16, 1.0), ALL, 0.0, CONFIG)
    assert not state.velocity.any()
    for _ in range(20):
        state = advance_joints(state, np.zeros(16), ~ALL, DT, CONFIG)
    state = advance_joints(state, np.full(16, -1.0), ALL, DT, CONFIG)
    np.testing.assert_allclose(state.position, -1.0)
    assert not state.velocity.any()


def test_a_silent_joint_goes_on_and_slows_down():
    state = initial_joints()
    for k in range(40):
        state = advance_joints(state, np.full(16, 0.02 * k), ALL, DT if k else 0.0, CONFIG)
    silent = ALL.copy()
    silent[5] = False
    before = state
    state = advance_joints(state, np.full(16, 0.8), silent, DT, CONFIG)
    assert state.position[5] == pytest.approx(before.position[5] + DT * before.velocity[5])
    assert 0.0 < state.velocity[5] < before.velocity[5]
    assert known_legs(state, CONFIG).all()
    for _ in range(10):
        state = advance_joints(state, np.full(16, 0.8), silent, DT, CONFIG)
    np.testing.assert_array_equal(known_legs(state, CONFIG), [True, False, True, True])


def test_angles_are_carried_over_a_short_delay_only():
    tracker, state = JointFilter(CONFIG), initial_joints()
    delay = np.zeros(16)
    delay[1:5] = 0.01, 2.0 * MAX_READ_DELAY, -0.01, -2.0 * MAX_READ_DELAY
    for k in range(40):
        state, known = tracker.advance(state, np.full(16, 0.02 * k), ALL, delay, DT if k else 0.0)
    speed = state.velocity[0]
    expected = np.full(16, 0.78)
    expected[1] += 0.01 * speed
    expected[3] -= 0.01 * speed
    np.testing.assert_allclose(state.newest, expected, atol=1e-15)
    assert known == known_legs(state, CONFIG).tolist()


def test_a_reading_that_is_no_number_is_none():
    first = advance_joints(initial_joints(), np.full(16, 0.5), ALL, 0.0, CONFIG)
    measured, valid = np.full(16, 0.6), ALL.copy()
    measured[3], measured[7], valid[[3, 7]] = math.nan, math.inf, False
    silent = advance_joints(first, np.full(16, 0.6), valid, DT, CONFIG)
    broken = advance_joints(first, measured, ALL, DT, CONFIG)
    np.testing.assert_array_equal(broken.values, silent.values)
    assert broken.newest[3] == broken.position[3]


def test_impossible_gains_are_refused():
    with pytest.raises(ConfigurationError, match="beta"):
        JointFilterConfig(beta=2.5)
