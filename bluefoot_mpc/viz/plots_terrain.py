"""The report's maps of the ground: heights as the robot knew them, ways over them, their errors."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bluefoot_mpc.types import LEGS, FloatArray, HeightMap
from bluefoot_mpc.viz.crossing_series import CrossingSeries, MapAt
from bluefoot_mpc.viz.crossing_truth import REACH, MapError
from bluefoot_mpc.viz.packing import pack, stride_for
from bluefoot_mpc.viz.plots import Panel, Step, Trace
from bluefoot_mpc.viz.rasters import Raster, bounds, raster_of, together
from bluefoot_mpc.viz.style import COMMAND, LEG_COLOURS, ROUTE

MOST_MAPS = 8
"""Maps that a page shows; of more, the first, the last, and some between."""
HEIGHTS = [[0.0, "#23466e"], [0.25, "#6f9cc4"], [0.5, "#f1ede4"], [0.75, "#c99655"], [1.0, "#6e3d12"]]
"""Blue below the ground at the start, brown above it."""
_LEAST_SCALE = 20.0
"""mm of height that the colours span at least, each way."""
_WAY = 600
"""Most points of a way on a map, which every map's picture repeats."""
_WIDTH, _ROOM = 1130.0, 118.0
"""px: width of a wide figure between its margins; what stands above and below a map."""
_EDGE = 0.06
"""m around the drawn things."""


def height_map(crossing: CrossingSeries) -> Panel:
    """Heights as mapped after each sweep; ways, footholds and landings on them."""
    shown = some_maps(crossing.maps)
    over = [*_ways(crossing), *_feet(crossing), *_goal(crossing)]
    low, high = extent(crossing, shown)
    span = span_of(shown)
    steps = tuple(
        Step(
            label=f"{crossing.time[entry.tick]:.1f} s",
            note="the last map" if entry is shown[-1] else "",
            time=float(crossing.time[entry.tick]),
            data=[*_heights(_until(shown, entry), span), *_routes(crossing, entry.tick), *over],
        )
        for entry in shown
    )
    # The page draws one of the steps; what they show need not be there twice.
    data = [] if steps else [*_routes(crossing, len(crossing.time)), *over]
    height = _WIDTH * (high[1] - low[1]) / (high[0] - low[0]) + _ROOM
    return Panel(
        key="ground", title="Ground as mapped", data=data, wide=True, time=False, follows=True,
        layout=_layout(low, high), height=round(float(np.clip(height, 340, 700))), steps=steps,
        caption=_caption(crossing),
    )  # fmt: skip


def map_quality(crossing: CrossingSeries, errors: Sequence[MapError]) -> Panel | None:
    """Errors of the maps where the truth is known, else how far they are to be trusted; None without maps."""
    shown = some_maps(crossing.maps)
    if not shown:
        return None
    known = {error.tick: error for error in errors}
    steps = tuple(
        Step(
            label=f"{crossing.time[entry.tick]:.1f} s",
            note="the last map" if entry is shown[-1] else "",
            time=float(crossing.time[entry.tick]),
            data=_quality(entry, known.get(entry.tick)),
        )
        for entry in shown
    )
    return Panel(
        key="map-quality", title="Error of the map" if errors else "Confidence of the map",
        data=[], time=False, height=400, steps=steps, layout=_layout(*_around(shown)),
        caption=_quality_caption(errors),
    )  # fmt: skip


def some_maps(maps: Sequence[MapAt], most: int = MOST_MAPS) -> list[MapAt]:
    """At most so many maps, the first and the last among them."""
    if len(maps) <= most:
        return list(maps)
    return [maps[k] for k in np.unique(np.linspace(0, len(maps) - 1, most).round().astype(int))]


def _until(shown: Sequence[MapAt], entry: MapAt) -> HeightMap:
    """What was known of the ground when a map was new: the older ones show where it ends."""
    return together([other.ground for other in shown if other.tick <= entry.tick])


def _heights(ground: HeightMap, span: float) -> list[Trace]:
    raster = raster_of(ground)
    millimetres = 1e3 * (ground.height + ground.pose[2])
    return [
        raster.unknown(np.isfinite(ground.height)),
        raster.heatmap(
            millimetres, colorscale=HEIGHTS, zmin=-span, zmax=span, colorbar=_bar("height (mm)"),
            hovertemplate="x %{x:.2f} m, y %{y:.2f} m<br>height %{z:.0f} mm<extra></extra>", name="height",
        ),
    ]  # fmt: skip


def _quality(entry: MapAt, error: MapError | None) -> list[Trace]:
    ground = entry.ground
    raster: Raster = raster_of(ground)
    unknown = raster.unknown(np.isfinite(ground.height))
    if error is None:
        values = np.where(np.isfinite(ground.height), ground.confidence, np.nan)
        hover = "x %{x:.2f} m, y %{y:.2f} m<br>confidence %{z:.2f}<extra></extra>"
        return [unknown, raster.heatmap(values, colorscale="Viridis", zmin=0.0, zmax=1.0,
                                        colorbar=_bar("confidence"), hovertemplate=hover)]  # fmt: skip
    scale = [[0.0, "#1273c4"], [0.5, "#eef0f2"], [1.0, "#b3273c"]]
    hover = "x %{x:.2f} m, y %{y:.2f} m<br>error %{z:.1f} mm<extra></extra>"
    return [unknown, raster.heatmap(1e3 * error.values, colorscale=scale, zmin=-15.0, zmax=15.0,
                                    colorbar=_bar("error (mm)"), hovertemplate=hover)]  # fmt: skip


def _quality_caption(errors: Sequence[MapError]) -> str:
    if not errors:
        return "0: not to be trusted, 1: fully; grey cells are unknown. The truth was not known."
    last = errors[-1]
    if not last.cells:
        return "Mapped less true height; the last map saw nothing near the robot."
    return (
        f"Mapped less true height, laid where the robot truly stood; red is mapped too high. Last map, cells "
        f"seen within {REACH:g} m: median {1e3 * last.median:.1f} mm, 95 % within {1e3 * last.most:.1f} mm."
    )


def _routes(crossing: CrossingSeries, tick: int) -> list[Trace]:
    """The way planned over a map, and pale those before it."""
    # A route is planned some ticks after its map was new, and before the next map is.
    later = [entry.tick for entry in crossing.maps if entry.tick > tick]
    until = later[0] if later else len(crossing.time) + 1
    known = [route.poses[:, :2] for route in crossing.routes if route.tick < until]
    traces: list[Trace] = []
    if len(known) > 1:
        gap = np.full((1, 2), np.nan)
        points = np.concatenate([piece for route in known[:-1] for piece in (route, gap)])
        line = {"color": ROUTE, "width": 1.2, "dash": "dot"}
        traces.append({**_lines(points, "planned before", line), "hoverinfo": "skip"})
    if known:
        traces.append(_lines(known[-1], "planned way", {"color": ROUTE, "width": 3}))
    return traces


def _ways(crossing: CrossingSeries) -> list[Trace]:
    """True and estimated way of the trunk; pressing the former leads the replay."""
    pick = slice(None, None, stride_for(len(crossing.time), _WAY))
    traces: list[Trace] = []
    if crossing.has_truth:
        line = {"color": "#1a212b", "width": 1.2, "dash": "dash"}
        traces.append({**_lines(crossing.estimate[pick], "estimate", line), "hoverinfo": "skip"})
    trace = _lines(crossing.position[pick], "walked way", {"color": "#1a212b", "width": 2})
    trace["customdata"] = pack(crossing.time[pick, None])
    trace["hovertemplate"] = "%{customdata[0]:.1f} s<br>x %{x:.2f} m, y %{y:.2f} m<extra></extra>"
    return [*traces, trace]


def _feet(crossing: CrossingSeries) -> list[Trace]:
    """Chosen footholds as rings, landings as discs, both in the odometry frame."""
    traces: list[Trace] = []
    for leg, name in enumerate(LEGS):
        swings = [swing for swing in crossing.swings if swing.leg == leg]
        chosen = [swing.chosen for swing in swings if np.isfinite(swing.chosen[:2]).all()]
        ring = {"symbol": "circle-open", "size": 10, "color": LEG_COLOURS[name], "line": {"width": 2}}
        disc = {"symbol": "circle", "size": 6, "color": LEG_COLOURS[name]}
        disc["line"] = {"color": "#ffffff", "width": 0.8}
        rows = [(chosen, ring, "foothold"), ([swing.landing for swing in swings], disc, "landing")]
        for places, marker, kind in rows:
            if not places:
                continue
            x, y, z = np.array(places).T
            traces.append(
                {
                    "type": "scatter", "mode": "markers", "x": pack(x), "y": pack(y), "marker": marker,
                    "name": f"{name} {kind}", "legendgroup": name, "customdata": pack(1e3 * z[:, None]),
                    "hovertemplate": f"{name} {kind}<br>x %{{x:.3f}} m, y %{{y:.3f}} m"
                    "<br>height %{customdata[0]:.0f} mm<extra></extra>",
                    "showlegend": kind == "landing" or not swings,
                }
            )  # fmt: skip
            traces[-1]["name"] = name if kind == "landing" else f"{name} {kind}"
    return traces


def _goal(crossing: CrossingSeries) -> list[Trace]:
    if not np.isfinite(crossing.goal).all():
        return []
    x, y = crossing.goal
    marker = {"symbol": "star", "size": 15, "color": COMMAND, "line": {"color": "#ffffff", "width": 1.2}}
    return [
        {
            "type": "scatter", "mode": "markers", "x": [float(x)], "y": [float(y)], "marker": marker,
            "name": "goal", "hovertemplate": "goal<br>x %{x:.2f} m, y %{y:.2f} m<extra></extra>",
        }
    ]  # fmt: skip


def _caption(crossing: CrossingSeries) -> str:
    if not crossing.maps:
        return "No map was ever built: only the way is shown, in the odometry frame."
    missed = np.array([swing.missed for swing in crossing.swings])
    missed = missed[np.isfinite(missed)]
    steps = ""
    if len(missed):
        steps = (
            f" Rings: chosen footholds, discs: landings as estimated, {1e3 * np.median(missed):.0f} mm "
            f"apart (median; 95 % within {1e3 * np.percentile(missed, 95):.0f} mm)."
        )
    dashed = "; dashed: where the robot believed to be" if crossing.has_truth else ""
    return (
        "Odometry frame, heights over the ground at the start; grey cells are unknown, older maps show where "
        f"the newest ends. Lines: planned and walked way{dashed}.{steps} One button for each map."
    )


def span_of(shown: Sequence[MapAt]) -> float:
    """Millimetres of height, up and down, that the colours span for all of some maps."""
    heights = [np.abs(entry.ground.height + entry.ground.pose[2]).ravel() for entry in shown]
    table = 1e3 * np.concatenate([np.zeros(1), *heights])
    return max(_LEAST_SCALE, float(np.nanpercentile(table, 99.5)))


def extent(crossing: CrossingSeries, shown: Sequence[MapAt]) -> tuple[FloatArray, FloatArray]:
    """(2,) and (2,) m, least and greatest x and y of what a map of the run shows."""
    corners = [corner for entry in shown for corner in bounds(entry.ground)]
    pieces = [crossing.position[:, :2], crossing.feet_estimate[:, :, :2].reshape(-1, 2), crossing.goal[None]]
    points = np.concatenate([*pieces, np.reshape(corners, (-1, 2))])
    return np.nanmin(points, axis=0) - _EDGE, np.nanmax(points, axis=0) + _EDGE


def _around(shown: Sequence[MapAt]) -> tuple[FloatArray, FloatArray]:
    corners = np.reshape([corner for entry in shown for corner in bounds(entry.ground)], (-1, 2))
    return corners.min(axis=0) - _EDGE, corners.max(axis=0) + _EDGE


def _layout(low: FloatArray, high: FloatArray) -> dict[str, Any]:
    return {
        "xaxis": {"title": {"text": "x, forward at the start (m)"}, "range": [low[0], high[0]],
                  "constrain": "domain"},
        "yaxis": {"title": {"text": "y, left (m)"}, "range": [low[1], high[1]], "scaleanchor": "x",
                  "scaleratio": 1, "constrain": "domain"},
        "hovermode": "closest",
    }  # fmt: skip


def _bar(title: str) -> dict[str, Any]:
    return {"title": {"text": title, "side": "right"}, "thickness": 12, "len": 0.9, "outlinewidth": 0}


def _lines(points: FloatArray, name: str, line: dict[str, Any]) -> Trace:
    return {
        "type": "scatter", "mode": "lines", "x": pack(points[:, 0]), "y": pack(points[:, 1]),
        "name": name, "line": line,
    }  # fmt: skip
