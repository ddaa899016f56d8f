"""Emergency stops: in every state, twice, from other threads; nothing moves afterwards."""

import threading
import time
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.io.findings import NotArmedError
from bluefoot_mpc.io.safety import Health, SafetyState
from bluefoot_mpc.types import SafetyLevel
from tests.io.safety.scripted import FakePoweredRobot, FakeRobot, goal, make_imu, play, supervise

BOUND = 5  # steps in 100 ms


def in_state(state):
    """A powered robot and its supervisor, brought to a state."""
    fake = FakePoweredRobot()
    supervisor = supervise(fake)
    if state is SafetyState.DISARMED:
        return fake, supervisor
    supervisor.reset()
    if state is SafetyState.HOLD:
        fake.changes = {"imu": lambda now: make_imu(now, 0)}
        play(supervisor, 0.2)
    elif state is SafetyState.SITTING:
        fake.changes = {"joint_temperature": np.full(16, 66.0)}
        play(supervisor, 0.1)
    elif state is SafetyState.STOPPING:
        supervisor.step(goal(np.nan))
    elif state is SafetyState.STOPPED:
        play(supervisor, 0.5, goal(0.3, torque=0.0))
    elif state is SafetyState.EMERGENCY:
        supervisor.emergency("before")
    assert supervisor.state is state
    return fake, supervisor


STATES = [state for state in SafetyState if state not in (SafetyState.CHECKING, SafetyState.ARMING)]


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("times", [1, 2])
def test_an_emergency_stop_in_every_state(state, times):
    fake, supervisor = in_state(state)
    for _ in range(times):
        supervisor.emergency("red button")
        supervisor.step(goal(0.4))
    assert supervisor.state is SafetyState.EMERGENCY
    assert supervisor.stopped
    assert fake.latched
    moved, sent = len(fake.moved), len(fake.sent)
    for command in (goal(0.9), goal(np.nan), goal(-0.9), replace(goal(0.0), speed=np.ones(16))):
        play(supervisor, 0.5, command)
    assert len(fake.moved) == moved
    assert all(not command.torque_limit.any() for command in fake.sent[sent:])
    assert all(np.isfinite(command.position).all() for command in fake.sent)
    assert supervisor.request.level is SafetyLevel.STOP
    assert any("emergency stop" in reason for reason in supervisor.request.reasons)


def test_the_first_reason_stays():
    _, supervisor = in_state(SafetyState.ACTIVE)
    supervisor.emergency("red button")
    supervisor.emergency("again")
    supervisor.step(goal(0.3))
    assert supervisor.request.reasons == ("emergency stop: red button",)


def test_an_emergency_stop_needs_no_reason():
    fake, supervisor = in_state(SafetyState.ACTIVE)
    supervisor.emergency("")
    play(supervisor, 0.1)
    assert supervisor.state is SafetyState.EMERGENCY
    assert fake.latched


def test_torque_goes_before_the_call_returns_not_with_the_next_step():
    fake, supervisor = in_state(SafetyState.ACTIVE)
    supervisor.emergency("red button")
    assert fake.latched
    assert fake.log[-1] == "stop"


def test_an_emergency_stop_from_another_thread():
    fake, supervisor = in_state(SafetyState.ACTIVE)
    begun = threading.Event()

    def press():
        begun.wait()
        supervisor.emergency("red button")

    thread = threading.Thread(target=press, name="button")
    thread.start()
    after = 0
    for k in range(10_000):
        supervisor.step(goal(0.3 + 0.01 * (k % 2)))
        begun.set()
        after += fake.latched
        if after > BOUND:
            break
        time.sleep(1e-4)
    thread.join()
    assert supervisor.state is SafetyState.EMERGENCY
    assert all(not command.torque_limit.any() for command in fake.sent[-BOUND + 1 :])


def test_a_stop_while_a_command_is_on_its_way_meets_the_latch_below():
    fake, supervisor = in_state(SafetyState.ACTIVE)
    send = fake.step

    def step(command):
        supervisor.emergency("red button")  # checked already, not yet sent
        return send(command)

    fake.step = step
    moved = len(fake.moved)
    play(supervisor, 0.2)
    assert len(fake.moved) == moved


def test_an_emergency_stop_during_a_controlled_stop():
    fake, supervisor = in_state(SafetyState.ACTIVE)

    def press():
        if fake.sent[-1].torque_limit[0] < 0.5:
            supervisor.emergency("red button")

    fake.at_step = press
    supervisor.controlled_stop("enough")
    assert supervisor.state is SafetyState.EMERGENCY
    assert "disarm" not in fake.log


def test_a_simulated_robot_is_limp_after_an_emergency_stop():
    fake = FakeRobot()
    supervisor = supervise(fake)
    supervisor.reset()
    play(supervisor, 0.1)
    supervisor.emergency("red button")
    play(supervisor, 0.1)
    assert fake.stops == 1
    assert all(not command.torque_limit.any() for command in fake.sent[-BOUND:])
    supervisor.reset()
    assert supervisor.state is SafetyState.ACTIVE


EVENTS = ["step", "limp", "nan", "hot", "blind", "low", "account", "healthy", "stop", "arm", "emergency"]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.sampled_from(EVENTS), max_size=25), st.lists(st.sampled_from(EVENTS[:-3]), max_size=15))
def test_whatever_came_before_and_comes_after_an_emergency_leaves_no_torque(before, after):
    fake = FakePoweredRobot()
    supervisor = supervise(fake, arming_time=0.1)
    supervisor.reset()
    for event in before:
        happen(event, fake, supervisor)
        assert supervisor.stopped or not fake.latched
    supervisor.emergency("red button")
    moved, sent = len(fake.moved), len(fake.sent)
    for event in after:
        happen(event, fake, supervisor)
    assert fake.latched
    assert len(fake.moved) == moved
    assert all(not command.torque_limit.any() for command in fake.sent[sent:])


def happen(event, fake, supervisor):
    changes = {
        "hot": {"joint_temperature": np.full(16, 70.0)},
        "blind": {"imu": lambda now: make_imu(now, 0), "joint_valid": np.zeros(16, dtype=bool)},
        "low": {"voltage": 8.0},
        "healthy": {},
    }
    if event in changes:
        fake.changes = changes[event]
    fake.account = Health(power_on=event != "account")
    if event == "stop":
        supervisor.stop()
    elif event == "emergency":
        supervisor.emergency("random")
    elif event == "arm" and supervisor.stopped:
        try:
            supervisor.arm()
        except NotArmedError:
            assert supervisor.stopped
            assert fake.latched
    play(supervisor, 0.1, {"nan": goal(np.nan), "limp": goal(0.1, torque=0.0)}.get(event))
