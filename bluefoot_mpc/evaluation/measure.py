"""One run of a case, reduced to the figures that limits and tables use."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.window import measurement_window
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate

PHASE_STEP = 0.235
"""s by which an event (a push, a change of gait) moves from seed to seed.

The golden section of a slow trot's cycle (0.38 s): ten seeds leave no gap wider
than 0.15 of it, nor than 0.19 of a walk's (1.3 s).
"""

Figures = dict[str, float | None]


def measure(case: Case, seed: int) -> Figures:
    """Run one seed of a case and give its figures.

    Args:
        case: what to run.
        seed: which seed.
    """
    options = RunOptions(**case.options, seed=seed)
    result = simulate(case.scenario, _on_another_phase(case, options, seed))
    summary = result.summary
    wanted, seen, distance = summary["speed_ref_mps"], summary["speed_mps"], summary["distance_m"]
    moving = bool(wanted) and seen is not None
    return {
        "falls": float(summary["fell"] or summary["stop_reason"] != "completed"),
        "speed_mmps": None if seen is None else 1e3 * seen,
        "speed_error_percent": 100.0 * abs(seen - wanted) / abs(wanted) if moving else None,
        "drift_percent": _share(summary["lateral_drift_m"], distance) if moving else None,
        "clearance_mm": _scaled(summary["swing_clearance_median_m"], 1e3),
        "roll_rms_deg": summary["roll_rms_deg"],
        "pitch_rms_deg": summary["pitch_rms_deg"],
        "attitude_error_deg": summary["attitude_error_rms_deg"],
        "odometry_error_percent": odometry_error(result.data) if moving else None,
        "torque_peak_nm": summary["torque_peak_nm"],
        "zmp_inside_percent": _scaled(summary["zmp_inside_fraction"], 100.0),
        "cost_of_transport": summary["cost_of_transport"],
        **_lags(summary["figures"]),
    }


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


def _on_another_phase(case: Case, options: RunOptions, seed: int) -> RunOptions:
    shift = PHASE_STEP * seed
    if case.scenario == "push" and options.duration is not None:
        return replace(options, push_time=5.0 + shift, duration=options.duration + shift)
    if case.scenario == "transition" and options.duration is not None:
        # Gaits change after a third and two thirds of the walking time.
        return replace(options, duration=options.duration + 3.0 * shift)
    return options


def _lags(figures: dict[str, Any]) -> Figures:
    lags = figures.get("lift_off_lags") or [None] * 4
    return {f"lag_{leg}": lag for leg, lag in zip(("FL", "FR", "RL", "RR"), lags, strict=True)}


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value


def _share(part: float | None, whole: float | None) -> float | None:
    return None if part is None or not whole else 100.0 * abs(part) / abs(whole)
