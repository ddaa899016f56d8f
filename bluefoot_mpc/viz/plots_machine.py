"""The report's figures of servos, power and computing time."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.types import JOINTS, LEG_JOINTS, LEGS
from bluefoot_mpc.viz.packing import pack, stride_for
from bluefoot_mpc.viz.plots import Panel, Trace, curve, rows
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import (
    BAD,
    ESTIMATE,
    JOINT_COLOURS,
    JOINT_DASHES,
    LEG_COLOURS,
    LEG_NAMES,
    NEUTRAL,
    WARNING,
)

_NOTHING = np.full(1, np.nan)
_COLUMNS = 700  # of the heat strip
_STRIP_COLOURS = [[0.0, "rgba(18,131,210,0.05)"], [0.35, "#8cc3ec"], [0.65, "#eda83a"], [1.0, "#b3273c"]]
"""Calm below a third of the limit, warm above two thirds; ever darker, so that grey prints keep the order."""


def torques(series: RunSeries, stall_torque: float) -> Panel:
    """Torque of each leg's four servos between the stall torques."""
    traces: list[Trace] = []
    layout = rows(len(LEGS), ["torque (N·m)"] * len(LEGS), gap=0.055)
    layout |= {"shapes": [], "annotations": []}
    for leg, name in enumerate(LEGS):
        suffix = "" if leg == 0 else str(leg + 1)
        for index, joint in enumerate(LEG_JOINTS):
            values = series.torque[:, 4 * leg + index]
            trace = curve(
                series.time, values, _spaced(joint), JOINT_COLOURS[joint], axis=f"y{suffix}", width=1.2
            )
            traces.append({**trace, "legendgroup": joint, "showlegend": leg == 0})
        axis = layout[f"yaxis{suffix}"]
        axis["range"] = [-1.12 * stall_torque, 1.12 * stall_torque]
        axis["nticks"] = 5
        layout["shapes"] += [_level(sign * stall_torque, "x domain", f"y{suffix}") for sign in (-1, 1)]
        layout["annotations"].append(_corner_label(LEG_NAMES[name], LEG_COLOURS[name], axis["domain"][1]))
    source = "Motor torque at the output shaft" if series.has_truth else "Load share that the servo reports"
    return Panel(
        key="torques",
        title="Joint torques",
        data=traces,
        layout=layout,
        height=640,
        wide=True,
        caption=f"{source}; dotted lines: stall torque, ±{stall_torque:g} N·m.",
    )


def torque_strip(series: RunSeries, stall_torque: float) -> Panel:
    """All sixteen servos at a glance: greatest share of the limit in each moment."""
    step = stride_for(len(series.time), _COLUMNS)
    starts = np.arange(0, len(series.time), step)
    share = 100.0 * np.maximum.reduceat(np.abs(series.torque), starts, axis=0) / stall_torque
    trace = {
        "type": "heatmap",
        "x": pack(series.time[starts]),
        "y": [_spaced(name) for name in JOINTS],
        "z": pack(share.T),
        "zmin": 0,
        "zmax": 100,
        "colorscale": _STRIP_COLOURS,
        "hovertemplate": "%{y} at %{x:.2f} s: %{z:.0f} %<extra></extra>",
        "colorbar": {"title": {"text": "% of stall", "side": "right"}, "thickness": 10, "outlinewidth": 0},
    }
    layout = {
        "yaxis": {"autorange": "reversed", "showgrid": False, "tickfont": {"size": 10}, "fixedrange": True},
        "xaxis": {"title": {"text": "time (s)"}, "showgrid": False},
        "hovermode": "closest",
        "margin": {"t": 8},
    }
    return Panel(
        key="load",
        title="Servo load",
        data=[trace],
        layout=layout,
        height=330,
        wide=True,
        caption="Share of the stall torque, the greatest of each moment.",
    )


def temperatures(series: RunSeries, warn_at: float) -> Panel:
    """Temperature of every servo, and what the battery gives."""
    traces: list[Trace] = []
    for index, joint in enumerate(JOINTS):
        leg, _, kind = joint.partition("_")
        line = curve(
            series.time,
            series.temperature[:, index],
            joint,
            LEG_COLOURS[leg],
            dash=JOINT_DASHES[kind],
            width=1.2,
        )
        traces.append({**line, "showlegend": False, "hovertemplate": "%{y:.1f} °C"})
    # One line without points per leg, for the legend.
    traces += [{**curve(_NOTHING, _NOTHING, leg, LEG_COLOURS[leg]), "showlegend": True} for leg in LEGS]
    titles = ["temperature (°C)", "voltage (V)"]
    traces.append({**curve(series.time, series.voltage, "voltage", ESTIMATE, axis="y2"), "showlegend": False})
    if np.isfinite(series.power).any():
        titles.append("power (W)")
        traces.append(
            {**curve(series.time, series.power, "power", NEUTRAL, axis="y3", width=1.0), "showlegend": False}
        )
    layout = rows(len(titles), titles)
    layout["hovermode"] = "closest"
    hottest = float(np.nanmax(series.temperature)) if series.temperature.size else 0.0
    if hottest > 0.8 * warn_at:
        layout["shapes"] = [_level(warn_at, "x domain", "y")]
    return Panel(
        key="temperatures",
        title="Temperature and supply",
        data=traces,
        layout=layout,
        height=430,
        caption="Line style tells the joint: dotted hip yaw, full hip pitch, dashed knee, dash-dotted ankle. "
        f"Servos switch themselves off at {warn_at:g} °C.",
    )


def tick_times(series: RunSeries, period: float) -> Panel:
    """Histogram of the controller's tick times up to the deadline."""
    ticks = series.tick_us[series.tick_us > 0.0]
    deadline = 1e6 * period
    traces: list[Trace] = []
    marks: list[tuple[float, str, str]] = [(deadline, f"deadline {1e3 * period:g} ms", BAD)]
    if len(ticks):
        low, high = float(ticks.min()), float(ticks.max())
        edges = np.geomspace(0.95 * low, 1.05 * high, 60)
        counts = np.histogram(ticks, edges)[0].astype(np.float64)
        x, y = np.repeat(edges, 2), np.concatenate([[0.0], np.repeat(counts, 2), [0.0]])
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": pack(x),
                "y": pack(y),
                "fill": "tozeroy",
                "name": "ticks",
                "line": {"color": ESTIMATE, "width": 1},
                "fillcolor": "rgba(18,131,210,0.25)",
                "showlegend": False,
                "hovertemplate": "%{y:.0f} ticks near %{x:.0f} µs<extra></extra>",
            }
        )
        median, late = (float(v) for v in np.percentile(ticks, [50, 99]))
        marks += [(median, f"median {median:.0f} µs", NEUTRAL), (late, f"99 % {late:.0f} µs", WARNING)]
        marks = [mark for mark in marks if mark[0] > 0.0]
    layout = {
        "xaxis": {"type": "log", "title": {"text": "tick time (µs)"}, "dtick": 1},
        "yaxis": {"title": {"text": "ticks"}, "rangemode": "tozero"},
        "shapes": [_upright(value, colour) for value, _, colour in marks],
        "annotations": [
            {
                "x": float(np.log10(value)),
                "y": 0.96 - 0.09 * (index % 3),
                "yref": "paper",
                "text": text,
                "showarrow": False,
                "xanchor": "right" if index == 0 else "left",
                "xshift": -5 if index == 0 else 5,
                "font": {"size": 11},
            }
            for index, (value, text, _) in enumerate(marks)
        ],
        "hovermode": "closest",
        "margin": {"t": 12},
    }
    return Panel(
        key="ticks",
        title="Tick times",
        data=traces,
        layout=layout,
        height=430,
        time=False,
        caption="From a frame's arrival to the command's departure; sensors and physics excluded.",
    )


def _level(value: float, x: str, y: str) -> dict[str, Any]:
    line = {"color": BAD, "width": 1.2, "dash": "dot"}
    return {"type": "line", "xref": x, "yref": y, "x0": 0, "x1": 1, "y0": value, "y1": value, "line": line}


def _upright(value: float, colour: str) -> dict[str, Any]:
    line = {"color": colour, "width": 1.5, "dash": "dot"}
    return {"type": "line", "x0": value, "x1": value, "yref": "paper", "y0": 0, "y1": 1, "line": line}


def _corner_label(text: str, colour: str, y: float) -> dict[str, Any]:
    return {
        "x": 1.0,
        "y": y,
        "xref": "paper",
        "yref": "paper",
        "xanchor": "right",
        "yanchor": "bottom",
        "text": f"<b>{text}</b>",
        "showarrow": False,
        "font": {"size": 12, "color": colour},
    }


def _spaced(name: str) -> str:
    return name.replace("_", " ")
