"""The report's figures of crossing rough ground: phases over time, and the ground under the feet."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bluefoot_mpc.types import LEGS, FloatArray
from bluefoot_mpc.viz.crossing_series import CrossingSeries
from bluefoot_mpc.viz.crossing_truth import Profile
from bluefoot_mpc.viz.packing import pack, stretches, stride_for
from bluefoot_mpc.viz.plots import LIMIT, Panel, Trace, band, curve, name_rows
from bluefoot_mpc.viz.plots_way import smoothed
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import (
    BAD,
    COMMAND,
    ESTIMATE,
    LEG_COLOURS,
    LEG_NAMES,
    PHASE_COLOURS,
    PHASE_NAMES,
)
from bluefoot_mpc.viz.verdict import number

_MEAN = 1.2
"""s over which achieved speed is averaged: a cycle of the walk."""
_MOST_TOUCHES = 200
"""Stretches in which the body touches the ground that a figure marks."""
_BAND, _GAP = 0.035, 0.055
"""Shares of a figure's height: the band of phases, and what lies between two rows."""


def phases_over_time(series: RunSeries, crossing: CrossingSeries, period: float) -> Panel:
    """What the robot was at, its pitch, its speed and step heights, and how far the goal was."""
    found = [("pitch (°)", _pitch(crossing)), ("speed (mm/s)", _speed(series, crossing, period)),
             ("step height (mm)", _lift(crossing)), ("to the goal (m)", _distance(crossing))]  # fmt: skip
    drawn = [(title, traces) for title, traces in found if traces]
    traces = _bands(crossing, period)
    layout = _rows([title for title, _ in drawn])
    for row, (title, own) in enumerate(drawn):
        axis = layout[f"yaxis{row + 2}"]
        if title.startswith("step"):
            axis["range"] = [0.0, 1.15e3 * max(0.02, float(np.nanmax(crossing.lift)))]
        elif not title.startswith("pitch"):
            axis["rangemode"] = "tozero"
        traces += [{**trace, "yaxis": f"y{row + 2}"} for trace in own]
    touches = np.array([bool(names) for names in crossing.touching], dtype=np.bool_)
    layout["shapes"] = [band(*span, BAD) for span in stretches(touches, crossing.time, period)][
        :_MOST_TOUCHES
    ]
    return Panel(
        key="crossing", title="Crossing", data=traces, layout=layout, wide=True,
        height=120 + 130 * len(drawn),
        caption=_caption(crossing),
    )  # fmt: skip


def side_view(crossing: CrossingSeries, profiles: Sequence[Profile]) -> Panel | None:
    """Ground and feet from the side, along the way of each foot; None where no foot ever stepped."""
    if not crossing.swings:
        return None
    traces: list[Trace] = []
    layout = _side_rows(len(profiles))
    names = []
    for row, profile in enumerate(profiles):
        axis = "y" if row == 0 else f"y{row + 1}"
        low, high = _heights(profiles)
        layout["yaxis" if row == 0 else f"yaxis{row + 1}"]["range"] = [low, high]
        traces += _profile_traces(profile, axis, low, first=row == 0)
        least = f", least {number(profile.least, 0, 1e3)} mm over it" if np.isfinite(profile.least) else ""
        names.append(f"{LEG_NAMES[LEGS[profile.leg]]}{least}")
    name_rows(layout, names, [LEG_COLOURS[LEGS[profile.leg]] for profile in profiles])
    truth = any(np.isfinite(profile.true).any() for profile in profiles)
    ground = "the ground as it is (brown) and as mapped (blue)" if truth else "the ground as mapped"
    return Panel(
        key="side", title="Feet over the ground", data=traces, layout=layout, height=780, wide=True,
        time=False,
        caption=f"Lowest point of each foot along its own way, and {ground} under it, by the map in force at "
        "the time. Heights are stretched. Least height over the ground: in the middle half of the swings.",
    )  # fmt: skip


def _rows(titles: Sequence[str]) -> dict[str, Any]:
    """A narrow band above plots over one time axis."""
    layout: dict[str, Any] = {
        "yaxis": {"domain": [1.0 - _BAND, 1.0], "range": [-0.5, 0.5], "fixedrange": True, "showgrid": False,
                  "showticklabels": False, "ticks": "", "zeroline": False, "title": {"text": ""}}
    }  # fmt: skip
    share = (1.0 - _BAND) / len(titles)
    for row, title in enumerate(titles):
        top = 1.0 - _BAND - row * share
        layout[f"yaxis{row + 2}"] = {
            "domain": [max(0.0, top - share), top - _GAP],
            "title": {"text": title, "font": {"size": 11}},
        }
    layout["xaxis"] = {"title": {"text": "time (s)"}, "anchor": f"y{len(titles) + 1}"}
    return layout


def _bands(crossing: CrossingSeries, period: float) -> list[Trace]:
    """What the robot was at, as coloured bars."""
    at = np.array(crossing.phase)
    traces: list[Trace] = []
    for name, colour in PHASE_COLOURS.items():
        spans = stretches(at == name, crossing.time, period)
        if not spans:
            continue
        x = [value for start, end in spans for value in (start, end, np.nan)]
        lasted = sum(end - start for start, end in spans)
        traces.append(
            {
                "type": "scatter", "mode": "lines", "x": pack(x), "y": pack([0.0] * len(x)),
                "name": f"{PHASE_NAMES[name]}, {lasted:.1f} s", "line": {"color": colour, "width": 16},
                "hoverinfo": "name",
            }
        )  # fmt: skip
    return traces


def _pitch(crossing: CrossingSeries) -> list[Trace]:
    lines = [("wanted pitch", crossing.pitch, COMMAND, "solid"),
             ("estimate", crossing.pitch_estimate, ESTIMATE, "solid")]  # fmt: skip
    if crossing.has_truth:
        lines.append(("truth", crossing.pitch_truth, "@ink", "dot"))
    return [
        curve(crossing.time, np.degrees(values), name, colour, dash=dash, width=1.5)
        for name, values, colour, dash in lines
        if np.isfinite(values).any()
    ]


def _speed(series: RunSeries, crossing: CrossingSeries, period: float) -> list[Trace]:
    if not np.nanmax(crossing.speed, initial=0.0) > 0.0:
        return []
    speed = series.velocity_truth if series.has_truth else series.velocity_estimate
    count = max(1, round(_MEAN / period))
    allowed = curve(crossing.time, 1e3 * crossing.speed, "allowed speed", COMMAND, width=1.6)
    name = f"achieved (mean of {_MEAN:g} s)"
    return [
        curve(crossing.time, 1e3 * smoothed(speed[:, 0], count), name, "@ink", width=1.3),
        {**allowed, "line": {**allowed["line"], "shape": "hv"}},
    ]


def _lift(crossing: CrossingSeries) -> list[Trace]:
    """Legs wear their colours on the whole page, and need no legend."""
    return [
        {**curve(crossing.time, 1e3 * crossing.lift[:, leg], name, LEG_COLOURS[name]), "showlegend": False}
        for leg, name in enumerate(LEGS)
        if np.isfinite(crossing.lift[:, leg]).any() and crossing.swings
    ]


def _distance(crossing: CrossingSeries) -> list[Trace]:
    if not np.isfinite(crossing.goal).all():
        return []
    ways = [("estimate", crossing.estimate, ESTIMATE, "solid")]
    if crossing.has_truth:
        ways.append(("truth", crossing.position, "@ink", "dot"))
    traces = []
    for name, way, colour, dash in ways:
        left = np.hypot(*(way[:, :2] - crossing.goal).T)
        trace = curve(crossing.time, left, name, colour, dash=dash, width=1.5)
        traces.append({**trace, "showlegend": False})
    return traces


def _caption(crossing: CrossingSeries) -> str:
    said = []
    blocked = [k for k, name in enumerate(crossing.phase) if name == "blocked"]
    if blocked:
        reason = next((crossing.reason[k] for k in blocked if crossing.reason[k]), "no reason given")
        said.append(f"Blocked at {crossing.time[blocked[0]]:.1f} s: {reason}.")
    if any(crossing.touching):
        said.append("Red: a part of the robot other than its feet touches the ground.")
    known = crossing.drift[np.isfinite(crossing.drift)]
    moved = f", which corrected older maps by up to {1e3 * known.max():.0f} mm" if known.any() else ""
    said.append(f"{crossing.sweeps} sweep{'' if crossing.sweeps == 1 else 's'}{moved}.")
    said.append("Pitch: nose down is positive.")
    if crossing.swings:
        said.append(
            "Speed: as the difficulty of the ground allows; heights of the next steps in the legs' colours."
        )
    return " ".join(said)


def _side_rows(count: int) -> dict[str, Any]:
    gap = 0.075
    share = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {}
    for row in range(count):
        top = 1.0 - row * (share + gap)
        layout["yaxis" if row == 0 else f"yaxis{row + 1}"] = {
            "domain": [max(0.0, top - share), top],
            "title": {"text": "height (mm)", "font": {"size": 11}},
        }
    anchor = "y" if count == 1 else f"y{count}"
    layout["xaxis"] = {"title": {"text": "x, forward at the start (m)"}, "anchor": anchor}
    layout["hovermode"] = "closest"
    return layout


def _heights(profiles: Sequence[Profile]) -> tuple[float, float]:
    """Millimetres that all rows show; without what is rare."""
    pieces = [values for p in profiles for values in (p.true, p.foot[:, 1])]
    table = 1e3 * np.concatenate(pieces)
    table = table[np.isfinite(table)]
    if not len(table):
        return -10.0, 40.0
    low, high = np.percentile(table, [0.2, 99.8]).tolist()
    return min(low, 0.0) - 8.0, max(high, 20.0) + 8.0


def _profile_traces(profile: Profile, axis: str, low: float, *, first: bool) -> list[Trace]:
    traces: list[Trace] = []
    if np.isfinite(profile.true).any():
        x, true = _ordered(profile.ground_x, profile.true)
        # The ground is filled down to the figure's edge: zero may be above it.
        edge = _side(x[[0, -1]], np.full(2, low / 1e3), "edge", "rgba(0,0,0,0)", axis, 0.0)
        traces += [
            {**edge, "showlegend": False, "hoverinfo": "skip"},
            {**_side(x, np.maximum(true, low / 1e3), "ground", "#8a6d4a", axis, 1.4), "fill": "tonexty",
             "fillcolor": "rgba(154,122,82,0.20)", "legendgroup": "ground", "showlegend": first},
        ]  # fmt: skip
    if np.isfinite(profile.mapped).any():
        x, mapped = _ordered(profile.ground_x, profile.mapped)
        traces.append({**_side(x, mapped, "map", ESTIMATE, axis, 1.3), "legendgroup": "map",
                       "showlegend": first})  # fmt: skip
    name = LEGS[profile.leg]
    pick = slice(None, None, stride_for(len(profile.time), 2 * LIMIT))
    times, foot = profile.time[pick], profile.foot[pick]
    trace = _side(foot[:, 0], foot[:, 1], name, LEG_COLOURS[name], axis, 1.6)
    trace["customdata"] = pack(times[:, None])
    trace["hovertemplate"] = "%{customdata[0]:.1f} s<br>x %{x:.3f} m, %{y:.0f} mm<extra></extra>"
    return [*traces, {**trace, "showlegend": False}]


def _ordered(x: FloatArray, z: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Samples of the first visit to each x: a foot that steps back would draw the ground twice."""
    ahead = x if x[-1] >= x[0] else -x
    first = np.concatenate([[True], ahead[1:] > np.maximum.accumulate(ahead)[:-1]])
    return x[first], z[first]


def _side(x: FloatArray, z: FloatArray, name: str, colour: str, axis: str, width: float) -> Trace:
    return {
        "type": "scatter", "mode": "lines", "x": pack(x), "y": pack(1e3 * z), "name": name, "yaxis": axis,
        "line": {"color": colour, "width": width},
        "hovertemplate": f"{name}<br>x %{{x:.3f}} m, %{{y:.0f}} mm<extra></extra>",
    }  # fmt: skip
