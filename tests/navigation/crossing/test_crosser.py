"""Crossing rough ground: sweep, think, walk, sweep again; and what happens where that is not possible."""

import numpy as np
import pytest

from bluefoot_mpc.types import CrossingPhase, GuideTask
from tests.navigation.crossing.bench import Bench

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
    assert bench.pose[0] < 0.4


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
