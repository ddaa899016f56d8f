import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.io.safety import SafetyConfig, SafetyState
from bluefoot_mpc.io.safety.states import LIMP, OBEYING, Checks, Inputs, Machine, advance, overdue
from bluefoot_mpc.types import SafetyLevel

DT = 0.02
CONFIG = SafetyConfig()

inputs = st.builds(
    Inputs,
    emergency=st.booleans(), arm=st.booleans(), checks=st.sampled_from(Checks),
    level=st.sampled_from(SafetyLevel), limp=st.booleans(), rests=st.booleans(),
)  # fmt: skip
calm = inputs.map(
    lambda given: Inputs(level=given.level, limp=given.limp, rests=given.rests, checks=given.checks)
)
machines = st.builds(
    Machine,
    state=st.sampled_from(SafetyState), torque=st.floats(0.0, 1.0),
    elapsed=st.floats(0.0, 100.0), limp=st.floats(0.0, 100.0),
)  # fmt: skip


def run(machine, *steps, dt=DT):
    for step in steps:
        machine = advance(machine, step, dt, CONFIG)
    return machine


@given(machines, st.lists(calm, max_size=30))
def test_after_an_emergency_nothing_but_arming_brings_torque_back(machine, later):
    machine = run(machine, Inputs(emergency=True, arm=True, checks=Checks.PASSED))
    for step in later:
        assert (machine.state, machine.torque) == (SafetyState.EMERGENCY, 0.0)
        machine = run(machine, step)


@given(machines, st.lists(inputs, max_size=30))
def test_limp_states_have_no_torque_and_no_state_has_more_than_all(machine, steps):
    for step in steps:
        machine = run(machine, step)
        assert 0.0 <= machine.torque <= 1.0
        assert (machine.torque == 0.0) == (machine.state in LIMP)


@given(machines, inputs)
def test_torque_comes_from_limp_only_through_checks_that_passed(machine, step):
    after = run(machine, step)
    if machine.state in LIMP and after.state not in LIMP:
        assert (machine.state, after.state) == (SafetyState.CHECKING, SafetyState.ARMING)
        assert step.checks is Checks.PASSED
        assert after.torque == CONFIG.arming_torque


@given(machines, inputs)
def test_the_controller_is_obeyed_only_after_the_whole_ramp(machine, step):
    after = run(machine, step)
    if after.state in OBEYING and machine.state not in OBEYING:
        assert machine.state is SafetyState.ARMING
        assert machine.torque >= 1.0


@given(machines, inputs)
def test_a_controlled_stop_is_never_called_off(machine, step):
    after = run(machine, step)
    if machine.state is SafetyState.STOPPING:
        assert after.state in (SafetyState.STOPPING, SafetyState.STOPPED, SafetyState.EMERGENCY)


@given(st.lists(inputs, max_size=40))
def test_torque_rises_no_faster_than_the_ramp(steps):
    machine = run(Machine(), Inputs(arm=True), Inputs(checks=Checks.PASSED))
    for step in steps:
        before, machine = machine, run(machine, step)
        if before.state is SafetyState.ARMING and machine.state is SafetyState.ARMING:
            assert machine.torque - before.torque <= 0.7 * DT / CONFIG.arming_time + 1e-12


def test_arming_takes_its_time():
    machine = run(Machine(), Inputs(arm=True))
    assert machine.state is SafetyState.CHECKING
    machine = run(machine, Inputs(), Inputs(checks=Checks.PASSED))
    ticks = 0
    while machine.state is SafetyState.ARMING:
        machine, ticks = run(machine, Inputs()), ticks + 1
    assert machine.state is SafetyState.ACTIVE
    assert ticks * DT == pytest.approx(CONFIG.arming_time, abs=2.5 * DT)


@pytest.mark.parametrize("state", [SafetyState.DISARMED, SafetyState.STOPPED, SafetyState.EMERGENCY])
def test_only_an_explicit_wish_leaves_a_limp_state(state):
    machine = Machine(state=state)
    for level in SafetyLevel:
        for checks in Checks:
            assert run(machine, Inputs(level=level, checks=checks, limp=True, rests=True)).state is state
    assert run(machine, Inputs(arm=True)).state is SafetyState.CHECKING


@pytest.mark.parametrize("state", [SafetyState.CHECKING, SafetyState.ARMING])
def test_a_refusal_disarms(state):
    assert run(Machine(state=state, torque=0.5), Inputs(checks=Checks.REFUSED)).state is SafetyState.DISARMED


@pytest.mark.parametrize(
    ("level", "state"),
    [(SafetyLevel.NONE, "arming"), (SafetyLevel.HOLD, "arming"), (SafetyLevel.SIT, "disarmed"),
     (SafetyLevel.STOP, "disarmed")],
)  # fmt: skip
def test_a_fault_while_arming_disarms(level, state):
    machine = Machine(state=SafetyState.ARMING, torque=0.5)
    assert run(machine, Inputs(level=level, checks=Checks.PASSED)).state == state


@pytest.mark.parametrize("start", sorted(OBEYING))
@pytest.mark.parametrize(
    ("level", "state"),
    [(SafetyLevel.NONE, "active"), (SafetyLevel.HOLD, "hold"), (SafetyLevel.SIT, "sitting"),
     (SafetyLevel.STOP, "stopping")],
)  # fmt: skip
def test_faults_lead_to_their_states_and_back(start, level, state):
    assert run(Machine(state=start, torque=1.0), Inputs(level=level)).state == state


def test_a_robot_that_asks_for_no_torque_has_stopped_where_it_must_be_armed():
    machine, limp = Machine(state=SafetyState.ACTIVE, torque=1.0), Inputs(limp=True, rests=True)
    machine = run(machine, limp)
    assert machine.state is SafetyState.ACTIVE  # one tick is no end
    assert run(machine, *[limp] * 5).state is SafetyState.STOPPED
    assert run(machine, *[Inputs(limp=True)] * 50).state is SafetyState.ACTIVE


def test_a_stop_ends_when_no_torque_is_asked_for_and_is_overdue_else():
    stopping = run(Machine(state=SafetyState.ACTIVE, torque=1.0), Inputs(level=SafetyLevel.STOP))
    assert run(stopping, *[Inputs(limp=True)] * 6).state is SafetyState.STOPPED
    on = run(stopping, *[Inputs()] * round(CONFIG.stop_timeout / DT - 1))
    assert not overdue(on, CONFIG)
    assert overdue(run(on, Inputs(), Inputs(), Inputs()), CONFIG)
