"""The report's figures of balance and of the way over ground."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.geometry import convex_hull, signed_margin
from bluefoot_mpc.types import LEGS, FloatArray
from bluefoot_mpc.viz.packing import pack, stride_for
from bluefoot_mpc.viz.plots import LIMIT, Panel, Trace, curve, rows
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import BAD, COM, COMMAND, LEG_COLOURS, SUPPORT, ZMP


def balance(series: RunSeries) -> Panel:
    """How far the ZMP lies inside the support, over time."""
    pick = slice(None, None, stride_for(len(series.time), LIMIT))
    time, feet, stance = series.time[pick], series.feet[pick, :, :2], series.scheduled[pick]
    lines = [("assumed by the controller", series.zmp_plan[pick], COMMAND, "dash")]
    if series.has_truth:
        lines.insert(0, ("measured", series.zmp[pick], ZMP, "solid"))
    traces = [
        curve(time, 1e3 * _margins(points, feet, stance), name, colour, dash=dash, width=1.3)
        for name, points, colour, dash in lines
    ]
    edge = {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "y0": 0,
        "y1": 0,
        "line": {"color": BAD, "width": 1},
    }
    return Panel(
        key="balance",
        title="ZMP margin",
        data=traces,
        height=430,
        layout={**rows(1, ["margin (mm)"]), "shapes": [edge]},
        caption="Distance of the ZMP to the edge of the scheduled feet's hull; outside is negative. "
        "Two feet span a line, so that a trot is at zero at best.",
    )


def path(series: RunSeries) -> Panel:
    """The way over ground from above: trunk, footprints, and support polygons of the last steps."""
    pick = slice(None, None, stride_for(len(series.time), LIMIT))
    x, y = series.q[pick, 0], series.q[pick, 1]
    traces: list[Trace] = [support_outlines(series)]
    for index, leg in enumerate(LEGS):
        prints = _footprints(series, index)
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "x": pack(prints[:, 0]),
                "y": pack(prints[:, 1]),
                "name": leg,
                "marker": {"color": LEG_COLOURS[leg], "size": 6, "opacity": 0.8},
                "hovertemplate": f"{leg} foot<br>x %{{x:.3f}} m, y %{{y:.3f}} m<extra></extra>",
            }
        )
    lines = [("trunk", x, y, "@ink"), ("centre of mass", series.com[pick, 0], series.com[pick, 1], COM)]
    for name, u, v, colour in lines:
        if np.isfinite(u).any():
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": pack(u),
                    "y": pack(v),
                    "name": name,
                    "line": {"color": colour, "width": 1.6},
                    "hovertemplate": "x %{x:.3f} m, y %{y:.3f} m",
                }
            )
    layout = {
        "xaxis": {"title": {"text": "x, forward at the start (m)"}},
        "yaxis": {"title": {"text": "y, left (m)"}, "scaleanchor": "x", "scaleratio": 1},
        "hovermode": "closest",
    }
    return Panel(
        key="path",
        title="Path from above",
        data=traces,
        layout=layout,
        height=380,
        wide=True,
        time=False,
        caption="Where each foot came down, the way of the trunk, and the support polygons of the last "
        "cycles. Zoom in to see single steps.",
    )


def _margins(points: FloatArray, feet: FloatArray, stance: np.ndarray[Any, Any]) -> FloatArray:
    margins = np.full(len(points), np.nan)
    for k in range(len(points)):
        if np.isfinite(points[k]).all() and stance[k].any():
            margins[k] = signed_margin(points[k], convex_hull(feet[k][stance[k]]))
    return margins


def last_steps(series: RunSeries, stretch: float) -> slice:
    """Ticks of the last `stretch` seconds of walking; of the run where it did not walk."""
    moving = np.flatnonzero(series.walking)
    last = int(moving[-1]) if len(moving) else len(series.time) - 1
    return slice(int(np.searchsorted(series.time, series.time[last] - stretch)), last + 1)


def support_outlines(series: RunSeries, stretch: float = 2.0) -> Trace:
    """Outlines of the support in the last `stretch` seconds of walking, each time it changes."""
    pick = last_steps(series, stretch)
    x: list[float] = []
    y: list[float] = []
    before = None
    for k in range(pick.start, pick.stop):
        stance = tuple(series.scheduled[k])
        if stance == before or not any(stance):
            continue
        before = stance
        corners = convex_hull(series.feet[k, list(stance), :2])
        x += [*corners[:, 0], corners[0, 0], np.nan]
        y += [*corners[:, 1], corners[0, 1], np.nan]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": pack(x),
        "y": pack(y),
        "name": f"support, last {stretch:g} s",
        "line": {"color": SUPPORT, "width": 1},
        "fill": "toself",
        "fillcolor": "rgba(18,161,124,0.07)",
        "hoverinfo": "skip",
    }


def _footprints(series: RunSeries, leg: int) -> FloatArray:
    """(k, 2) m, where a foot stood each time that it was set down."""
    loaded = series.loaded[:, leg]
    landings = np.flatnonzero(loaded & ~np.concatenate([[False], loaded[:-1]]))
    # A moment later the foot has settled.
    settled = np.minimum(landings + 2, len(loaded) - 1)
    return series.feet[settled, leg, :2]
