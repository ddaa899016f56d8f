"""The report's figures of trunk levelling: the paper's pictures, and what stands behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bluefoot_mpc.types import LEGS, BoolArray, FloatArray
from bluefoot_mpc.viz.level_series import LevelSeries
from bluefoot_mpc.viz.packing import stretches
from bluefoot_mpc.viz.plots import Panel, Trace, band, curve, gait_window, name_rows, rows
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import BAD, COMMAND, ESTIMATE, GOOD, LEG_COLOURS, LEG_NAMES

_AXES = ("roll", "pitch", "yaw")
_ACTS_OPACITY = 0.13


def level_panels(series: RunSeries, level: LevelSeries, figures: Mapping[str, Any]) -> list[Panel]:
    """All figures of the levelling of a run.

    Args:
        series: the run.
        level: its levelling.
        figures: the scenario's own figures of the summary; windows are drawn where it has them.
    """
    panels = [attitude(series, level)]
    if figures.get("windows"):
        panels.append(windows(figures["windows"]))
    if level.has_network:
        panels.append(learning(series, level))
    return [*panels, disturbance(series, level), contact_forces(series, level)]


def attitude(series: RunSeries, level: LevelSeries) -> Panel:
    """Roll and pitch, shaded where levelling acts: the paper's picture."""
    angle = np.degrees(series.rpy_truth if series.has_truth else series.rpy_estimate)[:, :2]
    command = np.degrees(series.rpy_command)
    traces: list[Trace] = []
    for index, axis in enumerate(("y", "y2")):
        lines = [("truth" if series.has_truth else "estimate", angle, "@ink", "solid", 1.1),
                 ("commanded", command, COMMAND, "dash", 1.6)]  # fmt: skip
        for name, values, colour, dash, width in lines:
            trace = curve(series.time, values[:, index], name, colour, axis=axis, dash=dash, width=width)
            traces.append({**trace, "legendgroup": name, "showlegend": index == 0})
    without, with_it = (
        _tilt(angle - command, series.walking & (level.share == share)) for share in (0.0, 1.0)
    )
    caption = "Shaded: levelling acts on the goals."
    if without is not None and with_it is not None:
        change = 100.0 * (with_it / without - 1.0)
        caption += " RMS while it walks, first steps included, without and with it: " + ", ".join(
            f"{name} {without[k]:.2f}° and {with_it[k]:.2f}° ({change[k]:+.0f} %)"
            for k, name in enumerate(_AXES[:2])
        )
        caption += "."
    if level.stopped.any():
        caption += f" Red: it has disengaged itself, at {series.time[level.stopped][0]:.1f} s."
    return Panel(
        key="level-attitude", title="Levelling: trunk attitude", caption=caption, data=traces,
        layout=_shaded(rows(2, ["roll (°)", "pitch (°)"]), series, level), height=400, wide=True,
    )  # fmt: skip


def windows(told: Sequence[Mapping[str, Any]]) -> Panel:
    """RMS of roll and pitch in every window, as bars."""
    titles = [f"{w['start_s']:.0f}–{w['end_s']:.0f} s<br>{w['kind']}" for w in told]
    traces: list[Trace] = [
        {
            "type": "bar",
            "name": axis,
            "x": titles,
            "y": [w[f"{axis}_rms_deg"] for w in told],
            "marker": {"color": colour, "opacity": [1.0 if w["kind"] == "on" else 0.4 for w in told]},
            "hovertemplate": "%{y:.2f}°",
        }
        for axis, colour in (("roll", ESTIMATE), ("pitch", COMMAND))
    ]
    lower = [
        f"{-w['roll_reduction_percent']:+.0f}/{-w['pitch_reduction_percent']:+.0f} %"
        for w in told
        if w.get("roll_reduction_percent") is not None and w.get("pitch_reduction_percent") is not None
    ]
    against = f" Roll/pitch against the window before: {', '.join(lower)}." if lower else ""
    return Panel(
        key="level-windows", title="Levelling by window",
        caption=f"RMS of the true attitude against the command, whole windows; full colour: on.{against}",
        data=traces, height=340, time=False,
        layout={
            "barmode": "group", "xaxis": {},
            "yaxis": {"title": {"text": "degrees RMS"}, "rangemode": "tozero"},
        },
    )  # fmt: skip


def learning(series: RunSeries, level: LevelSeries) -> Panel:
    """Squared error and learning rate of the network while it walks, both on log axes."""
    lines = (("squared error", level.mse, ESTIMATE, "y"), ("learning rate", level.rate, COMMAND, "y2"))
    traces: list[Trace] = [
        {
            **curve(series.time, np.where(series.walking & (v > 0.0), v, np.nan), name, colour, axis=axis),
            "showlegend": False,
        }
        for name, v, colour, axis in lines
    ]
    layout = _shaded(rows(2, ["squared error, scaled", "learning rate"], gap=0.12), series, level)
    for axis in ("yaxis", "yaxis2"):
        layout[axis] |= {"type": "log", "nticks": 5}
    learns = 100.0 * float(np.mean(level.training[series.walking])) if series.walking.any() else 0.0
    return Panel(
        key="level-learning", title="What the network learns", data=traces, layout=layout, height=340,
        caption=f"Low-passed squared error of one prediction, and the bold driver's rate. It learns in "
        f"{learns:.0f} % of the ticks that it walks; shaded: levelling acts."
        f"{_errors(level)}",
    )  # fmt: skip


def disturbance(series: RunSeries, level: LevelSeries) -> Panel:
    """Predicted against measured angular acceleration that all but the motors gives the trunk."""
    traces: list[Trace] = []
    for index in range(3):
        axis = "y" if index == 0 else f"y{index + 1}"
        lines = [("measured", level.measured, "@ink", 1.0)]
        if level.predicts:
            lines.append(("predicted", level.predicted, ESTIMATE, 1.5))
        for name, values, colour, width in lines:
            trace = curve(series.time, values[:, index], name, colour, axis=axis, width=width)
            traces.append({**trace, "legendgroup": name, "showlegend": index == 0})
    layout = _shaded(rows(3, [f"{name} (rad/s²)" for name in _AXES]), series, level)
    window = gait_window(series)
    layout["xaxis"]["range"] = window
    what = "Nothing is predicted: feedback of the attitude alone."
    if level.predicts:
        shares = _explained(level.predicted, level.measured, series.walking)
        told = ", ".join(f"{name} {100.0 * s:.0f} %" for name, s in zip(_AXES, shares, strict=True))
        what = (
            "Blue: predicted a period ahead. Of what was measured it explains, while it walks: "
            f"{told} (100 % is perfect, below zero is worse than predicting nothing but the mean)."
        )
    return Panel(
        key="level-disturbance", title="Disturbance of the trunk", data=traces, layout=layout, height=460,
        wide=True, window=window[1] - window[0],
        caption=f"Angular acceleration that gravity, contacts and everything else but the motors gives the "
        f"trunk. {what} Turns its pages with the replay.",
    )  # fmt: skip


def contact_forces(series: RunSeries, level: LevelSeries) -> Panel:
    """Vertical ground force of each foot, estimated and true."""
    traces: list[Trace] = []
    layout = _shaded(rows(len(LEGS), ["force (N)"] * len(LEGS), gap=0.055), series, level)
    for leg, name in enumerate(LEGS):
        axis = "y" if leg == 0 else f"y{leg + 1}"
        lines = [("estimated", level.load[:, leg], LEG_COLOURS[name], 1.8)]
        if series.has_truth:
            lines.insert(0, ("true", level.load_truth[:, leg], "@ink", 1.0))
        for kind, values, colour, width in lines:
            trace = curve(series.time, values, f"{name} {kind}", colour, axis=axis, width=width)
            traces.append({**trace, "showlegend": False})
    name_rows(layout, [LEG_NAMES[name] for name in LEGS], [LEG_COLOURS[name] for name in LEGS])
    window = gait_window(series)
    layout["xaxis"]["range"] = window
    against = ""
    if series.has_truth:
        error = level.load - level.load_truth
        known = error[np.isfinite(error)]
        off = float(np.sqrt(np.mean(np.square(known)))) if known.size else float("nan")
        against = f" Black: the true one; they differ by {off:.1f} N RMS."
    return Panel(
        key="level-forces", title="Estimated ground forces", data=traces, layout=layout, height=460,
        wide=True, window=window[1] - window[0],
        caption="Coloured: what the foot switches and the accelerometer say of each foot's vertical force, "
        f"shared evenly by the feet that touch.{against} Turns its pages with the replay.",
    )  # fmt: skip


def _shaded(layout: dict[str, Any], series: RunSeries, level: LevelSeries) -> dict[str, Any]:
    """The layout with bands where levelling acts and where it has disengaged itself."""
    step = float(series.time[1] - series.time[0]) if len(series.time) > 1 else 0.0
    marked: tuple[tuple[BoolArray, str], ...] = ((level.acts, GOOD), (level.stopped, BAD))
    shapes = [
        band(start, end, colour) | {"opacity": _ACTS_OPACITY}
        for active, colour in marked
        for start, end in stretches(active, series.time, step)
    ]
    return layout | {"shapes": shapes}


def _tilt(error: FloatArray, ticks: BoolArray) -> FloatArray | None:
    """(2,) degrees, RMS of roll and pitch on some ticks; None without any."""
    if not ticks.any():
        return None
    rms: FloatArray = np.sqrt(np.mean(np.square(error[ticks]), axis=0))
    return rms if (rms > 0.0).all() else None


def _explained(predicted: FloatArray, measured: FloatArray, walking: BoolArray) -> FloatArray:
    """(3,) share of the measured variance that the prediction explains; NaN without any."""
    known = walking & np.isfinite(predicted).all(axis=1) & np.isfinite(measured).all(axis=1)
    if known.sum() < 2:
        return np.full(3, np.nan)
    left = np.mean(np.square(measured[known] - predicted[known]), axis=0)
    spread = np.var(measured[known], axis=0)
    share: FloatArray = 1.0 - left / np.where(spread > 0.0, spread, np.nan)
    return share


def _errors(level: LevelSeries) -> str:
    """Median squared errors where levelling rests and where it acts."""
    found = []
    for name, ticks in (("without levelling", ~level.acts), ("with it", level.acts)):
        known = level.mse[ticks & np.isfinite(level.mse)]
        if known.size:
            found.append(f"{np.median(known):.2g} {name}")
    return f" Median error: {', '.join(found)}." if found else ""
