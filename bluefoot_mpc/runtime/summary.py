"""The summary of a run: what ``summary.json`` holds.

Everything is computed from a `RunData`, so a recorded run gives the summary of
the live one. Figures are of the measurement window (`measurement_window`)
except those of the whole run: ``duration_s, fell, servo_temp_max_c,
deadline_misses, tick_us, real_time_factor``. They compare the simulator's truth
with what was commanded, unsmoothed, the mean not removed; without a simulator
they are null.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import orjson

from bluefoot_mpc.model.parameters import GRAVITY, load_parameters
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import COMPLETED, CommandRecord, RunData
from bluefoot_mpc.runtime.window import Window, cut_window, measurement_window, wanted_commands
from bluefoot_mpc.types import Mode
from bluefoot_mpc.zmp.support import support_margins

if TYPE_CHECKING:
    from bluefoot_mpc.model.robot import RobotModel

FALL_TILT = math.radians(45.0)
"""Tilt that counts as a fall, rad."""
_UP = 0.3
"""s that nothing but feet must touch the floor until a robot that lay or sat counts as standing."""
MIN_DISTANCE = 0.05
"""m that must be covered before a cost of transport means anything."""

SUMMARY_KEYS: tuple[str, ...] = (
    "scenario", "seed", "robot", "controller", "gait", "duration_s", "fell", "success", "stop_reason",
    "distance_m", "speed_ref_mps", "speed_mps", "lateral_drift_m", "yaw_drift_deg",
    "roll_rms_deg", "pitch_rms_deg", "roll_peak_deg", "pitch_peak_deg", "attitude_error_rms_deg",
    "zmp_inside_fraction", "zmp_margin_min_m", "zmp_plan_margin_min_m", "swing_clearance_median_m",
    "torque_peak_nm", "torque_rms_nm", "servo_temp_max_c", "energy_j", "cost_of_transport",
    "qp_failures", "deadline_misses", "tick_us", "real_time_factor", "config_sha256", "versions", "figures",
)  # fmt: skip
"""Keys of a summary, in order; one that does not apply to a run is None."""


def summarize(
    run: RunData,
    model: RobotModel | None = None,
    *,
    success: bool | None = None,
    window: tuple[float, float] | None = None,
    figures: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Summary of a run, plain values only.

    Args:
        run: the run, live or from a log.
        model: the robot that ran; None takes the one that the run's configuration describes.
        success: whether the scenario's criteria hold; None means that the run
            was completed without a fall.
        window: s, start and end of the measurement window in the time of the
            frames; None takes `measurement_window`.
        figures: the scenario's own figures, added to ``figures``.
    """
    start, end = window if window is not None else measurement_window(run)
    has_fallen, commands = fell(run), wanted_commands(run)
    if commands:
        end = min(end, commands[-1].time)
    cut = cut_window(run, start, end)
    summary: dict[str, Any] = {
        **_identity(run),
        "duration_s": round(duration(run), 9),
        "fell": has_fallen,
        "success": (run.stop_reason == COMPLETED and not has_fallen) if success is None else success,
        "stop_reason": run.stop_reason,
        "speed_ref_mps": _wanted_speed(commands),
        "servo_temp_max_c": _hottest(run),
        **_ticks(run),
        **_solves(run),
        "real_time_factor": run.real_time_factor,
        "config_sha256": config_sha256(run.config),
        "versions": dict(run.versions),
        "figures": {"window_s": None if cut is None else [start, end]},
    }
    if cut is not None:
        summary |= _motion(cut) | _attitude(cut) | _balance(cut, _foot_radius(run, model)) | _effort(cut)
        summary["figures"] |= _gait_figures(cut)
    summary["figures"] |= dict(figures or {})
    return {key: _plain(summary.get(key)) for key in SUMMARY_KEYS}


def fell(run: RunData) -> bool:
    """True when something other than the feet touched the world, or the trunk tilted over 45°.

    A trunk that rests on the floor at the start or by command (off, sitting, and
    on the way up from there) has not fallen. Without a simulator the estimated
    tilt decides.
    """
    if not run.truth:
        return any(metrics.tilt(t.estimate.quaternion[None])[0] > FALL_TILT for t in run.telemetry)
    if bool((metrics.tilt(run.stack("truth", "q")[:, 3:7]) > FALL_TILT).any()):
        return True
    # Emulated servos find the robot lying; a simulated one starts on its feet.
    stands = run.config.get("run", {}).get("robot", "sim") == "sim"
    has_stood, free_since = stands, math.inf
    for k, sample in enumerate(run.truth):
        mode = run.telemetry[min(k, len(run.telemetry) - 1)].mode if run.telemetry else Mode.STAND
        free_since = math.inf if sample.touching else min(free_since, sample.time)
        if mode in (Mode.OFF, Mode.SIT):
            stands = False
        elif not stands:
            stands = sample.time - free_since >= _UP
        elif sample.touching:
            return True
        has_stood |= stands
    return not has_stood


def duration(run: RunData) -> float:
    """s, from the first frame to the end of the last tick."""
    return run.frames[-1].time - run.frames[0].time + run.period if run.frames else 0.0


def config_sha256(config: Mapping[str, Any]) -> str:
    """Hash of a configuration table, the same for the same values in any order."""
    return hashlib.sha256(orjson.dumps(dict(config), option=orjson.OPT_SORT_KEYS)).hexdigest()


def _wanted_speed(commands: Sequence[CommandRecord]) -> float | None:
    """m/s, as commanded last; None where the robot chooses its speed itself."""
    if not commands or commands[-1].motion.guide is not None:
        return None
    return float(np.hypot(*commands[-1].motion.velocity))


def _identity(run: RunData) -> dict[str, Any]:
    named = run.config.get("run", {})
    walked = any(record.motion.mode is Mode.WALK for record in run.commands)
    gait = wanted_commands(run)[-1].motion.gait if walked else None
    return {key: named.get(key) for key in ("scenario", "seed", "robot", "controller")} | {"gait": gait}


def _foot_radius(run: RunData, model: RobotModel | None) -> float:
    if model is not None:
        return model.parameters.legs.foot_radius
    legs = run.config.get("model", {}).get("legs", {})
    return float(legs["foot_radius"]) if "foot_radius" in legs else load_parameters().legs.foot_radius


def _hottest(run: RunData) -> float | None:
    if run.truth:
        return float(run.stack("truth", "motor_temperature").max())
    seen = [frame.joint_temperature[frame.joint_valid] for frame in run.frames]
    known = np.concatenate(seen) if seen else np.empty(0)
    return float(known.max()) if known.size else None


def _ticks(run: RunData) -> dict[str, Any]:
    ticks = run.tick_us
    if not ticks.size:
        return {"deadline_misses": None, "tick_us": None}
    p50, p99 = np.percentile(ticks, [50.0, 99.0])
    return {
        "deadline_misses": int(np.count_nonzero(ticks > 1e6 * run.period)),
        "tick_us": {"p50": float(p50), "p99": float(p99), "max": float(ticks.max())},
    }


def _solves(run: RunData) -> dict[str, Any]:
    plans = [telemetry.plan for telemetry in run.telemetry if telemetry.plan is not None]
    return {"qp_failures": sum(plan.qp_failures for plan in plans) if plans else None}


def _motion(cut: Window) -> dict[str, Any]:
    path = metrics.path_in_heading(cut.position[:, :2], cut.heading + cut.direction)
    yaw_error = np.unwrap(metrics.yaw(cut.quaternion) - cut.heading)
    return {
        "distance_m": path[-1, 0],
        "speed_mps": path[-1, 0] / cut.length,
        "lateral_drift_m": path[-1, 1],
        "yaw_drift_deg": math.degrees(yaw_error[-1] - yaw_error[0]),
    }


def _attitude(cut: Window) -> dict[str, Any]:
    truth = metrics.roll_pitch(cut.quaternion)
    roll, pitch = np.degrees(truth - cut.wanted_roll_pitch).T
    error = np.degrees(metrics.roll_pitch(cut.estimated_quaternion) - truth)
    return {
        "roll_rms_deg": metrics.rms(roll),
        "pitch_rms_deg": metrics.rms(pitch),
        "roll_peak_deg": metrics.peak(roll),
        "pitch_peak_deg": metrics.peak(pitch),
        "attitude_error_rms_deg": metrics.rms(np.hypot(*error.T)),
    }


def _balance(cut: Window, foot_radius: float) -> dict[str, Any]:
    truth, stance = cut.truth, ~cut.swing
    ground = (cut.foot_position[:, :, 2] - foot_radius - cut.foot_height).mean(axis=1)
    push = np.hstack([truth("external_force"), cut.position])
    point = metrics.zero_moment_points(
        cut.time, truth("com"), truth("momentum"), push, ground, mass=_mass(cut)
    )
    foot = 0.5 * (cut.foot_position[1:, :, :2] + cut.foot_position[:-1, :, :2])
    margin = support_margins(point, foot, stance[:-1])
    plan = support_margins(cut.planned_zmp, cut.reference_foot[:, :, :2], ~cut.reference_swing)
    known, apexes = margin[np.isfinite(margin)], metrics.swing_apexes(cut.foot_height, cut.swing)
    return {
        "zmp_inside_fraction": np.mean(known >= 0.0) if known.size else None,
        "zmp_margin_min_m": known.min() if known.size else None,
        "zmp_plan_margin_min_m": np.nanmin(plan) if np.isfinite(plan).any() else None,
        "swing_clearance_median_m": np.median(apexes) if apexes.size else None,
    }


def _mass(cut: Window) -> float:
    momentum = cut.truth("momentum")[:, :3]
    moving = metrics.mass_in_motion(cut.truth("com"), momentum, cut.time)
    if moving is not None:
        return moving
    return metrics.mass_from_load(cut.truth("foot_force"), cut.truth("external_force"))


def _effort(cut: Window) -> dict[str, Any]:
    torque = cut.truth("motor_torque")
    energy = float(metrics.integrate(cut.truth("electrical_power"), cut.time)[-1])
    distance = float(_motion(cut)["distance_m"])
    weight = _mass(cut) * GRAVITY
    return {
        "torque_peak_nm": metrics.peak(torque),
        "torque_rms_nm": metrics.rms(torque),
        "energy_j": energy,
        "cost_of_transport": energy / (weight * distance) if distance >= MIN_DISTANCE else None,
    }


def _gait_figures(cut: Window) -> dict[str, Any]:
    figures: dict[str, Any] = {}
    if cut.yaw_rate_wanted != 0.0:
        turned = metrics.yaw(cut.quaternion)
        figures["yaw_rate_ref_radps"] = cut.yaw_rate_wanted
        figures["yaw_rate_radps"] = (turned[-1] - turned[0]) / cut.length
    cycle = metrics.cycle_time(cut.time, cut.swing)
    if cycle is not None:
        figures["cycle_s"] = cycle
        figures["duty_factor"] = np.mean(~cut.swing)
        figures["lift_off_lags"] = metrics.lift_off_lags(cut.time, cut.y2)
        figures["footfall_order"] = " ".join(metrics.footfall_order(cut.time, cut.swing)) or None
    return figures


def _plain(value: Any) -> Any:
    """Plain Python values, NaN as None: what JSON can hold."""
    if isinstance(value, dict):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    if isinstance(value, (np.ndarray, np.generic)):
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
