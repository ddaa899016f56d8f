"""What levelling did in each window of a run: tilt, speed, height, and the network."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.window import Window, cut_window
from bluefoot_mpc.types import FloatArray, LevelReport, Mode

SMOOTHING = 0.5
"""s, length of the moving average behind the paper's own measure of the tilt."""
THROUGHOUT = 0.9
"""Mean share of levelling in the goals from which it acted in a whole window, the fade apart."""
LEAST_SPEED = 0.005
"""m/s, mean speed from which changes in percent mean something: turning in place drifts by less."""
_AXES = ("roll", "pitch", "tilt")
_LATE = 0.1
"""s after a window's start by which levelling begins to act where it is ready."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelWindow:
    """One window of the schedule.

    Attributes:
        on: True where levelling acts.
        start: s, time of the frames.
        end: s.
    """

    on: bool
    start: float
    end: float


@dataclass(frozen=True, kw_only=True, slots=True)
class _Part:
    """The ticks of a window, n of them.

    Attributes:
        error: (n, 2) degrees, true roll and pitch against the command.
        smooth: (m, 2) degrees, the same as moving average over `SMOOTHING`.
        speed: m/s, mean along the commanded motion.
        height: m, mean of the trunk's origin over the ground under the feet.
    """

    error: FloatArray
    smooth: FloatArray
    speed: float
    height: float


def windows_of(run: RunData, duration: float) -> list[LevelWindow]:
    """The whole windows of a run, off first, in turns, as long as it was to walk and did.

    Without levelling every window is one without it: the reference.

    Args:
        run: the run; its configuration holds the schedule.
        duration: s that were planned: what is beyond is no window.
    """
    leveling = run.config.get("control", {}).get("leveling", {})
    schedule = leveling.get("schedule", {})
    lengths = (schedule.get("off", 0.0), schedule.get("on", 0.0))
    if not run.truth or min(lengths) <= 0.0:
        return []
    last = min(duration, run.truth[-1].time + run.period, _walked_until(run)) + 0.5 * run.period
    found: list[LevelWindow] = []
    start = run.truth[0].time + schedule["start"]
    for on, length in itertools.cycle(zip((False, True), lengths, strict=True)):
        if start + length > last:
            return found
        found.append(LevelWindow(on=on and leveling["enabled"], start=start, end=start + length))
        start += length
    return found


def _walked_until(run: RunData) -> float:
    """s, end of the last tick on which walking was commanded and the controller walked."""
    walking = (
        command.time + run.period
        # A log that was cut off may lack the last of either.
        for command, record in zip(run.commands, run.telemetry, strict=False)
        if command.motion.mode is Mode.WALK and record.mode is Mode.WALK
    )
    return max(walking, default=-math.inf)


def level_figures(run: RunData, windows: Sequence[LevelWindow]) -> dict[str, Any]:
    """Figures of every window, of all off and of all on windows, and what they differ by.

    RMS and peak are those of the true attitude against the command over whole
    windows: nothing is trimmed, so the fade at their edges counts too. Reductions
    are in percent of what is without levelling, negative where it is worse.

    Args:
        run: the run.
        windows: the windows that are whole.
    """
    parts = [_cut(run, window) for window in windows]
    off, on = (
        _pooled([part for part, w in zip(parts, windows, strict=True) if w.on is kind])
        for kind in (False, True)
    )
    told = _told(run, windows, parts)
    reports = [record.level for record in run.telemetry]
    partial = [
        window
        for window, row in zip(windows, told, strict=True)
        if window.on and (row["share_mean"] or 0.0) < THROUGHOUT
    ]
    stopped = [report.stopped for report in reports if report is not None and report.stopped]
    return {
        "leveling": any(report is not None for report in reports),
        "windows": told,
        "off": off,
        "on": on,
        "reduction_percent": {axis: _reduction(off, on, f"{axis}_rms_deg") for axis in _AXES},
        "peak_reduction_percent": {axis: _reduction(off, on, f"{axis}_peak_deg") for axis in _AXES},
        "smooth_reduction_percent": {axis: _reduction(off, on, f"{axis}_smooth_rms_deg") for axis in _AXES},
        "speed_change_percent": _speed_change(off, on),
        "height_change_m": on["height_m"] - off["height_m"] if off and on else None,
        "partial_windows": len(partial),
        "partial_reasons": list(dict.fromkeys(_why_partial(run, window) for window in partial)),
        "stopped_ticks": len(stopped),
        "stopped": list(dict.fromkeys(stopped)),
    }


def _cut(run: RunData, window: LevelWindow) -> _Part:
    # Windows share their edges: the last instant belongs to the next one.
    cut = cut_window(run, window.start, window.end - 0.5 * run.period)
    if cut is None:  # Shorter than three ticks; whole windows of a schedule are not.
        nothing = np.full((1, 2), np.nan)
        return _Part(error=nothing, smooth=nothing, speed=math.nan, height=math.nan)
    error = np.degrees(metrics.roll_pitch(cut.quaternion) - cut.wanted_roll_pitch)
    path = metrics.path_in_heading(cut.position[:, :2], cut.heading + cut.direction)
    return _Part(
        error=error,
        smooth=_moving_average(error, round(SMOOTHING / run.period)),
        speed=float(path[-1, 0]) / cut.length,
        height=float(np.mean(_height(run, cut))),
    )


def _height(run: RunData, cut: Window) -> FloatArray:
    """(n,) m, trunk origin over the mean height of the ground under the feet."""
    legs = run.config.get("model", {}).get("legs", {})
    radius = legs["foot_radius"] if "foot_radius" in legs else load_parameters().legs.foot_radius
    ground = (cut.foot_position[:, :, 2] - radius - cut.foot_height).mean(axis=1)
    height: FloatArray = cut.position[:, 2] - ground
    return height


def _moving_average(values: FloatArray, length: int) -> FloatArray:
    """(m, 2) mean of `length` neighbours; of all where there are fewer."""
    kernel = np.full(min(max(length, 1), len(values)), 1.0)
    columns = [np.convolve(column, kernel / kernel.sum(), mode="valid") for column in values.T]
    return np.stack(columns, axis=1)


def _pooled(parts: Sequence[_Part]) -> dict[str, Any]:
    """Figures of several windows as if they were one; empty without any."""
    if not parts:
        return {}
    error = np.concatenate([part.error for part in parts])
    smooth = np.concatenate([part.smooth for part in parts])
    return {
        "windows": len(parts),
        **_by_axis(error, "rms_deg", metrics.rms),
        **_by_axis(error, "peak_deg", metrics.peak),
        **_by_axis(smooth, "smooth_rms_deg", metrics.rms),
        "speed_mps": float(np.mean([part.speed for part in parts])),
        "height_m": float(np.mean([part.height for part in parts])),
    }


def _by_axis(error: FloatArray, name: str, measure: Any) -> dict[str, float]:
    """A measure of roll, of pitch, and of both together: the tilt."""
    roll, pitch = error.T
    values = (roll, pitch, np.hypot(roll, pitch))
    return {f"{axis}_{name}": measure(value) for axis, value in zip(_AXES, values, strict=True)}


def _told(run: RunData, windows: Sequence[LevelWindow], parts: Sequence[_Part]) -> list[dict[str, Any]]:
    """Every window for the summary; an on window is compared with the one before it, which is off."""
    rows: list[dict[str, Any]] = []
    before: dict[str, Any] = {}
    for window, part in zip(windows, parts, strict=True):
        seen = _pooled([part])
        del seen["windows"]
        rows.append(
            {
                "kind": "on" if window.on else "off",
                "start_s": window.start,
                "end_s": window.end,
                **seen,
                **({f"{a}_reduction_percent": _reduction(before, seen, f"{a}_rms_deg") for a in _AXES}
                   if window.on else {}),
                **_network(run, window),
            }
        )  # fmt: skip
        before = seen
    return rows


def _network(run: RunData, window: LevelWindow) -> dict[str, float | None]:
    """How far levelling acted on average, and the network's error and learning rate at the window's end."""
    reports = _reports(run, window)
    if not reports:
        return {"share_mean": None, "mse": None, "rate": None}
    share = float(np.mean([report.share for report in reports]))
    return {"share_mean": share, "mse": reports[-1].mse, "rate": reports[-1].rate}


def _reports(run: RunData, window: LevelWindow) -> list[LevelReport]:
    """What levelling told on the ticks of a window."""
    return [
        record.level
        for record in run.telemetry
        if record.level is not None and window.start - 1e-6 <= record.time < window.end - 1e-6
    ]


def _why_partial(run: RunData, window: LevelWindow) -> str:
    """Why levelling did not act throughout an on window though nothing stopped it."""
    leveling = run.config["control"]["leveling"]
    shares = [report.share for report in _reports(run, window)]
    waited = next((k for k, share in enumerate(shares) if share > 0.0), len(shares)) * run.period
    if waited > _LATE and leveling.get("psi", "network") == "network":
        return (
            "the network first learns for control.leveling.schedule.learn_time; "
            "take longer off windows, or --level pd"
        )
    fade, length = leveling["schedule"].get("fade", 0.0), window.end - window.start
    if 0.5 * fade > (1.0 - THROUGHOUT) * length:  # The fade alone takes that much of the mean.
        return (
            f"it fades in for {fade:g} of their {length:g} s; "
            "take a shorter control.leveling.schedule.fade, or longer on windows"
        )
    return "it let go for a while: the estimate was not to be trusted, or it did not walk"


def _reduction(off: Mapping[str, Any], on: Mapping[str, Any], figure: str) -> float | None:
    """Percent by which a figure is lower with levelling; None where it cannot be said."""
    without, with_it = off.get(figure), on.get(figure)
    if not without or with_it is None:
        return None
    return 100.0 * (1.0 - float(with_it) / float(without))


def _speed_change(off: Mapping[str, Any], on: Mapping[str, Any]) -> float | None:
    """Percent by which the mean speed is higher with levelling; None where it hardly moves."""
    lower = _reduction(off, on, "speed_mps")
    return None if lower is None or abs(off["speed_mps"]) < LEAST_SPEED else -lower
