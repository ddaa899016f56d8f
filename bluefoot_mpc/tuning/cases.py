"""What gaits are tuned for: scenarios with the bars that they have to reach."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.summary import summarize
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import RunResult, simulate
from bluefoot_mpc.tuning.objective import Bars, Figures

STAND = 1.0
"""s of standing before the first step."""
ACCELERATION = 0.1
"""m/s², slowest ramp of the commanded speed."""
SETTLING = 1.0
"""s after the ramp before measuring starts."""
MEASURED = 5.0
"""s that are measured at least."""
CUT = "passes its limit"
"""What an event says of a joint goal that was cut (`LimitViolation.describe`)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class TuningCase:
    """One condition that a set of parameters is judged on.

    Attributes:
        name: what it is called.
        scenario: the scenario's name.
        options: keyword arguments of `RunOptions`, without seed, controller and overrides.
        bars: what is asked.
        start: s from which figures count.
        weight: share in the cost of a list of cases.
    """

    name: str
    scenario: str
    options: Mapping[str, Any]
    bars: Bars
    start: float
    weight: float = 1.0


def trot_bars(speed: float) -> Bars:
    """What a trot is asked at a speed (m/s): the bars of the nearest stated speed at or above it."""
    for top, bars in _TROT_BARS.items():
        if speed <= top + 1e-9:
            return bars
    raise ConfigurationError(f"speed = {speed!r} m/s: a trot has bars up to {max(_TROT_BARS):g} m/s")


_TROT_BARS = {
    0.10: Bars(roll=0.25, pitch=0.25, worst=0.5, speed_tolerance=8.0),
    0.20: Bars(roll=0.35, pitch=0.45, worst=0.8, clearance=8.0, speed_tolerance=6.0),
    0.30: Bars(roll=0.6, pitch=0.8, worst=1.5, clearance=6.0, speed_tolerance=6.0),
    0.50: Bars(roll=1.0, pitch=1.3, worst=2.2, clearance=6.0, speed_tolerance=8.0),
}
_WALK_BARS = Bars(roll=0.6, pitch=0.5, worst=1.2)


def walking_case(gait: str, speed: float, *, lateral_speed: float = 0.0, yaw_rate: float = 0.0) -> TuningCase:
    """Walking at a constant command with a randomised robot.

    Args:
        gait: trot or walk.
        speed: m/s forward.
        lateral_speed: m/s left.
        yaw_rate: rad/s left.
    """
    fastest = max(abs(speed), abs(lateral_speed))
    start = STAND + fastest / ACCELERATION + SETTLING
    parts = [f"{gait} {1e3 * speed:.0f} mm/s"]
    parts += [f"sideways {1e3 * lateral_speed:.0f} mm/s"] if lateral_speed else []
    parts += [f"turning {yaw_rate:g} rad/s"] if yaw_rate else []
    return TuningCase(
        name=", ".join(parts),
        scenario="walk",
        options={
            "gait": gait, "speed": speed, "lateral_speed": lateral_speed, "yaw_rate": yaw_rate,
            "duration": start + MEASURED, "randomize": "standard",
            "overrides": (f"scenario.stand_time={STAND}",),
        },
        bars=trot_bars(fastest) if gait == "trot" else _WALK_BARS,
        start=start,
    )  # fmt: skip


def measure(case: TuningCase, controller: str, overrides: tuple[str, ...], seed: int) -> Figures:
    """Run one seed of a case in memory and reduce it to the figures that the cost uses.

    A posture that the legs cannot reach counts as a fall.

    Args:
        case: what to run.
        controller: the controller's name.
        overrides: settings of the point.
        seed: draws robot and noise.

    Raises:
        ConfigurationError: a setting is unknown or beyond its limits.
    """
    given = {**case.options, "overrides": (*case.options.get("overrides", ()), *overrides)}
    options = RunOptions(**given, seed=seed, controller=controller)
    resolve(find_scenario(case.scenario), options)
    try:
        result = simulate(case.scenario, options)
    except ConfigurationError:
        return Figures.of_fall()
    return figures_of(result, case.start)


def figures_of(result: RunResult, start: float) -> Figures:
    """Figures of a run from `start` (s) to its end."""
    data = result.data
    end = data.telemetry[-1].time if data.telemetry else 0.0
    summary = summarize(data, window=(start, end))
    wanted, seen = summary["speed_ref_mps"], summary["speed_mps"]
    if seen is None or summary["roll_rms_deg"] is None:
        return Figures.of_fall()
    distance, drift = summary["distance_m"], summary["lateral_drift_m"]
    ticks = [telemetry for telemetry in data.telemetry if telemetry.time >= start]
    cuts = sum(CUT in event for telemetry in ticks for event in telemetry.events)
    stopped = sum(bool(telemetry.level and telemetry.level.stopped) for telemetry in ticks)
    return Figures(
        fell=bool(summary["fell"]) or summary["stop_reason"] != "completed",
        roll=summary["roll_rms_deg"],
        pitch=summary["pitch_rms_deg"],
        clearance=1e3 * (summary["swing_clearance_median_m"] or 0.0),
        speed_error=100.0 * (seen / wanted - 1.0) if wanted else 0.0,
        drift=100.0 * abs(drift / distance) if wanted and distance else 0.0,
        cuts=cuts / (end - start),
        stopped=stopped / len(ticks),
        **_effort(data, start),
    )


def _effort(data: RunData, start: float) -> dict[str, float]:
    """Height of the trunk, and how hard and fast the servos work, from `start` (s) on."""
    samples = [sample for sample in data.truth if sample.time >= start]
    return {
        "height": 1e3 * float(np.mean([sample.q[2] for sample in samples])),
        "torque": metrics.rms(np.concatenate([sample.motor_torque for sample in samples])),
        "joint_speed": metrics.rms(np.concatenate([sample.v[6:] for sample in samples])),
    }
