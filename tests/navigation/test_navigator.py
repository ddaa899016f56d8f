"""The whole of navigation: on the flat bench, and on sweeps that are of no use."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.navigator import Decision, Navigator
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.sim.worlds.make import make_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import Guide, Guided, GuideTask, LidarScan
from tests.navigation.bench import (
    BEARINGS,
    MOUNTS,
    PERIOD,
    Bench,
    body_state,
    box,
    closed_room,
    sensor_frame,
)

WANDER = Guide(task=GuideTask.WANDER, speed=0.2)
ROOM = LidarScan(time=0.0, bearing=BEARINGS, distance=np.full(BEARINGS.size, 2.0), valid=True)
DEAD_END = (
    box("one", 1.35, 0.55, 2.3, 0.1), box("other", 1.35, -0.55, 2.3, 0.1), box("end", 2.55, 0.0, 0.1, 1.2)
)  # fmt: skip
"""A passage a metre wide, that ends."""


def navigator() -> Navigator:
    return Navigator(NavigationConfig(), MOUNTS)


def run(nav: Navigator, scan: LidarScan | None, start: float, seconds: float) -> Decision:
    """Tick for a while; the sweep, if any, comes ten times a second with the time of its tick."""
    for tick in range(max(1, round(seconds / PERIOD))):
        time = start + tick * PERIOD
        fresh = replace(scan, time=time) if scan is not None and tick % 5 == 0 else None
        decision = nav.step(WANDER, sensor_frame(time, fresh), body_state(time), PERIOD)
    return decision


def moves(decision: Decision) -> bool:
    return bool(decision.velocity.any()) or decision.yaw_rate != 0.0


@pytest.mark.parametrize("world", ["room", "corridors", "chairs", "maze", "dead_ends"])
def test_wandering_touches_nothing_and_sees_most(world: str) -> None:
    ride = Bench(make_plan(world, 200), navigator(), seed=1).ride(WANDER, 30.0)
    assert ride.clearance >= 0.12
    assert ride.seen >= 0.4
    assert ride.still <= 5.0
    assert ride.travelled > 2.0


def test_the_field_alone_wanders_too() -> None:
    config = NavigationConfig()
    config = replace(config, explore=replace(config.explore, enabled=False))
    ride = Bench(make_plan("room", 200), Navigator(config, MOUNTS), seed=1).ride(WANDER, 25.0)
    assert ride.clearance >= 0.12
    assert ride.still <= 10.0


def test_out_of_a_dead_end() -> None:
    plan = closed_room(*DEAD_END)
    bench = Bench(plan, navigator(), seed=2, start=Pose(2.0, 0.0, 0.0))
    ride = bench.ride(WANDER, 40.0)
    assert ride.clearance >= 0.10
    assert ride.path[:, 0].min() < 0.2
    assert ride.still <= 10.0


def test_waypoints_are_reached_in_the_odometry_frame() -> None:
    plan = closed_room(box("box", 1.5, 0.0, 0.5, 0.5))
    bench = Bench(plan, navigator(), seed=3)
    points = np.array(((3.0, 0.2), (3.0, 1.2), (0.0, 1.0)))
    guide = Guide(task=GuideTask.GOTO, speed=0.2, waypoints=points)
    ride = bench.ride(guide, 90.0)
    report = ride.decisions[-1].report
    assert report.guided is Guided.ARRIVED
    assert report.waypoints_left == 0
    assert report.reason == ""
    assert math.dist(bench.robot.odometry[:2], points[-1]) <= 0.12
    assert ride.clearance >= 0.12
    assert not moves(ride.decisions[-1])


def test_a_waypoint_inside_a_thing_is_given_up_and_the_next_reached() -> None:
    plan = closed_room(box("box", 2.0, 0.0, 0.6, 0.6))
    bench = Bench(plan, navigator(), seed=4)
    guide = Guide(task=GuideTask.GOTO, speed=0.2, waypoints=np.array(((2.0, 0.0), (0.5, 1.0))))
    ride = bench.ride(guide, 80.0)
    report = ride.decisions[-1].report
    assert report.guided is Guided.ARRIVED
    assert "waypoint 1 given up" in report.reason
    assert ride.clearance >= 0.12


def test_without_a_sweep_the_robot_stands_and_says_so() -> None:
    decision = run(navigator(), None, 0.0, 1.0)
    assert decision.report.guided is Guided.BLIND
    assert decision.report.reason == "no sweep of the LIDAR yet"
    assert not moves(decision)
    assert math.isnan(decision.report.scan_time)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"bearing": np.zeros(0), "distance": np.zeros(0)}, "only 0 rays"),
        ({"distance": np.full(BEARINGS.size, np.nan)}, "no echo"),
        ({"distance": np.ones(7)}, "do not match"),
        ({"bearing": BEARINGS * np.nan}, "not numbers"),
        ({"valid": False}, "invalid"),
    ],
)
def test_useless_sweeps_leave_it_blind_until_good_ones_come_back(
    change: dict[str, object], reason: str
) -> None:
    nav = navigator()
    assert moves(run(nav, ROOM, 0.0, 2.0))
    useless = replace(ROOM, **change)  # type: ignore[arg-type]
    decision = run(nav, useless, 2.0, 0.4)
    assert decision.report.guided is Guided.FIELD  # not yet: the last good sweep is fresh enough
    decision = run(nav, useless, 2.4, 1.0)
    assert decision.report.guided is Guided.BLIND
    assert reason in decision.report.reason
    assert not moves(decision)
    decision = run(nav, ROOM, 3.4, 2.0)
    assert decision.report.guided is Guided.FIELD
    assert moves(decision)


def test_after_a_pause_it_begins_from_standing() -> None:
    nav = navigator()
    assert moves(run(nav, ROOM, 0.0, 2.0))
    assert not moves(run(nav, None, 10.0, PERIOD))
    assert moves(run(nav, ROOM, 10.02, 1.0))


def test_a_frozen_sweep_counts_as_none() -> None:
    nav = navigator()
    run(nav, ROOM, 0.0, 1.0)
    for tick in range(50, 100):
        time = tick * PERIOD
        decision = nav.step(WANDER, sensor_frame(time, replace(ROOM, time=0.9)), body_state(time), PERIOD)
    assert decision.report.guided is Guided.BLIND


def test_a_place_that_is_no_number_leaves_it_blind() -> None:
    nav = navigator()
    run(nav, ROOM, 0.0, 1.0)
    for tick in range(50, 60):
        time = tick * PERIOD
        state = body_state(time, x=math.nan)
        decision = nav.step(WANDER, sensor_frame(time, replace(ROOM, time=time)), state, PERIOD)
        assert decision.report.guided is Guided.BLIND
        assert not moves(decision)
    assert moves(run(nav, ROOM, 1.2, 1.0))


def test_reset_gives_back_the_state_after_the_start() -> None:
    plan, nav = make_plan("room", 201), navigator()
    first = Bench(plan, nav, seed=5).ride(WANDER, 6.0)
    nav.reset()
    again = Bench(plan, nav, seed=5).ride(WANDER, 6.0)
    np.testing.assert_array_equal(first.path, again.path)


def test_hemmed_in_on_all_sides_it_stands_still_and_touches_nothing() -> None:
    walls = (
        box("back", -0.35, 0.0, 0.1, 0.8), box("front", 0.35, 0.0, 0.1, 0.8),
        box("right", 0.0, -0.35, 0.8, 0.1), box("left", 0.0, 0.35, 0.8, 0.1),
    )  # fmt: skip
    plan = WorldPlan(name="box", seed=0, bounds=(-0.3, -0.3, 0.3, 0.3), solids=walls)
    ride = Bench(plan, navigator(), seed=6).ride(WANDER, 12.0)
    assert ride.clearance > 0.03
    assert np.abs(ride.path[:, :2]).max() < 0.05
    assert ride.decisions[-1].report.guided is Guided.ESCAPE


def test_on_open_ground_it_goes_slowly_and_says_so() -> None:
    nowhere = replace(ROOM, distance=np.full(BEARINGS.size, np.nan))
    decision = run(navigator(), nowhere, 0.0, 4.0)
    assert moves(decision)
    assert decision.velocity[0] <= 0.10 + 1e-9
    assert "open ground" in decision.report.reason


@pytest.mark.parametrize("stamp", [np.nan, 25.0, -25.0])
def test_a_sweep_with_an_impossible_time_neither_leads_nor_keeps_good_ones_out(stamp: float) -> None:
    nav = navigator()
    decision = nav.step(WANDER, sensor_frame(0.0, replace(ROOM, time=stamp)), body_state(0.0), PERIOD)
    assert decision.report.guided is Guided.BLIND
    assert moves(run(nav, ROOM, 0.02, 2.0))


def test_the_guard_chooses_nothing_faster_than_the_task_allows() -> None:
    plan = closed_room(box("box", 1.0, 0.25, 0.5, 0.5), box("other", 2.2, -0.6, 0.5, 0.5))
    ride = Bench(plan, navigator(), seed=6).ride(Guide(task=GuideTask.WANDER, speed=0.03), 40.0)
    assert max(decision.velocity[0] for decision in ride.decisions) <= 0.03 + 1e-9


def test_what_leaves_the_view_as_the_robot_turns_is_no_covered_lidar() -> None:
    nav = navigator()
    distance = np.full(BEARINGS.size, np.nan)
    distance[:30] = 1.0  # the last that is seen of a box to the right
    run(nav, replace(ROOM, distance=distance), 0.0, 1.0)
    decision = run(nav, replace(ROOM, distance=np.full(BEARINGS.size, np.nan)), 1.0, 3.0)
    assert decision.report.guided is not Guided.BLIND
    assert moves(decision)


def test_a_pause_is_no_time_in_which_a_waypoint_was_tried() -> None:
    nav = navigator()
    guide = Guide(task=GuideTask.GOTO, speed=0.2, waypoints=np.array(((1.5, 0.0),)))

    def go(start: float, seconds: float) -> Decision:
        for tick in range(round(seconds / PERIOD)):
            time = start + tick * PERIOD
            fresh = replace(ROOM, time=time) if tick % 5 == 0 else None
            decision = nav.step(guide, sensor_frame(time, fresh), body_state(time), PERIOD)
        return decision

    go(0.0, 2.0)
    decision = go(60.0, 2.0)
    assert decision.report.waypoints_left == 1, decision.report.reason
    assert moves(decision)


def test_the_same_task_given_again_is_a_new_one_in_known_surroundings() -> None:
    nav = navigator()
    guide = Guide(task=GuideTask.GOTO, speed=0.2, waypoints=np.zeros((1, 2)))
    for tick in range(20):
        time = tick * PERIOD
        fresh = replace(ROOM, time=time) if tick % 5 == 0 else None
        decision = nav.step(guide, sensor_frame(time, fresh), body_state(time), PERIOD)
    assert decision.report.guided is Guided.ARRIVED
    known = len(nav._around.points())
    nav.begin()
    assert len(nav._around.points()) == known
    other = replace(guide, waypoints=np.array(((1.0, 0.0),)))
    decision = nav.step(other, sensor_frame(0.5, replace(ROOM, time=0.5)), body_state(0.5), PERIOD)
    assert decision.report.waypoints_left == 1
