"""The report's figures of marker and leader: where in the picture, and how far away."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.viz.guided_series import GuidedSeries
from bluefoot_mpc.viz.packing import stretches
from bluefoot_mpc.viz.plots import Panel, Trace, curve, rows
from bluefoot_mpc.viz.style import COMMAND, ESTIMATE, GUIDED_COLOURS, MARKER
from bluefoot_mpc.viz.verdict import number

TOLERANCE = 0.05
"""m from the wanted distance that an approach may stop at."""


def in_picture(guided: GuidedSeries, width: int) -> Panel:
    """Column and radius of the marker over time, and where it was out of view.

    Args:
        guided: how the run found its way.
        width: pixels of the camera's pictures; 0 where none was kept.
    """
    traces = [
        curve(guided.time, guided.marker[:, 0], "column", MARKER, width=1.4),
        {**curve(guided.time, guided.marker[:, 2], "radius", MARKER, axis="y2", width=1.4)},
        {**curve(guided.time, guided.marker[:, 1], "row", MARKER, axis="y3", width=1.4)},
    ]
    layout = rows(3, ["column (px)", "radius (px)", "row (px)"])
    layout["yaxis2"]["rangemode"] = "tozero"
    if width:
        layout["yaxis"]["range"] = [0, width]
        layout["shapes"] = [_middle(0.5 * width)]
    return Panel(
        key="marker-pixels", title="Marker in the picture",
        data=[{**trace, "showlegend": False} for trace in traces], layout=layout, height=460,
        caption=f"In view for {_share(guided):.1f} % of the time since it was to be looked for. "
        "The fine line is the middle of the picture; gaps: not found.",
    )  # fmt: skip


def distances(guided: GuidedSeries, period: float) -> Panel:
    """Distance to the marker: true, as the robot believes, and wanted."""
    traces: list[Trace] = []
    lines = [
        ("true", guided.distance_true, "@ink", "solid", 1.6),
        ("estimate", guided.distance_estimate, ESTIMATE, "solid", 1.3),
        ("wanted", guided.distance_wanted, COMMAND, "dash", 1.6),
    ]
    for name, values, colour, dash, width in lines:
        if np.isfinite(values).any():
            traces.append(curve(guided.time, values, name, colour, dash=dash, width=width))
    layout = {**rows(1, ["distance (m)"]), "shapes": []}
    layout["yaxis"]["rangemode"] = "tozero"
    for start, end in stretches(guided.reports & ~guided.in_view, guided.time, period):
        layout["shapes"].append(_shade(start, end))
    return Panel(
        key="marker-distance", title="Distance to the marker", data=traces, layout=layout, height=460,
        caption=_distance_caption(guided),
    )  # fmt: skip


def _distance_caption(guided: GuidedSeries) -> str:
    text = "Horizontally, from the camera to the marker's centre. Grey: out of view."
    distance = guided.distance_true if guided.has_truth else guided.distance_estimate
    known = np.isfinite(distance) & np.isfinite(guided.distance_wanted)
    if not known.any():
        return text
    error = distance[known] - guided.distance_wanted[known]
    wanted = guided.distance_wanted[known][-1]
    return f"{text} At the end {number(error[-1], 3)} m off the wanted {wanted:.2f} m."


def _share(guided: GuidedSeries) -> float:
    """Percent of the ticks on which the newest picture showed the marker."""
    reports = guided.reports
    return 100.0 * float(np.mean(guided.in_view[reports])) if reports.any() else 0.0


def _middle(column: float) -> dict[str, object]:
    return {
        "type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": "y", "y0": column, "y1": column,
        "line": {"color": "@muted", "width": 1, "dash": "dot"},
    }  # fmt: skip


def _shade(start: float, end: float) -> dict[str, object]:
    return {
        "type": "rect", "yref": "paper", "x0": start, "x1": end, "y0": 0, "y1": 1,
        "fillcolor": GUIDED_COLOURS["blind"], "opacity": 0.14, "line": {"width": 0}, "layer": "below",
    }  # fmt: skip
