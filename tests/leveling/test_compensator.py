"""What the compensator does with inputs and predictions that cannot be used, and how it forgets."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.leveling.config import LevelingLimits, ScheduleConfig
from tests.leveling.bench import (
    DT,
    INPUTS,
    MOVED,
    NOW,
    PSI,
    STANCE,
    at,
    compensator,
    last,
    seen,
    state,
    told,
)

# What cannot be used.


def test_a_believed_disturbance_is_bounded(monkeypatch):
    law, _ = told(monkeypatch, np.full(22, 1e6), limits=LevelingLimits(disturbance=40.0))
    report = law.step(INPUTS, DT).report
    np.testing.assert_array_equal(np.abs(report.disturbance), 40.0)


@pytest.mark.parametrize("size", [1e3, 1e6, 1e300])
def test_no_goal_is_moved_further_than_allowed(monkeypatch, size):
    law, _ = told(monkeypatch, np.full(22, size), limits=LevelingLimits(shift=0.11, disturbance=1e9))
    for _ in range(60):
        goals = law.step(INPUTS, DT).goals
        assert np.abs(goals - INPUTS.goals).max() <= 0.11 + 1e-12


def test_goals_that_stay_at_their_limit_stop_it_for_good(monkeypatch):
    law, source = told(
        monkeypatch, np.full(22, 1e6), limits=LevelingLimits(shift=0.05, disturbance=1e9, clamped=0.2)
    )
    reports = [law.step(INPUTS, DT).report for _ in range(20)]
    stopped = next(k for k, report in enumerate(reports) if report.stopped)
    assert 0.2 <= (stopped + 1) * DT <= 0.26
    assert "limits" in reports[-1].stopped
    source.psi = np.zeros(22)
    assert last(law, INPUTS, 200).report.share == 0.0
    law.reset()
    assert law.step(INPUTS, DT).report.share == 1.0


@pytest.mark.parametrize("answer", [None, np.full(22, np.nan), np.full(22, np.inf)])
def test_a_source_without_an_answer_is_not_acted_on(monkeypatch, answer):
    law, source = told(monkeypatch, PSI)
    assert last(law, INPUTS).report.share == 1.0
    source.psi = answer
    leveled = law.step(INPUTS, DT)
    assert leveled.report.share == 0.0
    assert leveled.report.stopped == "nothing predicts the disturbance"
    np.testing.assert_array_equal(leveled.goals, INPUTS.goals)
    source.psi = PSI
    shares = [law.step(INPUTS, DT).report.share for _ in range(60)]
    assert shares[40] == 0.0
    assert shares[-1] == 1.0


@pytest.mark.parametrize("what", ["unhealthy", "tilt", "answer"])
def test_what_cannot_be_acted_on_is_not_faded_out(monkeypatch, what):
    law, source = told(monkeypatch, PSI, schedule=ScheduleConfig(fade=0.2))
    assert last(law, INPUTS, 20).report.share == 1.0
    source.psi = None if what == "answer" else PSI
    leveled = law.step(BROKEN[what](INPUTS) if what in BROKEN else INPUTS, DT)
    assert leveled.report.share == 0.0
    np.testing.assert_array_equal(leveled.goals, INPUTS.goals)


def test_a_large_tilt_is_faded_out(monkeypatch):
    law, _ = told(monkeypatch, PSI, schedule=ScheduleConfig(fade=0.2))
    last(law, INPUTS, 20)
    assert law.step(seen(state(rpy=(0.4, 0.0, 0.0))), DT).report.share == pytest.approx(0.9)


def test_a_fault_of_the_source_stops_it_until_reset(monkeypatch):
    law, source = told(monkeypatch, PSI)
    last(law, INPUTS)
    source.fault = "broken"
    assert last(law, INPUTS, 2).report.stopped == "broken"
    source.fault = ""
    leveled = last(law, INPUTS, 200)
    assert (leveled.report.share, leveled.report.stopped) == (0.0, "broken")
    np.testing.assert_array_equal(leveled.goals, INPUTS.goals)


def blind(inputs):
    nan = np.full(3, np.nan)
    unknown = replace(inputs.estimate, rpy=nan, quaternion=np.full(4, np.nan), healthy=False)
    return replace(inputs, estimate=unknown)


BROKEN = {
    "unhealthy": lambda inputs: replace(inputs, estimate=replace(inputs.estimate, healthy=False)),
    "blind": blind,
    "tilt": lambda inputs: replace(inputs, estimate=replace(inputs.estimate, rpy=np.full(3, np.nan))),
    "rate": lambda inputs: replace(inputs, turn_rate=np.full(3, np.nan)),
    "velocity": lambda i: replace(i, estimate=replace(i.estimate, linear_velocity=np.full(3, np.inf))),
    "joints": lambda i: replace(i, estimate=replace(i.estimate, joint_position=np.full(16, np.nan))),
    "speeds": lambda i: replace(i, estimate=replace(i.estimate, joint_velocity=np.full(16, np.nan))),
    "feet": lambda i: replace(i, estimate=replace(i.estimate, foot_position_in_base=np.full((4, 3), np.nan))),
    "heading": lambda i: replace(i, heading_error=math.nan),
    "load": lambda i: replace(i, joint_load=np.full(16, np.inf)),
    "imu": lambda i: replace(i, specific_force=None),
    "voltage": lambda i: replace(i, voltage=math.nan),
}


@pytest.mark.parametrize("form", ["mixed", "residual"])
@pytest.mark.parametrize("mass_matrix", ["nominal", "model"])
@pytest.mark.parametrize("psi", ["zero", "persistence", "model", "network"])
@pytest.mark.parametrize("what", BROKEN)
def test_bad_inputs_never_reach_the_goals(what, psi, mass_matrix, form):
    law = compensator(psi=psi, mass_matrix=mass_matrix, form=form)
    last(law, INPUTS, 5)
    for _ in range(10):
        goals = law.step(BROKEN[what](INPUTS), DT).goals
        assert np.isfinite(goals).all()
        assert np.abs(goals - INPUTS.goals).max() <= LevelingLimits().shift + 1e-12
    report = last(law, INPUTS, 60).report
    assert report.share == 1.0  # and on it goes
    assert report.stopped == ""
    for value in (report.disturbance, report.measured, report.torque, report.contact_force):
        assert np.isfinite(value).all()


def test_goals_that_are_no_numbers_are_handed_on_for_the_supervisor_to_refuse():
    law = compensator(psi="zero")
    last(law, INPUTS)
    broken = replace(INPUTS, goals=np.full(16, np.nan))
    assert np.isnan(law.step(broken, DT).goals).all()
    leveled = last(law, INPUTS, 5)
    assert np.isfinite(leveled.goals).all()
    assert np.isfinite(leveled.report.measured).all()


@pytest.mark.parametrize("tilt", [(0.36, 0.0), (0.0, -0.36), (0.26, 0.26)])
def test_a_large_tilt_pauses_it_and_it_comes_back(tilt):
    law = compensator(psi="zero", schedule=replace(NOW, fade=0.02))
    last(law, INPUTS)
    fallen = seen(state(rpy=(*tilt, 0.0)))
    leveled = last(law, fallen, 2)
    assert leveled.report.share == 0.0
    assert "20 degrees" in leveled.report.stopped
    shares = [law.step(INPUTS, DT).report.share for _ in range(60)]
    assert sum(share == 0.0 for share in shares) == pytest.approx(50, abs=1)
    assert shares[-1] == 1.0


def test_tilts_count_from_the_commanded_one():
    law = compensator(psi="zero")
    leaning = seen(state(rpy=(0.3, 0.2, 0.0)), tilt_reference=np.array([0.3, 0.2]))
    assert last(law, leaning).report.share == 1.0


# Reset.


def shaken(law, ticks=80):
    """Commands and reports under inputs that change and fail."""
    rng, rows = np.random.default_rng(7), []
    for k in range(ticks):
        moving = state(
            rpy=rng.normal(0.0, 0.03, 3), rate=rng.normal(0.0, 0.4, 3), velocity=rng.normal(0.0, 0.1, 3),
            joints=STANCE + rng.normal(0.0, 0.05, 16), speed=rng.normal(0.0, 1.0, 16),
        )  # fmt: skip
        inputs = at(k * DT, seen(moving, goals=STANCE + rng.normal(0.0, 0.05, 16)))
        leveled = law.step(blind(inputs) if k == 30 else inputs, DT)
        report = leveled.report
        rows.append(
            np.concatenate(
                [leveled.goals, report.disturbance, report.measured, [report.share, report.mse, report.rate]]
            )
        )
    return np.array(rows)


@pytest.mark.parametrize("psi", ["zero", "persistence", "model", "network"])
@pytest.mark.parametrize("form", ["mixed", "residual"])
def test_reset_is_the_beginning_bit_for_bit(psi, form):
    schedule = ScheduleConfig(fade=0.1, off=0.4, on=0.4, learn="always", learn_time=0.2)
    law = compensator(psi=psi, form=form, schedule=schedule)
    first = shaken(law)
    law.reset()
    np.testing.assert_array_equal(shaken(law), first)
    np.testing.assert_array_equal(shaken(compensator(psi=psi, form=form, schedule=schedule)), first)


def test_what_it_was_given_stays_as_it_was():
    law = compensator(psi="network", schedule=replace(NOW, learn="always"))
    inputs = seen(MOVED)
    goals, joints = inputs.goals.copy(), MOVED.joint_position.copy()
    last(law, inputs, 5)
    np.testing.assert_array_equal(inputs.goals, goals)
    np.testing.assert_array_equal(MOVED.joint_position, joints)


# Time.


def test_windows_count_from_the_first_tick_whatever_the_clock_says():
    law = compensator(psi="zero", schedule=ScheduleConfig(off=0.2, on=0.2, fade=1e-3))
    shares = [law.step(at(1000.0 + DT * k, INPUTS), DT).report.share for k in range(20)]
    assert shares == [0.0] * 10 + [1.0] * 10


def test_a_period_with_a_lost_frame_tells_nothing():
    law = compensator(psi="persistence")
    times = np.array([0.0, 1.0, 2.0, 4.0, 5.0, 6.0]) * DT + 1.0
    known = [np.isfinite(law.step(at(time, INPUTS), DT).report.measured).all() for time in times]
    assert known == [False, False, True, False, True, True]


def test_the_network_learns_neither_of_a_blind_estimate_nor_while_it_only_pauses(monkeypatch):
    law, source = told(monkeypatch, None, schedule=ScheduleConfig(off=0.2, on=0.2, fade=1e-3))
    for k in range(20):
        law.step(at(DT * k, seen(replace(MOVED, healthy=k != 3))), DT)
    assert [s.learn for s in source.seen] == [k < 10 and k != 3 for k in range(20)]
