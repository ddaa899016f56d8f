from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.safety import Guard, GuardConfig, GuardState
from tests.io.safety.scripted import PERIOD, SIT, goal


@pytest.fixture
def guard():
    made = Guard()
    made.watch_over(SIT)
    return made


def starve(guard, seconds, start=0.0, setpoint=None):
    """Cycles after the last set-point: a list of (age, action)."""
    ages = start + PERIOD * np.arange(round(seconds / PERIOD))
    return [(age, guard.step(100.0 + age, age, setpoint or goal(0.3))) for age in ages]


def test_new_set_points_go_through_as_they_are(guard):
    for k in range(20):
        command = goal(0.01 * k)
        action = guard.step(k * PERIOD, 0.0, command)
        assert action.state is GuardState.SEND
        assert action.command is command
        assert action.reason == ""


def test_the_stages_in_their_order(guard):
    actions = starve(guard, 6.0)
    states = [action.state for _, action in actions]
    assert states == sorted(states, key=list(GuardState).index)
    begin = {state: actions[states.index(state)][0] for state in GuardState}
    assert begin[GuardState.HOLD] == pytest.approx(0.1, abs=1.5 * PERIOD)
    assert begin[GuardState.SINK] == pytest.approx(0.5, abs=1.5 * PERIOD)
    # 0.7 rad at 0.8 rad/s, then half a second for the torque.
    assert begin[GuardState.OFF] == pytest.approx(0.5 + 0.7 / 0.8 + 0.5, abs=4 * PERIOD)
    assert actions[-1][1].command is None
    assert "no set-point for 0.5 s" in actions[-1][1].reason


def test_it_holds_the_last_goals_then_lowers_them_slowly(guard):
    actions = [action for _, action in starve(guard, 6.0)]
    held = [action.command for action in actions if action.state is GuardState.HOLD]
    assert all(command is held[0] for command in held)
    sunk = np.array([action.command.position for action in actions if action.state is GuardState.SINK])
    assert np.abs(np.diff(np.vstack([held[0].position, sunk]), axis=0)).max() <= 0.8 * PERIOD + 1e-9
    np.testing.assert_allclose(sunk[-1], SIT)
    torque = np.array([a.command.torque_limit.max() for a in actions if a.state is GuardState.SINK])
    assert np.all(np.diff(torque) <= 0.0)
    assert torque[-1] < 0.1


def test_a_set_point_in_time_ends_the_hold(guard):
    starve(guard, 0.4)
    assert guard.state is GuardState.HOLD
    assert guard.step(100.4, 0.0, goal(0.4)).state is GuardState.SEND


def test_a_set_point_too_late_changes_nothing(guard):
    starve(guard, 0.8)
    assert guard.state is GuardState.SINK
    for k in range(300):
        action = guard.step(100.8 + k * PERIOD, 0.0, goal(0.9))
        assert action.state in (GuardState.SINK, GuardState.OFF)
    assert guard.state is GuardState.OFF


def test_a_stalled_adapter_does_not_make_goals_jump(guard):
    starve(guard, 0.6)
    before = guard.memory.sent.position
    after = guard.step(guard.memory.now + 0.4, 1.0, goal(0.3)).command.position
    assert np.abs(after - before).max() <= 0.8 * GuardConfig().longest_step + 1e-9


@pytest.mark.parametrize("before", [0.0, 0.3, 0.8])
def test_a_guard_that_was_away_itself_does_not_switch_limp_servos_on(guard, before):
    starve(guard, before + PERIOD)
    action = guard.step(guard.memory.now + 0.6, 0.0, goal(0.3))
    assert (action.state, action.command) == (GuardState.OFF, None)
    assert "was away for 0.6 s" in action.reason


@pytest.mark.parametrize("now", [50.0, float("nan")])
def test_time_that_goes_wrong_does_not_stop_the_guard(guard, now):
    starve(guard, 0.6)
    assert guard.step(now, 1.0, goal(0.3)).state is GuardState.SINK
    later = [action for _, action in starve(guard, 5.0, start=1.0)]
    assert later[-1].state is GuardState.OFF


@pytest.mark.parametrize("age", [float("nan"), float("inf"), 0.6])
def test_an_age_that_is_too_old_or_unknown_is_no_new_set_point(guard, age):
    guard.step(0.0, 0.0, goal(0.3))
    assert guard.step(PERIOD, age, goal(0.9)).state is GuardState.SINK
    assert np.abs(guard.memory.sent.position - 0.3).max() < 0.02


def test_before_the_first_set_point_it_holds_what_arming_wrote(guard):
    guard.reset(goal(0.3, torque=0.3))
    action = guard.step(0.0, 0.05, None)
    assert action.state is GuardState.HOLD
    np.testing.assert_array_equal(action.command.position, 0.3)
    np.testing.assert_array_equal(action.command.torque_limit, 0.3)
    assert [action.state for _, action in starve_without(guard)][-1] is GuardState.OFF


def starve_without(guard):
    return [(k, guard.step(k * PERIOD, k * PERIOD, None)) for k in range(300)]


def test_with_nothing_to_hold_it_writes_nothing_and_switches_off(guard):
    assert guard.step(0.0, 0.05, None).command is None
    assert guard.step(0.1, 0.2, None).state is GuardState.HOLD
    assert guard.step(0.6, 0.6, None).state is GuardState.OFF


def test_without_a_sitting_posture_torque_fades_where_it_stands():
    actions = [action for _, action in starve(Guard(), 3.0)]
    sunk = [action.command for action in actions if action.state is GuardState.SINK]
    assert all((command.position == 0.3).all() for command in sunk)
    assert len(sunk) * PERIOD == pytest.approx(1.0, abs=0.05)
    assert actions[-1].state is GuardState.OFF


@pytest.mark.parametrize("before", [0.0, 0.05, 0.3, 0.8, 5.0])
def test_an_emergency_overrides_every_stage_until_reset(guard, before):
    starve(guard, before)
    guard.emergency("red button")
    guard.emergency("again")
    for k in range(5):
        action = guard.step(110.0 + k * PERIOD, 0.0, goal(0.3))
        assert (action.state, action.command) == (GuardState.OFF, None)
    assert before > 4.0 or action.reason == "red button"
    guard.reset()
    assert guard.step(120.0, 0.0, goal(0.3)).state is GuardState.SEND


def test_an_emergency_needs_no_reason(guard):
    guard.emergency("")
    action = guard.step(0.0, 0.0, goal(0.3))
    assert (action.state, action.reason) == (GuardState.OFF, "emergency stop")


cycles = st.lists(
    st.tuples(
        st.floats(allow_nan=True, allow_infinity=True), st.floats(allow_nan=True, allow_infinity=True),
        st.sampled_from([None, goal(0.3), goal(-0.2, torque=0.5)]), st.booleans(),
    ),
    max_size=30,
)  # fmt: skip


@given(cycles)
def test_whatever_comes_after_off_there_is_no_torque_and_goals_stay_finite(given_cycles):
    guard, off = Guard(), False
    guard.watch_over(SIT)
    for now, age, setpoint, press in given_cycles:
        if press and age > 1.0:
            guard.emergency("red button")
            off = True
        action = guard.step(now, age, setpoint)
        off = off or action.state is GuardState.OFF
        assert not off or action.command is None
        if action.command is not None:
            assert np.isfinite(action.command.position).all()
            assert 0.0 <= action.command.torque_limit.min() <= action.command.torque_limit.max() <= 1.0


def test_stages_must_be_in_order():
    with pytest.raises(ConfigurationError, match="must be longer"):
        GuardConfig(sink_after=0.05)
    assert replace(GuardConfig(), hold_after=0.2).hold_after == 0.2
