"""Figures of runs that find their own way, from runs whose figures are known."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios import way_figures
from bluefoot_mpc.settings import to_table
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.types import Guide, Guided, GuideTask, Mode, MotionCommand, NavigationReport
from tests.runtime.made_up_run import make_run

PERIOD = 0.1
NAN = math.nan


def report(guided=Guided.FIELD, marker=(NAN, NAN, NAN), age=0.1):
    return NavigationReport(
        guided=guided, velocity=np.zeros(2), yaw_rate=0.0, pitch=0.0, field=np.zeros(2), potential=0.0,
        mixing=0.0, marker=np.array(marker), marker_position=np.full(3, NAN), marker_age=age,
        clearance=math.inf,
    )  # fmt: skip


def run_along(path, yaw=None, reports=None, marker=None, clearance=None, collisions=None):
    """A run whose trunk is at `path` (n, 2) at the ticks, 0.12 m high."""
    n = len(path)
    base = make_run(1)
    run = RunData(period=PERIOD, config={"model": to_table(load_parameters()), "sim": to_table(SimConfig())})
    for k in range(n):
        time = k * PERIOD
        turn = 0.0 if yaw is None else yaw[k]
        q = base.truth[0].q.copy()
        q[:7] = (*path[k], 0.12, 0.0, 0.0, math.sin(0.5 * turn), math.cos(0.5 * turn))
        run.frames.append(replace(base.frames[0], time=time))
        run.commands.append(replace(base.commands[0], time=time))
        navigation = report() if reports is None else reports[k]
        run.telemetry.append(replace(base.telemetry[0], time=time, navigation=navigation))
        run.truth.append(
            replace(
                base.truth[0],
                time=time,
                q=q,
                marker=np.full(3, NAN) if marker is None else np.array(marker),
                clearance=NAN if clearance is None else clearance[k],
                collisions=() if collisions is None else collisions[k],
            )
        )
    return run


def straight(n, step):
    return np.outer(np.arange(n) * step, (1.0, 0.0))


def test_the_path_is_as_long_as_what_was_walked():
    found = way_figures.movement(run_along(straight(51, 0.02)))
    assert found["path_m"] == pytest.approx(1.0)
    assert found["led_by_percent"] == {"field": 100.0}


def test_a_robot_that_stays_is_stuck_for_as_long_and_one_that_turns_is_not():
    path = np.concatenate([straight(50, 0.02), np.tile([0.98, 0.0], (100, 1))])
    assert way_figures.movement(run_along(path))["stuck_longest_s"] == pytest.approx(10.0, abs=0.5)
    yaw = np.concatenate([np.zeros(50), np.linspace(0.0, 3.0, 100)])
    assert way_figures.movement(run_along(path, yaw))["stuck_longest_s"] < 1.5


def test_a_robot_that_has_arrived_may_stay():
    reports = [report(Guided.FIELD)] * 10 + [report(Guided.ARRIVED)] * 100
    path = np.concatenate([straight(10, 0.1), np.tile([0.9, 0.0], (100, 1))])
    run = run_along(path, reports=reports)
    assert way_figures.movement(run)["stuck_longest_s"] < 0.5
    assert way_figures.arrival(run) == pytest.approx(1.0)


def test_who_leaves_the_goal_again_has_not_arrived():
    reports = [report(Guided.ARRIVED)] * 5 + [report(Guided.MARKER)] * 5
    assert way_figures.arrival(run_along(straight(10, 0.0), reports=reports)) is None


def test_nearness_is_the_least_clearance_and_everything_touched():
    clearance = [math.inf, 0.3, 0.12, 0.2]
    touched = [(), ("wall",), ("chair1_leg2", "wall"), ()]
    found = way_figures.nearness(run_along(straight(4, 0.1), clearance=clearance, collisions=touched))
    assert found == {"closest_approach_m": 0.12, "collisions": ["chair1_leg2", "wall"]}


def test_without_truth_nothing_is_said_about_touching():
    run = run_along(straight(4, 0.1))
    run.truth.clear()
    assert way_figures.nearness(run)["collisions"] is None


def test_the_distance_counts_from_the_camera_horizontally():
    camera_x, _, _ = load_parameters().sensors.camera
    run = run_along(straight(20, 0.0), marker=(camera_x + 0.63, 0.0, 0.9))
    found = way_figures.distance_figures(run, 0.6)
    assert found["distance_m"] == pytest.approx(0.63)
    assert found["distance_error_m"] == pytest.approx(0.03)
    assert way_figures.distance_figures(run_along(straight(5, 0.0)), 0.6)["distance_m"] is None


def test_view_is_the_share_of_ticks_with_a_marker():
    reports = [None] * 4 + [report()] * 3 + [report(marker=(320.0, 240.0, 30.0))] * 9
    run = run_along(straight(16, 0.01), reports=reports, marker=(2.0, 0.0, 0.2))
    assert way_figures.in_view_percent(run) == pytest.approx(75.0)
    assert way_figures.first_sight(run) == pytest.approx(0.7)
    assert way_figures.in_view_percent(run_along(straight(3, 0.0), reports=[None] * 3)) is None


@pytest.mark.parametrize(
    ("column", "place", "age", "counts"),
    [
        (320.0, (2.0, 0.0), 0.2, True),
        (320.0, (2.0, 0.0), 3.0, False),  # the picture is old: the camera may be dead
        (320.0, (2.0, 1.5), 0.2, False),  # what was found is something else
        (60.0, (2.105, 1.0), 0.2, True),  # left in the picture, left in the world
        (580.0, (2.105, 1.0), 0.2, False),
    ],
)
def test_a_stale_or_mistaken_marker_is_not_in_view(column, place, age, counts):
    reports = [report(marker=(column, 240.0, 30.0), age=age)] * 4
    run = run_along(np.zeros((4, 2)), reports=reports, marker=(*place, 0.2))
    assert way_figures.in_view_percent(run) == (100.0 if counts else 0.0)


def test_waypoints_are_judged_when_the_next_one_becomes_the_goal():
    points = np.array([[0.5, 0.0], [1.0, 0.3]])
    reports = [replace(report(Guided.WAYPOINT), waypoints_left=2 if k < 5 else 1) for k in range(11)]
    run = run_along(straight(11, 0.1), reports=reports)
    guided = MotionCommand(mode=Mode.WALK, guide=Guide(task=GuideTask.GOTO, waypoints=points))
    run.commands[:] = [replace(record, motion=guided) for record in run.commands]
    # Turned to the second at (0.5, 0), and ended at (1.0, 0), 0.3 m beside it.
    assert way_figures.waypoint_distances(run, points) == pytest.approx([0.0, 0.3])
    assert way_figures.waypoint_distances(run, points + 1.0) == []
