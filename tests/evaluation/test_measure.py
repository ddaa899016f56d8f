from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bluefoot_mpc.evaluation import measure as measure_module
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.measure import (
    PHASE_SPAN,
    PHASE_STEP,
    attitude_errors,
    measure,
    odometry_error,
    run_options,
)
from bluefoot_mpc.types import LEGS
from tests.runtime.made_up_run import make_run

SUMMARY = {
    "fell": False, "stop_reason": "completed", "speed_ref_mps": -0.05, "speed_mps": -0.04, "distance_m": -2.0,
    "lateral_drift_m": 0.1, "swing_clearance_median_m": 0.011, "roll_rms_deg": 0.2, "pitch_rms_deg": 0.3,
    "attitude_error_rms_deg": 0.1, "torque_peak_nm": 1.0, "zmp_inside_fraction": 0.5,
    "cost_of_transport": 3.0, "zmp_plan_margin_min_m": 0.006, "qp_failures": 0, "deadline_misses": 1,
    "tick_us": {"p50": 300.0}, "figures": {"window_s": None, "lift_off_lags": [0.0, 0.5, 0.5, 0.0]},
}  # fmt: skip


@pytest.fixture
def asked(monkeypatch):
    """What `measure` asks to be simulated, answered by a made-up summary."""
    seen = {"summary": dict(SUMMARY)}

    def simulate(scenario, options):
        seen.update(scenario=scenario, options=options)
        return SimpleNamespace(summary=seen["summary"], data=None)

    monkeypatch.setattr(measure_module, "simulate", simulate)
    monkeypatch.setattr(measure_module, "odometry_error", lambda data: 1.5)
    return seen


def test_figures_have_the_units_of_their_names(asked):
    figures = measure(Case(name="x", scenario="walk", options={"speed": -0.05}), 3)
    assert asked["scenario"] == "walk"
    assert asked["options"].seed == 3
    assert asked["options"].speed == -0.05
    assert figures["falls"] == 0.0
    assert figures["speed_mmps"] == pytest.approx(-40.0)
    assert figures["speed_error_percent"] == pytest.approx(20.0)
    assert figures["drift_percent"] == pytest.approx(5.0)
    assert figures["clearance_mm"] == pytest.approx(11.0)
    assert figures["zmp_inside_percent"] == pytest.approx(50.0)
    assert [figures[f"lag_{leg}"] for leg in LEGS] == [0.0, 0.5, 0.5, 0.0]


@pytest.mark.parametrize("changes", [{"fell": True}, {"stop_reason": "stopped at 3.00 s: hot"}])
def test_whatever_ends_a_run_early_counts_as_a_fall(asked, changes):
    asked["summary"].update(changes)
    assert measure(Case(name="x", scenario="walk"), 0)["falls"] == 1.0


def test_what_a_run_does_not_have_stays_unknown(asked):
    asked["summary"].update(
        speed_ref_mps=0.0, speed_mps=None, distance_m=None, lateral_drift_m=None,
        swing_clearance_median_m=None, zmp_inside_fraction=None, zmp_plan_margin_min_m=None,
        tick_us=None, figures={"window_s": None},
    )  # fmt: skip
    figures = measure(Case(name="x", scenario="stand"), 0)
    unknown = ("speed_mmps", "speed_error_percent", "drift_percent", "clearance_mm", "zmp_inside_percent")
    for name in (*unknown, "odometry_error_percent", "lag_FL"):
        assert figures[name] is None


def test_events_meet_another_phase_with_each_seed(asked):
    times = []
    for seed in range(3):
        measure(Case(name="x", scenario="push", options={"duration": 10.0}), seed)
        options = asked["options"]
        times.append(options.push_time)
        assert options.duration - options.push_time == pytest.approx(5.0)
    np.testing.assert_allclose(np.diff(times), PHASE_STEP)
    measure(Case(name="x", scenario="transition", options={"duration": 30.0}), 2)
    # A third of the time more moves both changes of gait by one step and by two.
    assert asked["options"].duration == pytest.approx(30.0 + 3.0 * 2 * PHASE_STEP)
    measure(Case(name="x", scenario="walk", options={"duration": 10.0}), 2)
    assert asked["options"].duration == 10.0


def test_odometry_is_judged_by_mean_speeds_over_the_window():
    run = make_run(400)
    for k, telemetry in enumerate(run.telemetry):
        estimate = replace(telemetry.estimate, linear_velocity=np.array([0.0, 0.033, 9.0]))
        run.telemetry[k] = replace(telemetry, estimate=estimate)
        speed = 0.03 + (0.01 if k % 2 else -0.01)
        run.truth[k] = replace(run.truth[k], v=np.concatenate([[speed, 0.0, 5.0], np.zeros(19)]))
    assert odometry_error(run) == pytest.approx(10.0, abs=1.0)
    run.truth.clear()
    assert odometry_error(run) is None


def test_a_case_with_directions_turns_before_it_takes_the_next_robot():
    case = Case(name="x", scenario="push", options={"duration": 10.0}, directions=12)
    runs = [run_options(case, k) for k in range(24)]
    assert [run.seed for run in runs] == [0] * 12 + [1] * 12
    assert [run.direction for run in runs[:12]] == [30.0 * k for k in range(12)]
    assert len({run.push_time for run in runs}) == 24
    latest = max(run_options(case, k).push_time for k in range(240))
    assert latest < 5.0 + PHASE_SPAN


def test_a_ramp_longer_than_the_settling_is_not_measured(asked, monkeypatch):
    asked["summary"]["figures"] = {"window_s": [3.5, 30.0]}
    data = SimpleNamespace(config={"control": {"gait": {"max_acceleration": 0.1}}})
    windows = []

    def simulate(scenario, options):
        return SimpleNamespace(summary=asked["summary"], data=data)

    def summarize(run, window):
        windows.append(window)
        return {**asked["summary"], "figures": {"window_s": window}}

    monkeypatch.setattr(measure_module, "simulate", simulate)
    monkeypatch.setattr(measure_module, "summarize", summarize)
    monkeypatch.setattr(measure_module, "attitude_errors", lambda run, window: {})
    measure(Case(name="x", scenario="walk", options={"speed": 0.2}), 0)
    assert windows == []
    measure(Case(name="x", scenario="walk", options={"speed": 0.4}), 0)
    assert windows == [(7.5, 30.0)]


def test_the_estimate_is_judged_axis_by_axis():
    run = make_run(400)
    window = (run.truth[100].time, run.truth[-1].time)
    tilted = rotation_quaternion(roll=np.radians(0.3), pitch=np.radians(-0.1))
    for k, telemetry in enumerate(run.telemetry):
        run.truth[k] = replace(run.truth[k], q=np.concatenate([np.zeros(3), [0, 0, 0, 1], np.zeros(16)]))
        run.telemetry[k] = replace(telemetry, estimate=replace(telemetry.estimate, quaternion=tilted))
    errors = attitude_errors(run, window)
    assert errors["attitude_bias_deg"] == pytest.approx(0.3, abs=1e-3)
    assert errors["roll_error_deg"] == pytest.approx(0.3, abs=1e-3)
    assert errors["pitch_error_deg"] == pytest.approx(0.1, abs=1e-3)
    assert attitude_errors(run, None)["attitude_bias_deg"] is None


def rotation_quaternion(roll, pitch):
    """Small angles: x, y, z, w."""
    quaternion = np.array([0.5 * roll, 0.5 * pitch, 0.0, 1.0])
    return quaternion / np.linalg.norm(quaternion)


@pytest.mark.parametrize(("cycle", "gap"), [(0.38, 0.15), (1.3, 0.19)])
def test_ten_seeds_meet_every_part_of_the_cycle(cycle, gap):
    phases = np.sort(PHASE_STEP * np.arange(10) / cycle % 1.0)
    gaps = np.diff(np.append(phases, phases[0] + 1.0))
    assert gaps.max() <= gap
