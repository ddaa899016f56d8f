"""What the live view is told of rough ground."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz.live import live_page
from bluefoot_mpc.viz.live_ground import AGAIN, LiveGround
from bluefoot_mpc.viz.stage import Stage

from . import crossing_run as made
from .crossing_run import crossing_run
from .html_check import read_page
from .test_crossing import whole


@pytest.fixture(scope="module")
def rough_run(robot: RobotModel) -> RunData:
    return crossing_run(robot, duration=3.6)


def told(run: RunData) -> list[dict[str, Any]]:
    live = LiveGround(made.RADIUS)
    found = []
    for record in run.telemetry:
        live.note(record)
        found.append(live.state(record))
    return found


def test_map_and_way_are_told_when_new_and_again(rough_run: RunData) -> None:
    states = told(rough_run)
    ticks = [k for k, state in enumerate(states) if "map" in state]
    new = next(
        k
        for k, t in enumerate(rough_run.telemetry)
        if t.crossing is not None and t.crossing.ground is not None
    )
    assert ticks == pytest.approx([new, new + round(AGAIN / rough_run.period)], abs=1)
    report = rough_run.telemetry[new].crossing
    assert report is not None
    assert report.ground is not None
    height = report.ground.height
    shown = whole(states[new]["map"]["heights"]).reshape(height.shape)
    # Counted from the ground at the start, on which the page's robot stands.
    assert shown[np.isfinite(height)] == pytest.approx(1e3 * height[np.isfinite(height)], abs=0.51)
    assert (shown == -32768).sum() == np.isnan(height).sum()
    assert np.reshape(states[new]["route"], (-1, 3))[:, :2] == pytest.approx(report.route[:, :2], abs=1e-3)
    json.dumps(states[new]["map"])


def test_every_tick_tells_phase_and_next_footholds(rough_run: RunData) -> None:
    states = told(rough_run)
    assert states[0] == {}
    assert states[round(made.BEGIN / rough_run.period) + 1]["phase"] == "sweep"
    record = rough_run.telemetry[150]
    assert record.crossing is not None
    for aim, wanted in zip(states[150]["aims"], record.crossing.footholds, strict=True):
        if np.isnan(wanted[0]):
            assert aim is None
        else:
            assert aim == pytest.approx(wanted + np.array([0, 0, made.RADIUS]))
    assert any(aim is not None for aim in states[150]["aims"])


def test_a_new_run_begins_anew(rough_run: RunData) -> None:
    live = LiveGround(made.RADIUS)
    for record in rough_run.telemetry:
        live.note(record)
        live.state(record)
    # Time jumps back: what is known is told at once.
    assert "map" in live.state(rough_run.telemetry[60])


def test_the_page_is_ready_for_rough_ground(robot: RobotModel) -> None:
    plan = made.rubble("stones")
    page = read_page(live_page(robot, Stage(plan=plan)))
    data = json.loads(page.texts["run-data"])
    assert data["rough"] == {"floor": plan.floor, "below": robot.parameters.legs.foot_radius}
    assert len(data["terrain"]["scale"]) > 2
    level = json.loads(read_page(live_page(robot)).texts["run-data"])
    assert "rough" not in level
