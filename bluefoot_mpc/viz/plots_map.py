"""The report's map: the world from above, the robot's way through it, and what led it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from bluefoot_mpc.geometry import convex_hull
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.viz.guided_series import GuidedSeries
from bluefoot_mpc.viz.packing import pack, stride_for
from bluefoot_mpc.viz.plots import LIMIT, Panel, Trace
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import BAD, GUIDED_COLOURS, GUIDED_NAMES, LEADER, MARKER, NEUTRAL
from bluefoot_mpc.viz.surroundings import css_colour, hangs_over, outline

_TOLD = "no task"
_LEAST_SIDE = 2.0
"""m that a map shows at least, each way."""
_EDGE = 0.3
"""m around the drawn things."""


def world_map(
    series: RunSeries,
    guided: GuidedSeries,
    plan: WorldPlan | None,
    cloud: FloatArray,
    seen: Sequence[Trace] = (),
) -> Panel:
    """The map.

    Args:
        series: the run.
        guided: how it found its way.
        plan: of its world; None draws what the LIDAR met instead.
        cloud: (m, 2) m, what the LIDAR met, in the odometry frame.
        seen: traces of the floor that was seen, to lie under everything.
    """
    traces = [*seen, *(solid_traces(plan.solids) if plan is not None else [])]
    if len(cloud):
        traces.append(_scanned(cloud, is_map=plan is None))
    traces += [*_ways(guided), *_way_points(guided), *_marker_and_leader(guided, plan)]
    traces += [*_closest(series, guided), *_ends(guided)]
    about = "as they stand in the world" if plan is not None else "as the LIDAR found them"
    estimate = (
        "; dashed: where the robot believed to be, which is all that it steers by"
        if guided.has_truth
        else ", as the robot estimated it"
    )
    return Panel(
        key="map", title="Map", data=traces, layout=_layout(guided, plan, cloud), height=560, time=False,
        follows=True,
        caption=f"Things {about}; the way, coloured by what led{estimate}. "
        "Press the way to go there in the replay.",
    )  # fmt: skip


def solid_traces(solids: Iterable[Solid]) -> list[Trace]:
    """Outlines of solids, those of one colour together; what hangs overhead is dashed and not filled."""
    groups: dict[tuple[tuple[float, float, float], bool], list[Solid]] = {}
    for solid in solids:
        groups.setdefault((solid.colour, hangs_over(solid)), []).append(solid)
    traces = []
    for (colour, overhead), members in groups.items():
        gap = np.full((1, 2), np.nan)
        rings = [outline(solid) for solid in members]
        points = np.concatenate([piece for ring in rings for piece in (ring, ring[:1], gap)])
        line = {"color": css_colour(colour), "width": 1.2, "dash": "dot" if overhead else "solid"}
        traces.append(
            {
                **_lines(points, "overhead" if overhead else "things", line),
                "fill": "none" if overhead else "toself",
                "fillcolor": css_colour(colour, 0.75),
                "hoverinfo": "text",
                "hovertext": ", ".join(solid.name for solid in members[:8]),
                "showlegend": False,
            }
        )
    return traces


def _ways(guided: GuidedSeries) -> list[Trace]:
    """True way by what led, and the estimated one."""
    traces: list[Trace] = []
    if guided.has_truth:
        line = {"color": "@muted", "width": 1.3, "dash": "dash"}
        pick = slice(None, None, stride_for(len(guided.time), LIMIT))
        traces.append({**_lines(guided.estimate[pick], "estimate", line), "hoverinfo": "skip"})
    leads = np.array(guided.guided)
    for name in ["", *GUIDED_COLOURS]:
        active = leads == name
        if active.any():
            traces.append(_way(guided, active, name))
    return traces


def _way(guided: GuidedSeries, active: BoolArray, name: str) -> Trace:
    """The stretches of the way on which one thing led, each joined to the next."""
    joined = active | np.concatenate([[False], active[:-1]])
    stride = stride_for(len(active), LIMIT)
    pick = np.flatnonzero(joined & (np.arange(len(active)) % stride == 0))
    # Where the thinned stretches leave ticks out, the line is broken.
    breaks = np.flatnonzero(np.diff(pick) > stride) + 1
    points = np.insert(guided.position[pick], breaks, np.nan, axis=0)
    facts = np.column_stack([guided.time[pick], guided.clearance[pick]])
    facts = np.insert(facts, breaks, np.nan, axis=0)
    line = {"color": GUIDED_COLOURS.get(name, NEUTRAL), "width": 3 if name else 1.6}
    title = GUIDED_NAMES.get(name, _TOLD)
    return {
        **_lines(points, title, line),
        "customdata": pack(facts),
        "hovertemplate": f"%{{customdata[0]:.1f}} s, {title}<br>x %{{x:.2f}} m, y %{{y:.2f}} m"
        "<br>nearest thing %{customdata[1]:.2f} m<extra></extra>",
    }


def _way_points(guided: GuidedSeries) -> list[Trace]:
    if not len(guided.waypoints):
        return []
    x, y = guided.waypoints.T
    numbers = [str(k + 1) for k in range(len(x))]
    marker = {"symbol": "circle", "size": 19, "color": "@card", "line": {"color": "#6b5bd2", "width": 2}}
    return [{**_points(x, y, "waypoints", marker), "text": numbers, "mode": "markers+text"}]


def _marker_and_leader(guided: GuidedSeries, plan: WorldPlan | None) -> list[Trace]:
    traces: list[Trace] = []
    if guided.has_leader:
        pick = slice(None, None, stride_for(len(guided.time), LIMIT))
        line = {"color": LEADER, "width": 1.8, "dash": "dashdot"}
        traces.append({**_lines(guided.leader[pick, :2], "leader", line), "hoverinfo": "name"})
        last = guided.leader[np.flatnonzero(np.isfinite(guided.leader[:, 0]))[-1]]
        shape = {"symbol": "square", "size": 9, "color": LEADER}
        traces.append({**_points(last[:1], last[1:2], "leader at the end", shape), "showlegend": False})
    elif plan is not None and plan.marker is not None:
        disc = {"symbol": "circle", "size": 13, "color": MARKER, "line": {"color": "@card", "width": 2}}
        traces.append(_points([plan.marker.x], [plan.marker.y], "marker", disc))
    return traces if guided.has_leader else [*traces, *_believed_marker(guided)]


def _believed_marker(guided: GuidedSeries) -> list[Trace]:
    """Where the robot believes a marker that stands: in the odometry frame, as last seen."""
    known = np.flatnonzero(np.isfinite(guided.marker_estimate[:, 0]))
    if not len(known):
        return []
    x, y = guided.marker_estimate[known[-1], :2]
    ring = {"symbol": "circle-open", "size": 13, "color": MARKER, "line": {"width": 2}}
    return [_points([x], [y], "marker, as last seen", ring)]


def _closest(series: RunSeries, guided: GuidedSeries) -> list[Trace]:
    """The robot's outline where it came nearest to a thing."""
    tick = guided.closest
    if tick is None:
        return []
    feet = convex_hull(series.feet[tick, :, :2])
    ring = np.concatenate([feet, feet[:1]])
    text = f"closest, {1e3 * guided.clearance[tick]:.0f} mm"
    trace = _lines(ring, text, {"color": BAD, "width": 1.6})
    facts = [[float(guided.time[tick]), float(guided.clearance[tick])]] * len(ring)
    return [
        {
            **trace,
            "fill": "toself",
            "fillcolor": "rgba(209,73,91,0.16)",
            "customdata": facts,
            "hovertemplate": "closest approach<br>%{customdata[0]:.1f} s, "
            "%{customdata[1]:.3f} m<extra></extra>",
        }
    ]


def _ends(guided: GuidedSeries) -> list[Trace]:
    traces = []
    for name, tick, fill, edge in (("start", 0, "@card", "@ink"), ("end", -1, "@ink", "@card")):
        disc = {"symbol": "circle", "size": 10, "color": fill, "line": {"color": edge, "width": 2}}
        trace = _points(guided.position[[tick], 0], guided.position[[tick], 1], name, disc)
        traces.append({**trace, "customdata": [[float(guided.time[tick])]]})
    return traces


def _scanned(cloud: FloatArray, *, is_map: bool) -> Trace:
    marker = {"size": 3, "color": "@ink" if is_map else "@muted", "opacity": 0.8 if is_map else 0.5}
    trace = _points(cloud[:, 0], cloud[:, 1], "LIDAR" if is_map else "LIDAR, as estimated", marker)
    # With a plan it would hide what it should be compared with, so it waits in the legend.
    return {**trace, "type": "scattergl", "hoverinfo": "skip", "visible": True if is_map else "legendonly"}


def _layout(guided: GuidedSeries, plan: WorldPlan | None, cloud: FloatArray) -> dict[str, Any]:
    shown = [guided.position, guided.estimate, cloud, guided.waypoints]
    if plan is not None:
        shown += [np.reshape(plan.bounds, (2, 2)), *(outline(solid) for solid in plan.solids)]
    points = np.concatenate(shown)
    low, high = np.nanmin(points, axis=0) - _EDGE, np.nanmax(points, axis=0) + _EDGE
    more = np.maximum(0.0, 0.5 * (_LEAST_SIDE - (high - low)))
    low, high = low - more, high + more
    return {
        "xaxis": {"title": {"text": "x, forward at the start (m)"}, "range": [low[0], high[0]]},
        "yaxis": {
            "title": {"text": "y, left (m)"},
            "range": [low[1], high[1]],
            "scaleanchor": "x",
            "scaleratio": 1,
        },
        "hovermode": "closest",
    }


def _lines(points: FloatArray, name: str, line: dict[str, Any]) -> Trace:
    return {
        "type": "scatter", "mode": "lines", "x": pack(points[:, 0]), "y": pack(points[:, 1]),
        "name": name, "line": line,
    }  # fmt: skip


def _points(x: Any, y: Any, name: str, marker: dict[str, Any]) -> Trace:
    return {
        "type": "scatter", "mode": "markers", "x": pack(x), "y": pack(y), "name": name,
        "marker": marker, "hovertemplate": f"{name}<br>x %{{x:.2f}} m, y %{{y:.2f}} m<extra></extra>",
    }  # fmt: skip
