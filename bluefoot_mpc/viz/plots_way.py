"""The report's figures of finding the way over time: what led, clearances, and speeds."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.guided_series import GuidedSeries
from bluefoot_mpc.viz.packing import pack, stretches
from bluefoot_mpc.viz.plots import Panel, Trace, band, curve
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import BAD, COMMAND, ESTIMATE, GUIDED_COLOURS, GUIDED_NAMES

LEAST_CLEARANCE = 0.10
"""m, nearest that any part of the robot may come to anything but the floor."""
_MEAN = 0.6
"""s over which achieved speeds are averaged: two cycles of a trot, whose sway would hide them."""
_SHOWN = 1.5
"""m of clearance that the figure shows at least; farther things are of no concern."""


def way_over_time(series: RunSeries, guided: GuidedSeries, period: float) -> Panel:
    """What led, how near things were, and what became of the decided speeds."""
    layout = _rows()
    traces = _bands(guided, period)
    lines = [("as the robot knew", guided.clearance_known, ESTIMATE, 1.2)]
    if np.isfinite(guided.clearance_true).any():
        lines.insert(0, ("true", guided.clearance_true, "@ink", 1.6))
    for name, values, colour, width in lines:
        if np.isfinite(values).any():
            traces.append(curve(guided.time, _near(values), name, colour, axis="y2", width=width))
    layout["yaxis2"]["range"] = [0.0, _top(guided)]
    achieved = "achieved" if series.has_truth else "achieved, as estimated"
    achieved = f"{achieved} (mean of {_MEAN:g} s)"
    speed = series.velocity_truth if series.has_truth else series.velocity_estimate
    count = max(1, round(_MEAN / period))
    shown = [
        (achieved, 1e3 * smoothed(speed[:, 0], count), "@ink", "y3", "solid", 1.3),
        ("decided", 1e3 * guided.velocity[:, 0], COMMAND, "y3", "solid", 1.6),
        (achieved, np.degrees(smoothed(series.yaw_rate, count)), "@ink", "y4", "solid", 1.3),
        ("decided", np.degrees(guided.yaw_rate), COMMAND, "y4", "solid", 1.6),
    ]
    for name, values, colour, axis, dash, width in shown:
        trace = curve(guided.time, values, name, colour, axis=axis, dash=dash, width=width)
        traces.append({**trace, "legendgroup": name, "showlegend": axis == "y3"})
    layout["shapes"] = [_limit(), *_touched(guided)]
    return Panel(
        key="way", title="Finding the way", data=traces, layout=layout, height=560, wide=True,
        caption=_caption(series, guided),
    )  # fmt: skip


def smoothed(values: FloatArray, count: int) -> FloatArray:
    """(n,) mean of `count` values around each; of fewer at the ends."""
    window = np.ones(count)
    number = np.convolve(np.ones(len(values)), window, mode="same")
    mean = np.convolve(values, window, mode="same") / number
    return np.asarray(mean[: len(values)])


def _caption(series: RunSeries, guided: GuidedSeries) -> str:
    who = "any part of the robot" if np.isfinite(guided.clearance_true).any() else "the robot's outline"
    closest = guided.closest
    near = ""
    if closest is not None:
        near = f" Closest: {guided.clearance[closest]:.3f} m at {guided.time[closest]:.1f} s."
    return (
        f"Clearance: distance from {who} to the nearest thing; the red line is the "
        f"{LEAST_CLEARANCE:.2f} m to be kept.{near} Speeds in the trunk's own heading."
    )


def _rows() -> dict[str, Any]:
    """A narrow band above three plots over one time axis."""
    domains = [("leads", (0.955, 1.0)), ("nearest (m)", (0.56, 0.91)), ("forward (mm/s)", (0.29, 0.50)),
               ("turn (°/s)", (0.0, 0.22))]  # fmt: skip
    layout: dict[str, Any] = {
        "yaxis" if k == 0 else f"yaxis{k + 1}": {
            "domain": list(domain),
            "title": {"text": title, "font": {"size": 11}},
        }
        for k, (title, domain) in enumerate(domains)
    }
    layout["yaxis"] |= {
        "range": [-0.5, 0.5], "fixedrange": True, "showgrid": False, "showticklabels": False,
        "title": {"text": ""},
    }  # fmt: skip
    layout["xaxis"] = {"title": {"text": "time (s)"}, "anchor": "y4"}
    return layout


def _bands(guided: GuidedSeries, period: float) -> list[Trace]:
    """What led, as coloured bars; they are the legend of all other figures' colours, too."""
    leads = np.array(guided.guided)
    traces: list[Trace] = []
    for name, colour in GUIDED_COLOURS.items():
        spans = stretches(leads == name, guided.time, period)
        if not spans:
            continue
        x = [value for start, end in spans for value in (start, end, np.nan)]
        share = 100.0 * float(np.mean(leads[guided.reports] == name))
        digits = 0 if 1.0 <= share <= 99.0 or share == 100.0 else 1
        traces.append(
            {
                "type": "scatter",
                "mode": "lines",
                "x": pack(x),
                "y": pack([0.0] * len(x)),
                "name": f"{GUIDED_NAMES[name]}, {share:.{digits}f} %",
                "line": {"color": colour, "width": 16},
                "hoverinfo": "name",
            }
        )
    return traces


def _near(values: FloatArray) -> FloatArray:
    """Clearances with what is infinite left out: nothing is near then."""
    return np.where(np.isfinite(values), values, np.nan)


def _top(guided: GuidedSeries) -> float:
    finite = guided.clearance[np.isfinite(guided.clearance)]
    return float(min(_SHOWN, max(0.5, 1.1 * finite.max()))) if finite.size else _SHOWN


def _limit() -> dict[str, Any]:
    return {
        "type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": "y2", "y0": LEAST_CLEARANCE,
        "y1": LEAST_CLEARANCE, "line": {"color": BAD, "width": 1},
    }  # fmt: skip


def _touched(guided: GuidedSeries) -> list[dict[str, Any]]:
    return [band(time, time, BAD) for time, _ in guided.collisions]
