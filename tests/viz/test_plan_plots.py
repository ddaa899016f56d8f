from __future__ import annotations

import dataclasses
import json

import numpy as np
import plotly.graph_objects as go
import pytest

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import Fallback, PlanReport
from bluefoot_mpc.viz import plots_plan
from bluefoot_mpc.viz.plan_series import extract_plans
from bluefoot_mpc.viz.report import report_html
from bluefoot_mpc.viz.series import extract

from .html_check import read_page
from .synthetic_run import make_run, make_summary

FIRST = 20
"""Tick of the first plan."""
FORCES = {"forces", "planned-torques"}


def planned(run: RunData, *, motion: bool = True, forces: bool = True) -> RunData:
    """The run with plans: as heavy as true, and the centre of mass 3 mm left of b'; two bad ticks."""
    telemetry = []
    for k, t in enumerate(run.telemetry):
        load = np.zeros((4, 3))
        load[:, 2] = np.where(t.phase.swing, 0.0, 5.0) + 0.01 * k
        report = PlanReport(
            com=np.array([[0.0, 0.003], [0.0, 0.0], [0.0, 0.0]]) if motion else np.full((3, 2), np.nan),
            margin=0.01 if motion else np.nan,
            foot_force=load if forces else np.full((4, 3), np.nan),
            torque=np.linspace(-1.0, 1.0, 16) if forces else np.full(16, np.nan),
            whole_body=Fallback.NEAREST if k in {50, 51} else Fallback.SOLVED,
            qp_failures=int(k in {50, 51}),
        )
        plan = report if k >= FIRST else None
        telemetry.append(dataclasses.replace(t, plan=plan, deadline_misses=k // 100))
    return dataclasses.replace(run, telemetry=telemetry)


def figures_of(run: RunData, robot: RobotModel) -> dict[str, dict]:
    page = read_page(report_html(run, make_summary(controller="mpc"), robot))
    return {key: value for key, value in json.loads(page.texts["figures"]).items() if isinstance(value, dict)}


def test_a_run_without_plans_has_none(run: RunData) -> None:
    assert extract_plans(run, extract(run, 1.5)) is None
    empty = RunData()
    assert extract_plans(empty, extract(empty, 1.5)) is None


def test_series_hold_what_was_planned(run: RunData) -> None:
    with_plans = planned(run)
    series = extract(with_plans, 1.5)
    plans = extract_plans(with_plans, series)
    assert plans is not None
    assert plans.has_forces
    assert plans.has_motion
    assert np.isnan(plans.load[:FIRST]).all()
    np.testing.assert_array_equal(
        plans.load[FIRST:, 1], [t.plan.foot_force[1, 2] for t in with_plans.telemetry[FIRST:]]
    )
    np.testing.assert_array_equal(plans.load_truth[:, 2], [t.foot_force[2, 2] for t in run.truth])
    np.testing.assert_array_equal(plans.torque[-1], np.linspace(-1.0, 1.0, 16))
    np.testing.assert_array_equal(plans.whole_body[[FIRST, 50, 51, 52]], [0.0, 1.0, 1.0, 0.0])
    assert np.isnan(plans.whole_body[:FIRST]).all()
    np.testing.assert_array_equal(plans.failures[[0, 49, 50, 51, -1]], [0.0, 0.0, 1.0, 2.0, 2.0])
    np.testing.assert_array_equal(plans.late, [k // 100 for k in range(len(series.time))])


def test_the_planned_centre_of_mass_lies_where_the_feet_say(run: RunData) -> None:
    with_plans = planned(run)
    series = extract(with_plans, 1.5)
    plans = extract_plans(with_plans, series)
    assert plans is not None
    # The synthetic b' goes with the trunk's way, its heading with the trunk's.
    middle = series.feet[FIRST:, :, :2].mean(axis=1)
    standing = ~series.walking[FIRST:]
    np.testing.assert_allclose(
        (plans.com[FIRST:] - middle)[standing], [[0.0, 0.003]] * standing.sum(), atol=2e-4
    )
    assert plans.com[-1, 0] == pytest.approx(series.q[-1, 0], abs=0.004)


@pytest.mark.parametrize(
    ("motion", "forces", "keys"),
    [
        (True, True, FORCES | {"planned-path", "solving"}),
        (False, True, FORCES | {"solving"}),
        (True, False, {"planned-path", "solving"}),
    ],
)
def test_only_what_was_planned_is_shown(
    run: RunData, robot: RobotModel, motion: bool, forces: bool, keys: set[str]
) -> None:
    plain = set(figures_of(run, robot))
    assert set(figures_of(planned(run, motion=motion, forces=forces), robot)) - plain == keys


def test_every_figure_of_the_plans_is_valid_plotly(run: RunData, robot: RobotModel) -> None:
    found = figures_of(planned(run), robot)
    for key in FORCES | {"planned-path", "solving"}:
        text = json.dumps({"data": found[key]["data"], "layout": found[key]["layout"]})
        assert len(go.Figure(json.loads(text.replace('"@ink"', '"#000000"'))).data) > 1


def test_hardware_shows_plans_without_truth(hardware_run: RunData, robot: RobotModel) -> None:
    run = planned(hardware_run)
    series = extract(run, 1.5)
    plans = extract_plans(run, series)
    assert plans is not None
    forces = plots_plan.forces(series, plans)
    assert len(forces.data) == 4
    assert "true" not in forces.caption
    assert "load that the servos report" in plots_plan.planned_torques(series, plans).caption
    assert "planned-path" in figures_of(run, robot)


def test_captions_say_how_far_off_plans_were(run: RunData) -> None:
    with_plans = planned(run)
    series = extract(with_plans, 1.5)
    plans = extract_plans(with_plans, series)
    assert plans is not None
    error = np.sqrt(np.mean((plans.load - plans.load_truth)[FIRST:] ** 2))
    assert f"{error:.1f} N RMS" in plots_plan.forces(series, plans).caption


def test_sixty_seconds_with_plans_stay_under_ten_megabytes(robot: RobotModel) -> None:
    run = planned(make_run(robot, duration=60.0))
    assert len(report_html(run, make_summary(), robot).encode()) < 10e6
