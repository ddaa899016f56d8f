from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import plotly.graph_objects as go
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.viz.report import report_html, write_report

from .html_check import read_page
from .synthetic_run import make_run, make_summary

PANELS = {"footfall", "attitude", "path", "balance", "motion", "torques", "load", "temperatures", "ticks"}
SECTIONS = PANELS | {"key-figures", "replay", "events", "configuration"}
CHECKS = [{"name": "stays on its feet", "holds": True, "detail": "yes"}]


@pytest.fixture(scope="module")
def html(run: RunData, robot: RobotModel) -> str:
    return report_html(run, make_summary(), robot, CHECKS)


def test_report_is_well_formed_and_loads_nothing(html: str) -> None:
    page = read_page(html)
    assert set(page.ids) >= SECTIONS
    assert "connect-src" not in page.policy


def test_every_figure_is_valid_plotly(html: str) -> None:
    figures = json.loads(read_page(html).texts["figures"])
    panels = {key: value for key, value in figures.items() if isinstance(value, dict)}
    assert set(panels) == PANELS
    for panel in panels.values():
        # "@ink" and the like are the page's own colours.
        text = json.dumps({"data": panel["data"], "layout": panel["layout"]}).replace('"@ink"', '"#000000"')
        figure = go.Figure(json.loads(text))
        assert len(figure.data) > 0


def test_replay_data_has_every_tick_and_body(html: str, run: RunData) -> None:
    data = json.loads(read_page(html).texts["run-data"])
    assert len(data["nodes"]) == 17
    assert data["q"]["shape"] == f"{len(run.telemetry)}, 23"
    assert data["push"] is not None


def test_report_says_what_happened(html: str) -> None:
    assert "The robot walked 3.48 m at 60 mm/s" in html
    assert "stays on its feet" in html
    assert "mode stand -&gt; walk" in html
    assert "push of 20.0 N for 0.10 s, 2.00 N·s" in html
    assert "FL knee cut at -90.0 deg, 0.4 deg beyond its limit (for 0.06 s, 4 ticks)" in html
    assert "gain = 3.0" in html


def test_one_copy_of_plotly_and_a_bounded_size(html: str) -> None:
    assert html.count("plotly.js v") == 1
    assert len(html.encode()) < 8e6


def test_hardware_run_needs_no_truth(hardware_run: RunData, robot: RobotModel, tmp_path: Path) -> None:
    summary = make_summary(
        robot="hardware", roll_rms_deg=None, pitch_rms_deg=None, speed_mps=None, distance_m=None
    )
    write_report(hardware_run, summary, robot, tmp_path / "report.html")
    text = (tmp_path / "report.html").read_text(encoding="utf-8")
    page = read_page(text)
    assert set(page.ids) >= SECTIONS
    names = {trace.get("name") for trace in json.loads(page.texts["figures"])["attitude"]["data"]}
    assert names == {"estimate", "commanded"}


def test_fall_and_its_reason_stand_on_top(run: RunData, robot: RobotModel) -> None:
    summary = make_summary(
        fell=True, success=False, stop_reason="stopped at 2.10 s: tilt 51 deg", duration_s=3.1
    )
    text = report_html(run, summary, robot)
    assert "The robot fell at 2.10 s" in text
    assert "Stopped at 2.10 s: tilt 51 deg." in text


def test_run_without_a_tick_still_gives_a_page(robot: RobotModel) -> None:
    summary = dict.fromkeys(make_summary()) | {
        "stop_reason": "controller error",
        "fell": False,
        "success": False,
    }
    page = read_page(report_html(RunData(), summary, robot))
    assert {"key-figures", "events", "configuration"} <= set(page.ids)


def test_text_of_a_run_cannot_break_the_page(run: RunData, robot: RobotModel) -> None:
    nasty = "</script><script>alert(1)</script><!--"
    telemetry = [*run.telemetry[:-1], dataclasses.replace(run.telemetry[-1], events=(nasty,))]
    hostile = dataclasses.replace(run, telemetry=telemetry, config={"run": {"scenario": nasty}})
    page = read_page(report_html(hostile, make_summary(scenario=nasty), robot))
    assert page.ids.count("events") == 1


def test_sixty_seconds_stay_under_ten_megabytes(robot: RobotModel) -> None:
    run = make_run(robot, duration=60.0)
    assert len(report_html(run, make_summary(), robot).encode()) < 10e6
