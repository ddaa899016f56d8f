from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.types import TruthSample
from bluefoot_mpc.viz.live import live_page
from bluefoot_mpc.viz.live_surroundings import LiveSurroundings
from bluefoot_mpc.viz.stage import Stage, stage_of, wheel_steering
from bluefoot_mpc.viz.stage_motion import RAYS
from bluefoot_mpc.wheels.ready import READY

from . import navigating_run as made
from .html_check import read_page


def surroundings(robot: RobotModel, leader: str = "differential") -> LiveSurroundings:
    return LiveSurroundings(Stage(plan=made.room(), leader=leader), robot.parameters.sensors.lidar)


def note(around: LiveSurroundings, run: RunData, k: int, truth: bool = True) -> TruthSample | None:
    sample = run.truth[k] if truth else None
    around.note(run.telemetry[k], sample, run.frames[k].lidar)
    return sample


def test_the_stage_is_that_of_the_configuration(guided_run: RunData) -> None:
    assert stage_of(guided_run.config) == Stage(plan=made.room(), leader="differential")
    assert stage_of({}) == Stage()


def test_a_sweep_is_told_once_and_lies_on_the_outlines(guided_run: RunData, robot: RobotModel) -> None:
    around = surroundings(robot)
    truth = note(around, guided_run, 100)
    note(around, guided_run, 101)  # no sweep on this tick; the last one has not been drawn yet
    points = np.reshape(around.state(guided_run.telemetry[101], truth)["sweep"], (-1, 3)) / 1e3
    assert 0.9 * RAYS < len(points) <= RAYS
    away = np.min([np.abs(footprint.distance(points[:, :2], solid)) for solid in made.room().solids], axis=0)
    assert np.percentile(away, 95) < 0.03
    assert points[:, 2] == pytest.approx(0.25, abs=0.06)
    assert "sweep" not in around.state(guided_run.telemetry[101], truth)


def test_the_leaders_wheels_turn(guided_run: RunData, robot: RobotModel) -> None:
    around = surroundings(robot)
    for k in range(51):
        truth = note(around, guided_run, k)
    state = around.state(guided_run.telemetry[50], truth)
    assert state["leader"] is guided_run.truth[50].leader
    assert state["turned"] == pytest.approx([2.0 * 1.0, 2.5 * 1.0])
    # A new run begins anew.
    note(around, guided_run, 0)
    assert around.state(guided_run.telemetry[0], guided_run.truth[0])["turned"] == pytest.approx([0.0, 0.0])


def test_goals_come_from_the_robots_own_account(guided_run: RunData, robot: RobotModel) -> None:
    around = surroundings(robot, leader="")
    state = around.state(guided_run.telemetry[250], None)
    report = guided_run.telemetry[250].navigation
    assert report is not None
    assert state["marker"] == pytest.approx(report.marker_position)
    assert state["waypoints"].tolist() == [[1.0, 0.5]]
    assert state["reached"] == 1
    assert state["guided"] == "marker"
    assert "leader" not in state
    early = around.state(guided_run.telemetry[60], None)
    assert "marker" not in early
    assert around.state(guided_run.telemetry[0], None) == {}


def test_a_steered_leader_shows_its_wheels_turned(guided_run: RunData, robot: RobotModel) -> None:
    time = np.linspace(0.0, 4.0, 41)
    angle = 0.2 * time
    pose = np.column_stack(
        [
            0.5 * np.sin(angle),
            0.5 * (1 - np.cos(angle)),
            0 * time,
            0 * time,
            0 * time,
            np.sin(angle / 2),
            np.cos(angle / 2),
        ]
    )
    tricycle = READY["tricycle"]()
    steering = wheel_steering(tricycle, pose, time)
    wheel = tricycle.wheels[2]
    assert steering[20, 2] == pytest.approx(np.arctan2(wheel.length, 0.5), abs=0.01)
    resting = wheel_steering(tricycle, np.concatenate([pose, pose[-1:].repeat(9, 0)]), np.arange(50) * 0.1)
    assert resting[-1] == pytest.approx(resting[40], abs=0.05)
    around = surroundings(robot, "tricycle")
    for k in range(0, 200, 2):
        sample = dataclasses.replace(guided_run.truth[k], leader_wheels=np.zeros(3))
        around.note(guided_run.telemetry[k], sample, None)
        state = around.state(guided_run.telemetry[k], sample)
    assert state["steered"][2] == pytest.approx(np.arctan2(wheel.length, made.RADIUS), abs=0.03)


def test_every_leader_can_be_drawn(robot: RobotModel) -> None:
    for kind in READY:
        page = read_page(live_page(robot, Stage(plan=made.room(), leader=kind)))
        data = json.loads(page.texts["run-data"])
        paths = {command["path"] for command in data["surroundings"]}
        wheels = {f"/meshcat/leader/wheels/wheel{k}/shapes" for k in range(len(READY[kind]().wheels))}
        assert wheels | {"/meshcat/leader/frame/shapes", "/meshcat/world/things"} <= paths


def test_sweeps_that_cannot_be_drawn_are_left_out(guided_run: RunData, robot: RobotModel) -> None:
    around = surroundings(robot)
    lidar = guided_run.frames[0].lidar
    assert lidar is not None
    for bad in (
        dataclasses.replace(lidar, valid=False),
        dataclasses.replace(lidar, distance=lidar.distance[:-1]),
        dataclasses.replace(lidar, bearing=np.zeros(0), distance=np.zeros(0)),
    ):
        around.note(guided_run.telemetry[0], guided_run.truth[0], bad)
        assert "sweep" not in around.state(guided_run.telemetry[0], guided_run.truth[0])
    nothing = dataclasses.replace(lidar, distance=np.full_like(lidar.distance, np.nan))
    around.note(guided_run.telemetry[0], guided_run.truth[0], nothing)
    assert around.state(guided_run.telemetry[0], guided_run.truth[0])["sweep"] == []
