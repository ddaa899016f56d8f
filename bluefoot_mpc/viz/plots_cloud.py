"""The report's cloud: what the LIDAR met of the ground, in three dimensions, with the robot's way."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.crossing_series import CrossingSeries
from bluefoot_mpc.viz.packing import pack, stride_for
from bluefoot_mpc.viz.plots import Panel, Trace
from bluefoot_mpc.viz.plots_terrain import HEIGHTS
from bluefoot_mpc.viz.style import COMMAND, ROUTE

_WAY = 800
"""Most points of a way."""
_STRETCH = 2.0
"""How much taller than it is a thing looks: steps of a few millimetres would not be seen."""
_LEAST_SCALE = 20.0
"""mm of height that the colours span at least, each way."""


def cloud_picture(crossing: CrossingSeries) -> Panel:
    """All points of the run in the odometry frame, coloured by height."""
    points = crossing.points
    traces: list[Trace] = []
    if len(points):
        span = max(_LEAST_SCALE, 1e3 * float(np.percentile(np.abs(points[:, 2]), 99)))
        marker = {
            "size": 2.0, "color": pack(1e3 * points[:, 2]), "colorscale": HEIGHTS, "cmin": -span,
            "cmax": span,
            "colorbar": {"title": {"text": "height (mm)", "side": "right"}, "thickness": 12, "len": 0.75,
                         "outlinewidth": 0},
        }  # fmt: skip
        traces.append(
            {**_trace(points, "markers", "cloud"), "marker": marker,
             "hovertemplate": "x %{x:.2f} m, y %{y:.2f} m, z %{z:.3f} m<extra></extra>"}
        )  # fmt: skip
    pick = slice(None, None, stride_for(len(crossing.time), _WAY))
    line = {"color": "@ink", "width": 5}
    traces.append({**_trace(crossing.estimate[pick], "lines", "trunk, estimate"), "line": line})
    if crossing.routes:
        route = crossing.routes[-1].poses[:, :2]
        over = np.column_stack([route, np.full(len(route), 0.002)])
        traces.append({**_trace(over, "lines", "planned way"), "line": {"color": ROUTE, "width": 5}})
    if np.isfinite(crossing.goal).all():
        star = np.array([[*crossing.goal, 0.0]])
        traces.append({**_trace(star, "markers", "goal"), "marker": {"size": 6, "color": COMMAND}})
    return Panel(
        key="cloud", title="Cloud", data=traces, time=False, height=440,
        layout={"scene": _scene(crossing)},
        caption=_caption(crossing),
    )  # fmt: skip


def _caption(crossing: CrossingSeries) -> str:
    shown = len(crossing.points)
    if not shown:
        return "The LIDAR gave no point of the ground near the way: only the way is shown."
    part = f"{shown} of {crossing.seen} points" if shown < crossing.seen else f"{shown} points"
    return f"{part} where the robot placed them. Heights are stretched {_STRETCH:g} times. Drag to turn."


def _scene(crossing: CrossingSeries) -> dict[str, Any]:
    axis = {"gridcolor": "@line", "zerolinecolor": "@line", "linecolor": "@line", "color": "@muted",
            "showbackground": False}  # fmt: skip
    drawn = np.concatenate([crossing.points, crossing.estimate, [[*crossing.goal, np.nan]]])
    size = np.maximum(np.nanmax(drawn, axis=0) - np.nanmin(drawn, axis=0), 0.1) * [1.0, 1.0, _STRETCH]
    # Plotly's box has sides of about one; its longest side is the longest of the drawn things.
    ratio = 2.1 * size / size.max()
    return {
        "xaxis": {**axis, "title": {"text": "x (m)"}},
        "yaxis": {**axis, "title": {"text": "y (m)"}},
        "zaxis": {**axis, "title": {"text": "z (m)"}, "nticks": 4},
        "aspectmode": "manual",
        "aspectratio": {"x": ratio[0], "y": ratio[1], "z": ratio[2]},
        "camera": {"eye": {"x": -1.4, "y": -1.65, "z": 1.25}, "center": {"x": 0.0, "y": 0.0, "z": -0.15}},
    }


def _trace(points: FloatArray, mode: str, name: str) -> Trace:
    x, y, z = (pack(np.round(column, 4)) for column in points.T)
    return {"type": "scatter3d", "mode": mode, "x": x, "y": y, "z": z, "name": name}
