"""One run of a case, reduced to the figures that limits and tables use."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.ground_measure import ground_figures
from bluefoot_mpc.evaluation.level_measure import leveling_figures
from bluefoot_mpc.evaluation.way_measure import way_figures
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.summary import summarize
from bluefoot_mpc.runtime.window import SETTLING, cut_window, measurement_window
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate

PHASE_STEP = 0.235
"""s by which an event (a push, a change of gait) moves from seed to seed.

The golden section of a slow trot's cycle (0.38 s): ten seeds leave no gap wider
than 0.15 of it, nor than 0.19 of a walk's (1.3 s).
"""

PHASE_SPAN = 2.5
"""s, span of the events of a case with directions: some cycles of any gait, no whole number of steps."""
PUSH_TIME = 5.0
"""s of the earliest push."""

Figures = dict[str, float | None]


def measure(case: Case, seed: int) -> Figures:
    """Run one seed of a case and give its figures.

    Args:
        case: what to run.
        seed: which seed; of a case with directions, which run.
    """
    options = run_options(case, seed)
    result = simulate(case.scenario, options)
    summary = _after_the_ramp(result.summary, result.data, case)
    wanted, seen, distance = summary["speed_ref_mps"], summary["speed_mps"], summary["distance_m"]
    moving = bool(wanted) and seen is not None
    roll, pitch = summary["roll_rms_deg"], summary["pitch_rms_deg"]
    return {
        "falls": float(summary["fell"] or summary["stop_reason"] != "completed"),
        "speed_mmps": None if seen is None else 1e3 * seen,
        "speed_error_percent": 100.0 * abs(seen - wanted) / abs(wanted) if moving else None,
        "drift_percent": _share(summary["lateral_drift_m"], distance) if moving else None,
        "yaw_rate_error_percent": _yaw_rate_error(summary["figures"]),
        "clearance_mm": _scaled(summary["swing_clearance_median_m"], 1e3),
        "roll_rms_deg": roll,
        "pitch_rms_deg": pitch,
        "tilt_rms_deg": None if roll is None else math.hypot(roll, pitch),
        "attitude_error_deg": summary["attitude_error_rms_deg"],
        **attitude_errors(result.data, summary["figures"]["window_s"]),
        "odometry_error_percent": odometry_error(result.data) if moving else None,
        "torque_peak_nm": summary["torque_peak_nm"],
        "zmp_inside_percent": _scaled(summary["zmp_inside_fraction"], 100.0),
        "plan_margin_mm": _scaled(summary["zmp_plan_margin_min_m"], 1e3),
        "qp_failures": summary["qp_failures"],
        "deadline_misses": summary["deadline_misses"],
        "tick_us": (summary["tick_us"] or {}).get("p50"),
        "cost_of_transport": summary["cost_of_transport"],
        **_lags(summary["figures"]),
        **way_figures(summary["figures"]),
        **ground_figures(summary),
        **leveling_figures(summary["figures"]),
    }


def run_options(case: Case, seed: int) -> RunOptions:
    """The options of one run of a case: its seed, its direction, and when in the cycle its event comes.

    Args:
        case: what to run.
        seed: which seed; of a case with directions, which run.
    """
    if not case.directions:
        return _on_another_phase(case, RunOptions(**case.options, seed=seed), PHASE_STEP * seed)
    robot, direction = divmod(seed, case.directions)
    options = RunOptions(**case.options, seed=robot, direction=360.0 * direction / case.directions)
    # So many runs would push the event ever later: what counts is the part of the cycle.
    return _on_another_phase(case, options, PHASE_STEP * seed % PHASE_SPAN)


def attitude_errors(data: RunData, window: tuple[float, float] | None) -> Figures:
    """Errors of the estimated roll and pitch, degrees: the greater of the two means, and the RMS of each.

    Args:
        data: the run.
        window: s, start and end of what counts; None where nothing does.
    """
    cut = None if window is None else cut_window(data, *window)
    if cut is None:
        return {"attitude_bias_deg": None, "roll_error_deg": None, "pitch_error_deg": None}
    error = np.degrees(metrics.roll_pitch(cut.estimated_quaternion) - metrics.roll_pitch(cut.quaternion))
    roll, pitch = np.sqrt(np.mean(np.square(error), axis=0)).tolist()
    bias = float(np.abs(error.mean(axis=0)).max())
    return {"attitude_bias_deg": bias, "roll_error_deg": roll, "pitch_error_deg": pitch}


def odometry_error(data: RunData) -> float | None:
    """Error of the mean estimated speed against the mean true speed over the window, percent.

    Speeds are those of the trunk's origin along and across the trunk, so that a
    circle counts like a straight line.
    """
    start, end = measurement_window(data)
    time = data.stack("telemetry", "time")
    inside = (time >= start) & (time <= end)
    if not inside.any() or len(data.truth) != len(data.telemetry):
        return None
    estimate = data.stack("telemetry", "estimate.linear_velocity")[inside, :2].mean(axis=0)
    truth = data.stack("truth", "v")[inside, :2].mean(axis=0)
    speed = float(np.hypot(*truth))
    return 100.0 * abs(float(np.hypot(*estimate)) - speed) / speed if speed > 0.0 else None


def _after_the_ramp(summary: dict[str, Any], data: RunData, case: Case) -> dict[str, Any]:
    """The summary, measured from where the robot has been given the time to get up to its speed.

    A command takes force at a limited acceleration. Where that takes longer than
    the measurement window waits, the window would begin while the robot speeds up.
    """
    speed = math.hypot(case.options.get("speed") or 0.0, case.options.get("lateral_speed") or 0.0)
    if case.scenario != "walk" or summary["figures"]["window_s"] is None:
        return summary
    ramp = speed / data.config["control"]["gait"]["max_acceleration"]
    if ramp <= SETTLING:
        return summary
    start, end = summary["figures"]["window_s"]
    return summarize(data, window=(start + ramp, end))


def _on_another_phase(case: Case, options: RunOptions, shift: float) -> RunOptions:
    if case.scenario == "push" and options.duration is not None:
        return replace(options, push_time=PUSH_TIME + shift, duration=options.duration + shift)
    if case.scenario == "transition" and options.duration is not None:
        # Gaits change after a third and two thirds of the walking time.
        return replace(options, duration=options.duration + 3.0 * shift)
    return options


def _yaw_rate_error(figures: dict[str, Any]) -> float | None:
    wanted, seen = figures.get("yaw_rate_ref_radps"), figures.get("yaw_rate_radps")
    return None if not wanted or seen is None else 100.0 * abs(seen - wanted) / abs(wanted)


def _lags(figures: dict[str, Any]) -> Figures:
    lags = figures.get("lift_off_lags") or [None] * 4
    return {f"lag_{leg}": lag for leg, lag in zip(("FL", "FR", "RL", "RR"), lags, strict=True)}


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _share(part: float | None, whole: float | None) -> float | None:
    return None if part is None or not whole else 100.0 * abs(part) / abs(whole)
