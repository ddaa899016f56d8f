"""An emergency stop in every state, twice, and at any instant of arming, on the whole robot."""

import math

import numpy as np
import pytest

from bluefoot_mpc.io.safety.states import SafetyState
from bluefoot_mpc.types import JointCommand
from tests.faults.rig import Plan, Rig
from tests.faults.table import AT, OFF_TIME, board, fault, spoil_goals

pytestmark = pytest.mark.slow

STATES = {
    "active": (AT, {}),
    "hold": (AT + 0.3, {"actions": {AT: board(imu_silent=True)}}),
    "sitting": (AT + 0.8, {"faults": (fault("temperature", servo=7, start=3.0, value=66.0),)}),
    "stopping": (AT + 0.5, {"spoil": spoil_goals(lambda goals: goals * math.nan, AT, AT + 0.02)}),
}
"""By state: an instant (s) at which the robot is in it, and how it comes there."""
IN_ARMING = (
    0.0005, 0.1, 0.34, 0.355, 0.362, 0.3655, 0.37, 0.375, 0.38, 0.385, 0.3901, 0.395, 0.4, 0.405, 0.41, 0.43,
    1.0, 1.42,
)  # fmt: skip
"""s: connecting up to 0.34, checks to 0.36, registers of each servo to 0.39, then the ramp of the torque."""


def stop(rig: Rig) -> None:
    rig.supervisor.emergency("red button")


def go_on(rig: Rig) -> None:
    """A program that does not care: it commands on for half a second."""
    command = JointCommand(
        position=rig.pipeline.sitting_joints + 0.1, speed=np.zeros(16), torque_limit=np.ones(16)
    )
    for _ in range(25):
        rig.supervisor.step(command)


def again_and_on(rig: Rig) -> None:
    go_on(rig)
    rig.supervisor.emergency("once more")
    go_on(rig)


def check_off(rig: Rig, since: float) -> None:
    """No torque from 100 ms after `since` (s) on, and no write that could bring it."""
    assert rig.supervisor.state is SafetyState.EMERGENCY
    assert rig.shafts.limp_at() <= since + OFF_TIME
    assert not [time for time, _, on in rig.shafts.changes if on and time > since]
    assert not [time for time in (*rig.line.goals, *rig.line.enables) if time > since]
    seen = rig.parts.report()
    assert seen["torque_on"] == []
    assert not seen["power_on"]
    assert seen["eeprom_writes"] == 0


@pytest.mark.parametrize("name", STATES)
def test_in_every_state(name, tmp_path):
    when, how = STATES[name]
    before = []
    plan = Plan(
        cuts_in={when: lambda rig: (before.append(rig.supervisor.state), stop(rig))},
        after=again_and_on, end=when + 1.0, rests=True, **how,
    )  # fmt: skip
    rig = Rig(plan, tmp_path).run()
    assert before == [name]
    check_off(rig, when)
    assert "emergency stop: red button" in rig.reasons


@pytest.mark.parametrize("when", IN_ARMING)
def test_during_arming(when, tmp_path):
    rig = Rig(Plan(cuts_in={when: stop}, after=again_and_on), tmp_path).run()
    assert rig.refusal is not None
    assert "no torque is on" in str(rig.refusal)
    check_off(rig, when)


@pytest.mark.parametrize("offset", [0.0005, 0.0035, 0.0065, 0.0095, 0.0125, 0.0155, 0.0185])
def test_at_any_instant_of_a_cycle(offset, tmp_path):
    rig = Rig(Plan(cuts_in={2.0 + offset: stop}, after=go_on), tmp_path).run()
    check_off(rig, 2.0 + offset)


def test_after_a_controlled_stop(tmp_path):
    stopped = []

    def press(rig: Rig) -> None:
        stopped.append((rig.supervisor.state, rig.now))
        stop(rig)
        again_and_on(rig)

    rig = Rig(Plan(end=2.0, rests=True, after=press), tmp_path).run()
    (state, when), *_ = stopped
    assert state is SafetyState.STOPPED
    check_off(rig, when)


def test_before_the_robot_was_ever_armed(tmp_path):
    rig = Rig(Plan(), tmp_path)
    rig.supervisor.emergency("red button")
    go_on(rig)
    check_off(rig, 0.0)
    assert rig.shafts.changes == []


def test_only_an_explicit_wish_to_arm_brings_torque_back(tmp_path):
    torque = []

    def arm(rig: Rig) -> None:
        go_on(rig)
        torque.append(any(rig.shafts.on))
        rig.supervisor.arm()
        torque.append(all(rig.shafts.on))
        assert rig.supervisor.state is SafetyState.ACTIVE

    rig = Rig(Plan(cuts_in={2.0: stop}, after=arm), tmp_path).run()
    assert torque == [False, True]
    assert rig.parts.report()["torque_on"] == []
    assert rig.parts.report()["protocol_violations"] == {}
