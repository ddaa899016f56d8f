"""The report's cuts through the cost tensor: what it costs to stand on each place, for three headings."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import build
from bluefoot_mpc.terrain.cost import CostConfig, cost_tensor, yaw_index, yaw_of
from bluefoot_mpc.terrain.plan_config import PlanConfig
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.crossing_series import CrossingSeries, MapAt
from bluefoot_mpc.viz.packing import pack
from bluefoot_mpc.viz.plots import Panel, Step, Trace
from bluefoot_mpc.viz.plots_terrain import extent, some_maps
from bluefoot_mpc.viz.rasters import raster_of
from bluefoot_mpc.viz.style import ROUTE

MOST_MAPS = 4
"""Maps whose costs a page shows."""
ASIDE = math.radians(20.0)
"""rad of heading to either side that the outer cuts show."""
_LEAST = 1e-3
"""Costs are shown from here: a level place costs nothing, which has no logarithm."""
_GAP = 0.045
_WIDTH, _ROOM = 1160.0, 105.0
"""px: width of a wide figure between its margins; what stands above and below."""


def cost_config(config: Mapping[str, Any]) -> CostConfig:
    """Weights of the cost as a run's controller had them; the usual ones where it recorded none that fit.

    Args:
        config: everything resolved, as a run records it.
    """
    table = config.get("control", {}).get("crossing", {}).get("plan", {}).get("cost")
    if table is None:
        return PlanConfig().cost
    try:
        return build(CostConfig, table, "control.crossing.plan.cost")
    except ConfigurationError:
        return PlanConfig().cost


def cost_slices(crossing: CrossingSeries, config: CostConfig) -> Panel | None:
    """Costs over each map, heading along it and to either side; None without maps.

    Args:
        crossing: the run.
        config: weights of the cost.
    """
    shown = some_maps(crossing.maps, MOST_MAPS)
    if not shown:
        return None
    indices = [yaw_index(yaw, config.yaws) for yaw in _headings(config)]
    cuts = [np.moveaxis(cost_tensor(entry.ground, config)[:, :, indices], -1, 0) for entry in shown]
    scale = _scale(cuts)
    steps = tuple(
        Step(
            label=f"{crossing.time[entry.tick]:.1f} s",
            note="the last map" if entry is shown[-1] else "",
            time=float(crossing.time[entry.tick]),
            data=_traces(crossing, entry, cut, scale),
        )
        for entry, cut in zip(shown, cuts, strict=True)
    )
    low, high = extent(crossing, shown)
    names = [_name(float(yaw_of(u, config.yaws))) for u in indices]
    share = (1.0 - _GAP * (len(names) - 1)) / len(names)
    height = share * _WIDTH * (high[1] - low[1]) / (high[0] - low[0]) + _ROOM
    return Panel(
        key="cost", title="Cost of standing", data=[], wide=True, time=False, steps=steps,
        height=round(float(np.clip(height, 240, 620))), layout=_layout(low, high, names, share),
        caption="Cost of standing with the trunk over each cell, for three headings, on a logarithmic scale, "
        "computed again from the cells of the map; grey: a foot would be on unknown ground. Pink: the "
        "planned way, whose feet may step beside their cells.",
    )  # fmt: skip


def _headings(config: CostConfig) -> list[float]:
    """Headings (rad) to the left, along the map and to the right; within what the planner looks at."""
    aside = min(ASIDE, config.yaw_range)
    return [aside, 0.0, -aside]


def _name(yaw: float) -> str:
    degrees = math.degrees(yaw)
    if abs(degrees) < 0.5:
        return "straight on"
    return f"{abs(degrees):.0f}° to the {'left' if degrees > 0.0 else 'right'}"


def _scale(cuts: list[FloatArray]) -> tuple[float, float]:
    """Least and greatest power of ten that the colours show, the same for all."""
    finite = np.concatenate([cut[np.isfinite(cut)] for cut in cuts])
    if not len(finite):
        return -1.0, 1.0
    low, high = np.log10(np.maximum(np.percentile(finite, [2.0, 99.5]), _LEAST)).tolist()
    return low, max(high, low + 0.5)


def _traces(
    crossing: CrossingSeries, entry: MapAt, cut: FloatArray, scale: tuple[float, float]
) -> list[Trace]:
    raster = raster_of(entry.ground)
    later = [other.tick for other in crossing.maps if other.tick > entry.tick]
    until = later[0] if later else len(crossing.time) + 1
    routes = [route.poses for route in crossing.routes if entry.tick <= route.tick < until]
    traces: list[Trace] = []
    for k, cost in enumerate(cut):
        axes = {"xaxis": f"x{k + 1}".replace("x1", "x"), "yaxis": f"y{k + 1}".replace("y1", "y")}
        stands = np.isfinite(cost)
        power = np.log10(np.where(stands, np.maximum(cost, _LEAST), np.nan))
        traces += [
            {**raster.unknown(stands, legend=False), **axes},
            raster.heatmap(
                power, colorscale="Viridis", zmin=scale[0], zmax=scale[1], showscale=k == 0, **axes,
                colorbar=_bar(scale),
                hovertemplate="x %{x:.2f} m, y %{y:.2f} m<br>cost 10<sup>%{z:.1f}</sup><extra></extra>",
            ),
        ]  # fmt: skip
        for poses in routes[-1:]:
            traces.append(
                {"type": "scatter", "mode": "lines", "x": pack(poses[:, 0]), "y": pack(poses[:, 1]), **axes,
                 "name": "planned way", "showlegend": False, "line": {"color": ROUTE, "width": 2.5},
                 "hoverinfo": "skip"}
            )  # fmt: skip
    return traces


def _bar(scale: tuple[float, float]) -> dict[str, Any]:
    # One, two and five of each decade, as numbers that a person reads.
    powers = range(math.floor(scale[0]), math.ceil(scale[1]) + 1)
    ticks = [(step, power) for power in powers for step in (1, 2, 5)]
    if scale[1] - scale[0] > 2.0:
        ticks = [tick for tick in ticks if tick[0] == 1]
    values = [math.log10(step) + power for step, power in ticks]
    texts = [f"{step * 10.0**power:g}" for step, power in ticks]
    return {"title": {"text": "cost", "side": "right"}, "thickness": 12, "len": 0.95, "outlinewidth": 0,
            "tickvals": values, "ticktext": texts}  # fmt: skip


def _layout(low: FloatArray, high: FloatArray, names: list[str], share: float) -> dict[str, Any]:
    layout: dict[str, Any] = {"hovermode": "closest", "annotations": []}
    for k, name in enumerate(names):
        number = "" if k == 0 else str(k + 1)
        start = k * (share + _GAP)
        layout[f"xaxis{number}"] = {
            "domain": [start, start + share], "range": [low[0], high[0]], "anchor": f"y{number}",
            "title": {"text": "x, forward (m)"}, "constrain": "domain",
        }  # fmt: skip
        layout[f"yaxis{number}"] = {
            "range": [low[1], high[1]], "anchor": f"x{number}", "scaleanchor": f"x{number}", "scaleratio": 1,
            "title": {"text": "y, left (m)" if k == 0 else ""}, "constrain": "domain",
        }  # fmt: skip
        layout["annotations"].append(
            {"text": f"<b>{name}</b>", "x": start + 0.5 * share, "y": 1.0, "xref": "paper", "yref": "paper",
             "xanchor": "center", "yanchor": "bottom", "showarrow": False, "font": {"size": 12}}
        )  # fmt: skip
    return layout
