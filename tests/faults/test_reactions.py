"""Every fault of the table, injected into a whole robot that trots: it reacts as it must."""

import math

import numpy as np
import pytest

from bluefoot_mpc.io.safety.states import SafetyState
from bluefoot_mpc.types import Mode
from tests.faults.rig import SLOWEST, SPEED, Plan, Rig
from tests.faults.table import AT, CASES, OFF_TIME, Case, Reaction

pytestmark = pytest.mark.slow

ALL = [pytest.param(case, id=case.name.replace(" ", "-")) for cases in CASES.values() for case in cases]
ENDING = (Reaction.FREEZES, Reaction.STOPS, Reaction.DROPS, Reaction.CUTS)
"""Reactions after which the run is ended in the regular way."""
STILL_WALKS = 0.75 * SPEED
"""m/s that a disturbed robot must make at least."""
GAIT_END = 1.3
"""s that a trot takes to end before the robot sits down."""
FASTEST_SINKING = 0.3
"""m/s; a robot whose torque is just taken away drops with 0.5 m/s."""


@pytest.mark.parametrize("case", ALL)
def test_reaction(case: Case, tmp_path, caplog):
    plan = Plan(
        faults=case.faults, actions=dict(case.actions), spoil=case.spoil, lidar=case.lidar, end=case.end,
        rests=case.reaction in ENDING or bool(case.logs),
    )  # fmt: skip
    rig = Rig(plan, tmp_path).run()
    CHECKS[case.reaction](rig, case)
    told = "\n".join((*rig.reasons, str(rig.refusal)))
    for words in case.says:
        assert words in told
    assert case.logs in caplog.text
    check_rules(rig, case)


def check_rules(rig: Rig, case: Case) -> None:
    """What holds whatever happens."""
    seen = rig.parts.report()
    violations = {kind for kind, count in seen["protocol_violations"].items() if count}
    assert violations <= set(case.excused)
    assert seen["eeprom_writes"] == 0
    assert seen["torque_on"] == []
    assert rig.shafts.limp_at() < math.inf
    assert seen["power_on"] is bool(case.logs)  # a stuck switch is the one fault that keeps it on
    assert all(goal <= rig.shafts.limp_at() for goal in rig.line.goals if goal > rig.ended)
    for joint in case.limp:
        assert rig.shafts.back_on(joint, AT) == []
    if len(rig.times) > 1:
        assert np.diff(rig.times).max() <= SLOWEST


def check_walks_on(rig: Rig, case: Case) -> None:
    assert rig.refusal is None
    assert [state for time, state in rig.states if time < case.end] == [SafetyState.ACTIVE]
    assert set(rig.modes(case.since, case.end)) == {Mode.WALK}
    assert not rig.fell
    assert rig.tilt_deg(case.since) < 4.0
    assert rig.way(case.since, case.end) > STILL_WALKS * (case.end - case.since)
    if case.lidar and case.since == AT:
        check_scans(rig, case)


def check_scans(rig: Rig, case: Case) -> None:
    """Scans come back, and none of them is a damaged one."""
    scans = [(frame.time, frame.lidar) for frame in rig.data.frames if frame.lidar is not None]
    times = np.array([time for time, _ in scans])
    assert times[-1] > case.end - 0.2
    assert len(times[times < 3.0]) > 10
    assert np.diff(times).max() > 0.15  # the fault has cost some
    first = np.nan_to_num(scans[0][1].distance)
    for _, scan in scans:
        assert np.median(np.abs(np.nan_to_num(scan.distance) - first)) < 0.2


def check_pauses(rig: Rig, case: Case) -> None:
    paused = min(rig.state_at(SafetyState.HOLD), rig.state_at(SafetyState.SITTING))
    assert AT < paused <= AT + case.within
    assert rig.state_at(SafetyState.ACTIVE, after=paused) < case.end - 2.0
    assert set(rig.modes(case.end - 1.0, case.end)) == {Mode.WALK}
    assert rig.way(case.end - 1.0, case.end) > STILL_WALKS
    assert not rig.fell
    assert rig.tilt_deg(AT) < 4.0


def check_sits(rig: Rig, case: Case) -> None:
    sits = rig.state_at(SafetyState.SITTING)
    assert AT < sits <= AT + case.within
    assert rig.first(Mode.SIT) <= sits + GAIT_END
    assert not rig.fell
    low = [sample.q[2] for sample in rig.data.truth if sample.time < case.end][-1]
    assert low < rig.height(AT) - 0.02
    off = {joint for time, joint, on in rig.shafts.changes if not on and 2.0 < time < case.end}
    assert off <= set(case.limp)
    assert rig.sinking_speed(AT) < FASTEST_SINKING


def check_freezes(rig: Rig, case: Case) -> None:
    assert AT < rig.state_at(SafetyState.SITTING) <= AT + case.within
    assert not rig.fell
    assert rig.height(case.end) > rig.height(AT) - 0.01
    assert rig.shafts.limp_at() > case.end
    assert rig.state_at(SafetyState.STOPPED) < math.inf


def check_stops(rig: Rig, case: Case) -> None:
    stops = rig.state_at(SafetyState.STOPPING)
    assert AT < stops <= AT + case.within
    assert rig.state_at(SafetyState.STOPPED) < case.end
    assert rig.sinking_speed(AT) < FASTEST_SINKING
    assert rig.tilt_deg(AT) < 45.0


def check_drops(rig: Rig, case: Case) -> None:
    assert rig.state_at(SafetyState.STOPPING) <= AT + case.within
    assert rig.state_at(SafetyState.STOPPED) < case.end
    assert rig.shafts.limp_at() == pytest.approx(AT, abs=0.01)


def check_cuts(rig: Rig, case: Case) -> None:
    cut = rig.state_at(SafetyState.EMERGENCY)
    assert AT < cut <= AT + case.within
    assert rig.shafts.limp_at() <= cut + OFF_TIME
    assert max(rig.line.goals) <= cut


def check_refuses(rig: Rig, case: Case) -> None:
    assert rig.refusal is not None
    assert "no torque is on" in str(rig.refusal)
    assert rig.shafts.changes == []
    assert rig.line.goals == []
    assert rig.line.enables == []


CHECKS = {
    Reaction.WALKS_ON: check_walks_on,
    Reaction.PAUSES: check_pauses,
    Reaction.SITS: check_sits,
    Reaction.FREEZES: check_freezes,
    Reaction.STOPS: check_stops,
    Reaction.DROPS: check_drops,
    Reaction.CUTS: check_cuts,
    Reaction.REFUSES: check_refuses,
}


@pytest.mark.parametrize("kind", ["wrong_id", "wrong_length", "late_reply", "drop_reply"])
def test_the_driver_never_talks_over_a_reply(kind, tmp_path):
    """Not even where hardly any reply can be used, so that every request costs its longest time."""
    faults = [{"kind": kind, "start": AT, "probability": 0.9}]
    rig = Rig(Plan(faults=faults, end=AT + 2.5), tmp_path).run()
    assert rig.parts.report()["protocol_violations"] == {}
    assert np.diff(rig.times).max() <= SLOWEST
    assert rig.parts.report()["torque_on"] == []
