from __future__ import annotations

import dataclasses
import json

import numpy as np
import plotly.graph_objects as go
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import LevelReport
from bluefoot_mpc.viz import plots_level
from bluefoot_mpc.viz.level_series import extract_leveling
from bluefoot_mpc.viz.report import report_html
from bluefoot_mpc.viz.series import extract

from .html_check import read_page
from .synthetic_run import make_run, make_summary

FIRST = 10
"""Tick of the first report."""
ALWAYS = {"level-attitude", "level-disturbance", "level-forces"}


def leveled(run: RunData, *, network: bool = True, stopped: int | None = None) -> RunData:
    """The run with levelling that acts from 3 s on, and predicts what comes true but for 1 rad/s²."""
    telemetry = []
    for k, t in enumerate(run.telemetry):
        ahead = np.array([np.sin(0.3 * (k + 1)), np.cos(0.3 * (k + 1)), 0.1 * (k + 1)])
        force = np.zeros((4, 3))
        force[:, 2] = 2.0 if not run.truth else run.truth[k].foot_force[:, 2] + 2.0
        report = LevelReport(
            share=float(t.time >= 3.0),
            training=network and t.time < 3.0,
            stopped="the trunk tilts" if stopped is not None and k >= stopped else "",
            disturbance=ahead + np.array([0.0, 0.0, 1.0]) if network else np.zeros(3),
            measured=np.array([np.sin(0.3 * k), np.cos(0.3 * k), 0.1 * k]),
            torque=np.zeros(16),
            contact_force=force,
            mse=0.5 + 0.001 * k if network else np.nan,
            rate=0.01 if network else np.nan,
        )
        telemetry.append(dataclasses.replace(t, level=report if k >= FIRST else None))
    return dataclasses.replace(run, telemetry=telemetry)


def series_of(run: RunData):
    series = extract(run, 1.5)
    level = extract_leveling(run, series)
    assert level is not None
    return series, level


def window(kind: str, start: float, **more: float) -> dict[str, object]:
    span = {"kind": kind, "start_s": start, "end_s": start + 10.0}
    return {**span, "roll_rms_deg": 2.0, "pitch_rms_deg": 1.0, **more}


WINDOWS = [window("off", 4.0), window("on", 14.0, roll_reduction_percent=60.0, pitch_reduction_percent=50.0)]


def figures_of(run: RunData, robot: RobotModel, **figures: object) -> dict[str, dict]:
    page = read_page(report_html(run, make_summary(scenario="level", figures=figures), robot))
    return {key: value for key, value in json.loads(page.texts["figures"]).items() if isinstance(value, dict)}


def test_a_run_without_levelling_has_none(run: RunData, robot: RobotModel) -> None:
    assert extract_leveling(run, extract(run, 1.5)) is None
    empty = RunData()
    assert extract_leveling(empty, extract(empty, 1.5)) is None
    assert not [key for key in figures_of(run, robot) if key.startswith("level")]


def test_series_hold_what_was_reported(run: RunData) -> None:
    series, level = series_of(leveled(run))
    assert np.isnan(level.measured[:FIRST]).all()
    np.testing.assert_array_equal(level.acts, series.time >= 3.0 - 1e-9)
    np.testing.assert_array_equal(level.training[FIRST:], series.time[FIRST:] < 3.0 - 1e-9)
    assert level.has_network
    assert level.predicts
    # A prediction stands beside what came true a tick later.
    np.testing.assert_allclose(level.predicted[FIRST + 1 :, :2], level.measured[FIRST + 1 :, :2])
    np.testing.assert_allclose(level.predicted[FIRST + 1 :, 2] - level.measured[FIRST + 1 :, 2], 1.0)
    np.testing.assert_allclose(level.load[FIRST:] - level.load_truth[FIRST:], 2.0)


@pytest.mark.parametrize(
    ("network", "windows", "keys"),
    [
        (True, WINDOWS, ALWAYS | {"level-windows", "level-learning"}),
        (True, [], ALWAYS | {"level-learning"}),
        (False, WINDOWS, ALWAYS | {"level-windows"}),
    ],
)
def test_only_what_there_is_is_shown(
    run: RunData, robot: RobotModel, network: bool, windows: list, keys: set[str]
) -> None:
    found = figures_of(leveled(run, network=network), robot, windows=windows)
    assert {key for key in found if key.startswith("level")} == keys
    for key in keys:
        text = json.dumps({"data": found[key]["data"], "layout": found[key]["layout"]})
        assert len(go.Figure(json.loads(text.replace('"@ink"', '"#000000"'))).data) > 0


def test_on_windows_are_shaded_and_a_disengagement_is_red(run: RunData) -> None:
    series, level = series_of(leveled(run, stopped=175))
    panel = plots_level.attitude(series, level)
    acts, stopped = panel.layout["shapes"]
    assert (acts["x0"], acts["x1"]) == pytest.approx((3.0, 4.0))
    assert (stopped["x0"], stopped["x1"]) == pytest.approx((3.5, 4.0))
    assert acts["fillcolor"] != stopped["fillcolor"]
    assert "at 3.5 s" in panel.caption


def test_captions_say_what_is_seen(run: RunData) -> None:
    series, level = series_of(leveled(run))
    error = np.degrees(series.rpy_truth[:, 0] - series.rpy_command[:, 0])
    without = np.sqrt(np.mean(error[series.walking & ~level.acts] ** 2))
    assert f"roll {without:.2f}° and" in plots_level.attitude(series, level).caption
    assert "roll 100 %, pitch 100 %" in plots_level.disturbance(series, level).caption
    assert "differ by 2.0 N RMS" in plots_level.contact_forces(series, level).caption
    assert "-60/-50 %" in plots_level.windows(WINDOWS).caption
    series, plain = series_of(leveled(run, network=False))
    assert "Nothing is predicted" in plots_level.disturbance(series, plain).caption
    assert len(plots_level.disturbance(series, plain).data) == 3


def test_hardware_shows_levelling_without_truth(hardware_run: RunData, robot: RobotModel) -> None:
    run = leveled(hardware_run)
    series, level = series_of(run)
    assert "true" not in plots_level.contact_forces(series, level).caption
    assert plots_level.attitude(series, level).data[0]["name"] == "estimate"
    assert "level-attitude" in figures_of(run, robot)


def test_every_window_has_its_figures_in_the_list_of_all(run: RunData, robot: RobotModel) -> None:
    text = report_html(run, make_summary(figures={"windows": WINDOWS}), robot)
    assert "figures.windows.2.roll_reduction_percent" in text


def test_a_minute_of_levelling_stays_under_ten_megabytes(robot: RobotModel) -> None:
    run = leveled(make_run(robot, duration=64.0))
    assert len(report_html(run, make_summary(figures={"windows": WINDOWS}), robot).encode()) < 10e6
