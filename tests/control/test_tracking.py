import numpy as np
import pytest

from bluefoot_mpc.control import tracking
from bluefoot_mpc.control.tracking import TrackingConfig, TrackingState, Twist

CONFIG = TrackingConfig()


def test_speed_error_is_integrated_away_within_its_bound():
    state, speed = TrackingState(), 0.0
    wanted = Twist(velocity=np.array([0.06, 0.0]), yaw_rate=0.0)
    for _ in range(2000):
        state, corrected = tracking.advance(state, wanted, np.array([speed, 0.0]), 0.0, 0.02, CONFIG)
        speed = 0.85 * corrected.velocity[0]
    assert speed == pytest.approx(0.06, rel=1e-3)
    for _ in range(5000):
        state, corrected = tracking.advance(state, wanted, np.zeros(2), 0.0, 0.02, CONFIG)
    assert corrected.velocity[0] == pytest.approx(0.06 + CONFIG.velocity_bound)


@pytest.mark.parametrize("start", [0.0, 3.1])
def test_heading_is_held_across_the_wrap(start):
    state, yaw = TrackingState(), start
    twist = Twist(velocity=np.zeros(2), yaw_rate=0.0)
    state, _ = tracking.advance(state, twist, np.zeros(2), yaw, 0.02, CONFIG)
    yaw += 0.2
    for _ in range(3000):
        state, corrected = tracking.advance(state, twist, np.zeros(2), yaw, 0.02, CONFIG)
        yaw += (corrected.yaw_rate + 0.01) * 0.02  # a constant disturbance
    assert yaw == pytest.approx(start, abs=1e-3)


def test_the_heading_reference_turns_with_the_command():
    state = TrackingState(heading=0.0)
    wanted = Twist(velocity=np.zeros(2), yaw_rate=0.5)
    for i in range(50):
        state, corrected = tracking.advance(state, wanted, np.zeros(2), 0.5 * 0.02 * (i + 1), 0.02, CONFIG)
    assert state.heading == pytest.approx(0.5)
    assert corrected.yaw_rate == pytest.approx(0.5, abs=1e-6)


def test_corrections_stay_bounded_when_the_estimate_is_wrong():
    state = TrackingState(heading=0.0)
    still = Twist(velocity=np.zeros(2), yaw_rate=0.0)
    for _ in range(5000):
        state, corrected = tracking.advance(state, still, np.zeros(2), 1.5, 0.02, CONFIG)
    assert abs(corrected.yaw_rate) <= CONFIG.heading_bound + 1e-12


def test_rest_forgets_the_heading_and_keeps_what_was_learnt():
    state = tracking.rest(TrackingState(velocity=np.array([0.01, -0.02]), heading=1.0, yaw_rate=0.03))
    assert np.isnan(state.heading)
    np.testing.assert_array_equal(state.velocity, [0.01, -0.02])
    assert state.yaw_rate == 0.03


def test_each_axis_corrects_its_own_error():
    wanted = Twist(velocity=np.array([0.05, -0.03]), yaw_rate=0.0)
    state, corrected = tracking.advance(TrackingState(), wanted, np.array([0.04, -0.05]), 0.0, 0.02, CONFIG)
    expected = CONFIG.velocity_gain * 0.02 * np.array([0.01, 0.02])
    np.testing.assert_allclose(state.velocity, expected, rtol=1e-12)
    np.testing.assert_allclose(corrected.velocity, wanted.velocity + expected, rtol=1e-12)


def test_a_gait_on_its_ramp_winds_nothing_up():
    waits = TrackingConfig(wait_for_ramp=True)
    wanted = Twist(velocity=np.array([0.4, 0.0]), yaw_rate=0.0)
    state, speed = TrackingState(), 0.0
    for _ in range(150):
        state, corrected = tracking.advance(state, wanted, np.array([speed, 0.0]), 0.0, 0.02, waits)
        speed = min(0.4, speed + 0.002)
        state = tracking.followed(state, corrected, np.array([speed, 0.0]))
    assert state.on_its_way
    # One tick passed before the ramp was known.
    assert state.velocity[0] <= waits.velocity_gain * 0.02 * 0.4 + 1e-12
    reached = tracking.followed(state, wanted, np.array([0.4, 0.0]))
    assert tracking.advance(reached, wanted, np.array([0.3, 0.0]), 0.0, 0.02, waits)[0].velocity[0] > 0.0
