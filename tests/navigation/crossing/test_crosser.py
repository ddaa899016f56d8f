"""Crossing rough ground: sweep, think, walk, sweep again; and what happens where that is not possible."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.navigation.crossing import mapper
from bluefoot_mpc.navigation.crossing.crosser import FeetState
from bluefoot_mpc.types import CrossingPhase, Guide, GuideTask
from tests.navigation.crossing.bench import DT, Bench, estimate, frame

REACH = 0.08
"""m by which feet may land short of their places under the trunk, and the bench's robot overshoots."""


def phases(bench):
    found = [report.phase for report in bench.reports]
    return [phase for k, phase in enumerate(found) if k == 0 or phase is not found[k - 1]]


def test_even_ground_is_crossed_in_stretches(monkeypatch):
    bench = Bench(monkeypatch)
    last = bench.run(40.0)
    assert last.phase is CrossingPhase.ARRIVED
    assert bench.pose[:2] == pytest.approx([1.5, 0.0], abs=0.05)
    assert last.sweeps >= 3
    assert phases(bench)[:5] == ["sweep", "think", "walk", "sweep", "think"]
    maps = [report for report in bench.reports if report.ground is not None]
    assert len(maps) == last.sweeps
    assert all(len(report.route) > 1 for report in maps[:-1])


def test_it_goes_round_what_it_cannot_step_on(monkeypatch):
    def block(x, y):
        return np.where((np.abs(x - 0.9) < 0.1) & (y > -0.05) & (y < 0.3), 0.15, 0.0)

    bench = Bench(monkeypatch, world=block)
    last = bench.run(70.0)
    way = np.vstack([report.route for report in bench.reports if len(report.route)])
    beside = way[np.abs(way[:, 0] - 0.9) < 0.1]
    assert last.phase is CrossingPhase.ARRIVED
    assert np.abs(beside[:, 1]).max() > 0.02


def test_before_a_wall_it_stays_and_says_why(monkeypatch):
    bench = Bench(monkeypatch, world=lambda x, y: np.where(x > 0.7, 0.3, 0.0))
    last = bench.run(70.0)
    assert last.phase is CrossingPhase.BLOCKED
    assert last.reason
    assert bench.pose[0] < 0.7 - 0.158 + REACH
    assert last.sweeps >= 3  # it looked again before it gave up


def test_it_never_goes_where_nothing_is_known(monkeypatch):
    bench = Bench(monkeypatch, world=lambda x, y: np.where(x > 0.6, np.nan, 0.0))
    last = bench.run(70.0)
    assert last.phase is CrossingPhase.BLOCKED
    assert bench.pose[0] < 0.6 - 0.158 + REACH


def test_without_assumed_ground_a_start_on_unknown_cells_is_told(monkeypatch):
    bench = Bench(monkeypatch, start_radius=0.0)
    last = bench.run(30.0)
    assert last.phase is CrossingPhase.BLOCKED
    assert "unknown" in last.reason
    assert not bench.pose.any()


def test_a_sweep_that_saw_nothing_leaves_it_where_it_is(monkeypatch):
    bench = Bench(monkeypatch, world=lambda x, y: np.full_like(x, np.nan), reason="no usable scan: none came")
    last = bench.run(70.0)
    assert last.phase is CrossingPhase.BLOCKED
    assert "no usable scan" in last.reason
    assert not bench.pose.any()


def test_a_foot_without_a_foothold_makes_it_look_again_and_then_stay(monkeypatch):
    bench = Bench(monkeypatch, patience=2.0)
    last = bench.run(60.0, speed=0.005, waiting="FL: nothing to step on")
    assert last.phase is CrossingPhase.BLOCKED
    assert last.reason == "FL: nothing to step on"


def test_only_to_sweep_ends_standing_with_a_map(monkeypatch):
    bench = Bench(monkeypatch)
    last = bench.run(5.0, task=GuideTask.SWEEP)
    assert last.phase is CrossingPhase.ARRIVED
    assert bench.crosser.ground is not None
    assert not bench.pose.any()


def test_a_new_task_begins_anew_and_a_reset_forgets_the_ground(monkeypatch):
    bench = Bench(monkeypatch)
    bench.run(40.0)
    ground = bench.crosser.ground
    bench.crosser.begin()
    assert bench.run(0.2, goal=(3.0, 0.0)).phase is CrossingPhase.SWEEP
    assert bench.crosser.ground is ground
    assert bench.run(40.0, goal=(3.0, 0.0)).phase is CrossingPhase.ARRIVED
    assert bench.pose[0] == pytest.approx(3.0, abs=0.05)
    bench.crosser.reset()
    assert bench.crosser.ground is None


def test_another_goal_is_walked_to_although_it_has_arrived(monkeypatch):
    bench = Bench(monkeypatch)
    assert bench.run(25.0, goal=(0.5, 0.0)).phase is CrossingPhase.ARRIVED
    assert bench.run(0.1, goal=(1.0, 0.0)).phase is CrossingPhase.SWEEP
    assert bench.run(25.0, goal=(1.0, 0.0)).phase is CrossingPhase.ARRIVED
    assert bench.pose[0] == pytest.approx(1.0, abs=0.05)


def test_what_goes_wrong_in_thinking_is_a_reason_to_stay(monkeypatch):
    def broken(*_):
        raise ValueError("no such ground")

    monkeypatch.setattr(mapper, "rate_ground", broken)
    bench = Bench(monkeypatch)
    last = bench.run(10.0)
    assert last.phase is CrossingPhase.BLOCKED
    assert "no such ground" in last.reason
    assert last.sweeps == 3
    assert not bench.pose.any()


def test_a_task_that_begins_amid_a_map_does_not_take_the_ground_to_be_even(monkeypatch):
    bench = Bench(monkeypatch, world=lambda x, y: np.where((x > 0.75) & (x < 0.95), np.nan, 0.0))
    last = bench.run(70.0)
    assert last.phase is CrossingPhase.BLOCKED
    stands = bench.pose[0]
    bench.crosser.begin()
    assert bench.run(70.0).phase is CrossingPhase.BLOCKED
    assert bench.pose[0] < stands + 0.03


def test_an_estimate_that_is_no_number_moves_nothing_and_is_forgotten(monkeypatch):
    bench = Bench(monkeypatch)
    bench.run(5.0)
    pose, bench.pose = bench.pose, np.full(3, np.nan)
    guide = Guide(task=GuideTask.CROSS, waypoints=np.array([[1.5, 0.0]]))
    found = bench.crosser.step(guide, frame(5.0), estimate(5.0, bench.pose), FeetState(resting=True), DT)
    assert not found.velocity.any()
    assert "no number" in found.report.reason
    bench.pose = pose
    assert bench.run(40.0).phase is CrossingPhase.ARRIVED


@pytest.mark.parametrize("tilt", [(0.5, 0.0), (0.0, -0.5)])
def test_a_robot_that_lies_on_something_goes_nowhere(monkeypatch, tilt):
    bench = Bench(monkeypatch)
    assert bench.run(8.0).phase is CrossingPhase.WALK
    bench.tilt = tilt
    bench.run(0.3)
    bench.tilt = (0.0, 0.0)  # a moment is none
    assert bench.run(1.0).phase is CrossingPhase.WALK
    bench.tilt = tilt
    last = bench.run(1.0)
    assert last.phase is CrossingPhase.BLOCKED
    assert "leans" in last.reason
    before = bench.pose.copy()
    bench.tilt = (0.0, 0.0)
    bench.run(5.0)
    np.testing.assert_array_equal(bench.pose, before)


def test_it_stops_where_the_next_sweep_can_still_see_the_end_of_what_is_known(monkeypatch):
    # A way down of which nothing comes back between 0.85 and 1.0 m is first seen from nearer.
    def world(x, y):
        return np.where((x > 0.85) & (x < 1.0), np.nan, -0.18 * np.maximum(x - 0.8, 0.0))

    bench = Bench(monkeypatch, world=world)
    bench.run(30.0)
    stops = [report for report in bench.reports if len(report.route)]
    assert np.hypot(*stops[0].route[-1, :2]) == pytest.approx(0.35, abs=0.05)
    plain = Bench(monkeypatch, world=lambda x, y: np.where((x > 0.85) & (x < 1.0), np.nan, 0.0))
    plain.run(10.0)
    first = next(report for report in plain.reports if len(report.route))
    assert np.hypot(*first.route[-1, :2]) == pytest.approx(0.5, abs=0.05)


def test_it_stays_after_three_sweeps_without_fruit_and_none_counts_that_had_some(monkeypatch):
    bench = Bench(monkeypatch, world=lambda x, y: np.where(x > 0.7, 0.3, 0.0))
    bench.run(70.0)
    walked = [np.hypot(*report.route[-1, :2]) > 0.05 if len(report.route) else False
              for report in bench.reports if report.ground is not None]  # fmt: skip
    fruitless = len(walked) - 1 - max(k for k, fruit in enumerate(walked) if fruit)
    assert fruitless <= 3 < len(walked)
    once = Bench(monkeypatch, attempts=1)
    assert once.run(40.0).phase is CrossingPhase.ARRIVED


def test_ground_is_taken_to_be_even_again_after_a_walk_elsewhere(monkeypatch):
    bench = Bench(monkeypatch)
    assert bench.run(25.0, goal=(0.5, 0.0)).phase is CrossingPhase.ARRIVED
    bench.pose = np.array([3.5, 0.0, 0.0])  # by another motion
    bench.crosser.begin()
    assert bench.run(30.0, goal=(4.0, 0.0)).phase is CrossingPhase.ARRIVED


def test_on_the_way_a_plan_that_finds_no_way_ends_the_walk(monkeypatch):
    bench = Bench(monkeypatch, incremental=True)
    assert bench.run(6.0).phase is CrossingPhase.WALK
    real = mapper.plan_route

    def none(*args):
        return replace(real(*args), poses=np.zeros((0, 3)), feasible=False, reason="a hole")

    monkeypatch.setattr(mapper, "plan_route", none)
    before = bench.pose[0]
    bench.run(4.0)
    assert bench.pose[0] < before + 0.12
    assert bench.reports[-1].phase is not CrossingPhase.WALK


@pytest.mark.parametrize("incremental", [False, True])
def test_a_robot_that_is_held_looks_again(monkeypatch, incremental):
    bench = Bench(monkeypatch, incremental=incremental, stall=5.0)
    assert bench.run(6.0).phase is CrossingPhase.WALK
    for _ in range(200):
        pose = bench.pose.copy()
        bench.run(DT)
        bench.pose = pose
        if bench.reports[-1].phase is not CrossingPhase.WALK:
            break
    assert "no progress" in bench.reports[-1].reason
    assert bench.time < 6.0 + 7.0
