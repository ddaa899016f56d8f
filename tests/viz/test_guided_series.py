from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.viz.guided_series import GuidedSeries, extract_guided
from bluefoot_mpc.viz.scans import CELL, cloud, known_plan, plan_fits, read_scans
from bluefoot_mpc.viz.series import extract

from . import navigating_run as made
from .navigating_run import DRIFT, WANTED, navigating_run


def series_of(run: RunData, robot: RobotModel) -> GuidedSeries:
    guided = extract_guided(run, extract(run, 1.5), robot.parameters.sensors)
    assert guided is not None
    return guided


def test_a_run_that_is_told_where_to_go_has_none(run: RunData, robot: RobotModel) -> None:
    assert extract_guided(run, extract(run, 1.5), robot.parameters.sensors) is None


def test_true_and_estimated_way(guided_run: RunData, robot: RobotModel) -> None:
    guided = series_of(guided_run, robot)
    assert np.array_equal(guided.position, guided_run.stack("truth", "q")[:, :2])
    assert guided.estimate[-1, 1] - guided.position[-1, 1] == pytest.approx(DRIFT * guided.time[-1])
    assert guided.yaw[-1] == pytest.approx(made.RATE * (guided.time[-1] - 1.0), abs=0.02)


def test_clearances_of_truth_and_robot(guided_run: RunData, robot: RobotModel) -> None:
    guided = series_of(guided_run, robot)
    true = guided_run.stack("truth", "clearance")
    assert np.array_equal(guided.clearance_true, true)
    assert guided.closest == int(np.argmin(true))
    assert np.isnan(guided.clearance_known[:50]).all()
    assert guided.clearance_known[60] == pytest.approx(true[60] + 0.02)
    assert np.isinf(guided.clearance_known[-1])


def test_what_led_and_what_was_asked(guided_run: RunData, robot: RobotModel) -> None:
    guided = series_of(guided_run, robot)
    assert guided.guided[10] == ""
    assert guided.guided[200] == "marker"
    assert guided.guided[390] == "search"
    assert guided.task[200] == "follow"
    assert guided.waypoints.tolist() == [[1.0, 0.5]]
    assert guided.collisions == ((pytest.approx(2.0), ("chair1",)),)


def test_distance_to_the_marker(guided_run: RunData, robot: RobotModel) -> None:
    guided = series_of(guided_run, robot)
    k = 250
    truth = guided_run.truth[k]
    ahead = robot.parameters.sensors.camera[0] * np.array([np.cos(guided.yaw[k]), np.sin(guided.yaw[k])])
    expected = np.hypot(*(truth.marker[:2] - truth.q[:2] - ahead))
    assert guided.distance_true[k] == pytest.approx(expected, abs=0.002)
    # Marker and robot are believed to have drifted by the same.
    assert guided.distance_estimate[k] == pytest.approx(expected, abs=0.01)
    assert np.isnan(guided.distance_estimate[100])
    assert guided.distance_wanted[k] == WANTED
    assert guided.marker_moves
    in_view = guided.in_view[guided.reports]
    assert in_view.mean() == pytest.approx(np.mean([made.seen(t) for t in guided.time if t >= 1.0]))


def test_without_truth_the_robots_own_account_stands(blind_run: RunData, robot: RobotModel) -> None:
    guided = series_of(blind_run, robot)
    assert not guided.has_truth
    assert np.array_equal(guided.position, guided.estimate)
    assert np.isnan(guided.distance_true).all()
    assert guided.closest == int(np.nanargmin(guided.clearance_known))
    assert not guided.has_leader


def test_a_log_without_the_newer_fields_still_gives_series(guided_run: RunData, robot: RobotModel) -> None:
    old = [
        dataclasses.replace(t, clearance=np.nan, marker=np.zeros(0), leader=np.zeros(0))
        for t in guided_run.truth
    ]
    guided = series_of(dataclasses.replace(guided_run, truth=old), robot)
    assert np.isnan(guided.marker_true).all()
    assert np.array_equal(guided.clearance, guided.clearance_known, equal_nan=True)


def test_sweeps_lie_on_the_worlds_outlines(guided_run: RunData, robot: RobotModel) -> None:
    scans = read_scans(guided_run, len(guided_run.telemetry), robot.parameters.sensors)
    assert len(scans) == len(guided_run.telemetry) // 5
    early = scans[:20]  # before the estimate has drifted
    points = cloud(guided_run, early, 4000)
    away = np.min([np.abs(footprint.distance(points, solid)) for solid in made.room().solids], axis=0)
    assert np.percentile(away, 95) < 0.05
    cells = np.round(points / CELL).astype(int)
    assert len(np.unique(cells, axis=0)) == len(points)


def test_sweeps_are_thinned_and_useless_ones_left_out(guided_run: RunData, robot: RobotModel) -> None:
    frames = list(guided_run.frames)
    lidar = frames[0].lidar
    assert lidar is not None
    frames[0] = dataclasses.replace(frames[0], lidar=dataclasses.replace(lidar, valid=False))
    run = dataclasses.replace(guided_run, frames=frames)
    scans = read_scans(run, len(frames), robot.parameters.sensors, most=30)
    assert len(scans) <= 30
    assert scans[0].tick > 0


@pytest.fixture(scope="module")
def blind_run(robot: RobotModel) -> RunData:
    return navigating_run(robot, duration=8.0, truth=False)


def test_a_plan_is_believed_only_where_the_sweeps_agree(guided_run: RunData, robot: RobotModel) -> None:
    mounts = robot.parameters.sensors
    assert known_plan(guided_run, mounts) == made.room()
    round_ones = [s for s in made.room().solids if s.shape == "cylinder"]
    thing = min(round_ones, key=lambda s: np.hypot(s.x, s.y) - 0.5 * s.size[0])
    moved = tuple(
        dataclasses.replace(s, x=s.x + 0.5) if s.name == thing.name else s for s in made.room().solids
    )
    assert not plan_fits(dataclasses.replace(made.room(), solids=moved), guided_run, mounts)
    config = {**guided_run.config, "sim": {"world": {"name": "gone.toml"}}}
    assert known_plan(dataclasses.replace(guided_run, config=config), mounts) is None
