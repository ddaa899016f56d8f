"""The report's figures of the trunk's and the feet's motion, as plain plotly dictionaries.

Colours that begin with ``@`` name a colour of the page, which changes with its
light or dark theme. Every time axis is in seconds from the first tick.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from bluefoot_mpc.types import LEGS, FloatArray
from bluefoot_mpc.viz.packing import envelope, pack, stretches
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import COMMAND, ESTIMATE, LEG_COLOURS, NEUTRAL

LIMIT = 4000
"""Most points of one line."""

_EVEN = 1e-3
"""Share of a step that times may differ from evenly spaced ones."""

Trace = dict[str, Any]


@dataclass(frozen=True, kw_only=True, slots=True)
class Step:
    """One of several instants that a figure can show.

    Attributes:
        label: on its button.
        note: what is special about it; shown when one points at the button.
        time: s.
        data: plotly traces in place of the panel's.
    """

    label: str
    note: str
    time: float
    data: list[Trace]


@dataclass(frozen=True, kw_only=True, slots=True)
class Panel:
    """One figure of the report.

    Attributes:
        key: its anchor in the page.
        title: heading.
        caption: what it shows and how to read it.
        data: plotly traces.
        layout: plotly layout.
        height: px.
        wide: True for the full width of the page.
        time: True when x is the run's time, so that it takes part in zoom and cursor.
        window: s shown at a time, paging along with the replay; 0 shows the whole run.
        steps: instants to choose from; `data` is what the first of them shows.
        follows: True for a map in world coordinates, on which the replayed robot is marked.
    """

    key: str
    title: str
    caption: str
    data: list[Trace]
    layout: dict[str, Any] = field(default_factory=dict)
    height: int = 300
    wide: bool = False
    time: bool = True
    window: float = 0.0
    steps: tuple[Step, ...] = ()
    follows: bool = False


def curve(
    x: FloatArray,
    y: FloatArray,
    name: str,
    colour: str,
    *,
    axis: str = "y",
    dash: str = "solid",
    width: float = 1.6,
) -> Trace:
    """A line over time; very long ones keep their peaks and lose the points between."""
    times, values = envelope(x, np.asarray(y, dtype=np.float64)[:, None], LIMIT)
    return {
        "type": "scatter",
        "mode": "lines",
        **_along(times),
        "y": pack(values[:, 0]),
        "name": name,
        "yaxis": axis,
        "line": {"color": colour, "dash": dash, "width": width},
        "hovertemplate": "%{y:.3g}",
    }


def _along(times: FloatArray) -> Trace:
    """Times of a line; evenly spaced ones, as a simulator's are, as a start and a step."""
    if len(times) > 2:
        step = float(times[-1] - times[0]) / (len(times) - 1)
        if step > 0.0 and np.abs(np.diff(times) - step).max() < _EVEN * step:
            return {"x0": float(times[0]), "dx": step}
    return {"x": pack(times)}


def rows(count: int, titles: list[str], gap: float = 0.09) -> dict[str, Any]:
    """Layout of `count` plots above each other that share the time axis; the first is on top."""
    share = (1.0 - gap * (count - 1)) / count
    layout: dict[str, Any] = {}
    for index, title in enumerate(titles):
        top = 1.0 - index * (share + gap)
        name = "yaxis" if index == 0 else f"yaxis{index + 1}"
        layout[name] = {
            "domain": [max(0.0, top - share), top],
            "title": {"text": title, "font": {"size": 11}},
        }
    anchor = "y" if count == 1 else f"y{count}"
    layout["xaxis"] = {"title": {"text": "time (s)"}, "anchor": anchor}
    return layout


def name_rows(layout: dict[str, Any], names: list[str], colours: list[str]) -> None:
    """Write a name into the upper right corner of each of the plots above each other."""
    layout["annotations"] = [
        {
            "x": 1.0,
            "y": layout["yaxis" if index == 0 else f"yaxis{index + 1}"]["domain"][1],
            "xref": "paper",
            "yref": "paper",
            "xanchor": "right",
            "yanchor": "bottom",
            "text": f"<b>{name}</b>",
            "showarrow": False,
            "font": {"size": 12, **({} if colour.startswith("@") else {"color": colour})},
        }
        for index, (name, colour) in enumerate(zip(names, colours, strict=True))
    ]


def band(start: float, end: float, colour: str) -> dict[str, Any]:
    """A shape over the whole height: a stretch of time (s), or a line where it has no length."""
    if start == end:
        line = {"color": colour, "width": 1, "dash": "dot"}
        return {"type": "line", "yref": "paper", "x0": start, "x1": end, "y0": 0, "y1": 1, "line": line}
    return {
        "type": "rect",
        "yref": "paper",
        "x0": start,
        "x1": end,
        "y0": 0,
        "y1": 1,
        "fillcolor": colour,
        "opacity": 0.25,
        "line": {"width": 0},
        "layer": "below",
    }


def footfall(series: RunSeries, period: float) -> Panel:
    """Gait diagram: scheduled stance as wide pale bars, contact as narrow full ones."""
    traces: list[Trace] = []
    for index, leg in enumerate(LEGS):
        level = float(len(LEGS) - 1 - index)
        for active, width, opacity, kind in (
            (series.scheduled[:, index], 22, 0.28, "scheduled"),
            (series.loaded[:, index] if series.has_truth else series.switch[:, index], 8, 1.0, "measured"),
        ):
            spans = stretches(active, series.time, period)
            x = [value for a, b in spans for value in (a, b, np.nan)]
            traces.append(
                {
                    "type": "scatter",
                    "mode": "lines",
                    "x": pack(x),
                    "y": pack([level] * len(x)),
                    "name": f"{leg} {kind}",
                    "legendgroup": kind,
                    "showlegend": False,
                    "opacity": opacity,
                    "line": {"color": LEG_COLOURS[leg], "width": width},
                    "hoverinfo": "x+name",
                }
            )
    window = gait_window(series)
    layout = {
        "yaxis": {
            "tickvals": [3, 2, 1, 0],
            "ticktext": list(LEGS),
            "range": [-0.6, 3.6],
            "fixedrange": True,
            "showgrid": False,
        },
        "xaxis": {"title": {"text": "time (s)"}, "range": window},
        "hovermode": "closest",
        "margin": {"t": 8},
    }
    source = "ground force" if series.has_truth else "foot switches"
    return Panel(
        key="footfall",
        title="Footfall",
        data=traces,
        layout=layout,
        height=230,
        wide=True,
        window=window[1] - window[0],
        caption=f"Wide pale bars: the gait wants the foot to stand. Narrow bars: it does ({source}). "
        "Turns its pages with the replay.",
    )


def attitude(series: RunSeries) -> Panel:
    """Roll, pitch and yaw: truth, estimate and command."""
    traces: list[Trace] = []
    degrees = np.degrees
    for index in range(3):
        axis = "y" if index == 0 else f"y{index + 1}"
        lines = [("estimate", series.rpy_estimate, ESTIMATE, "solid", 1.4)]
        if series.has_truth:
            lines.insert(0, ("truth", series.rpy_truth, "@ink", "solid", 1.6))
        if index < 2:
            lines.append(("commanded", series.rpy_command, COMMAND, "dash", 1.6))
        for name, values, colour, dash, width in lines:
            angle = np.unwrap(values[:, index]) if index == 2 else values[:, index]
            trace = curve(series.time, degrees(angle), name, colour, axis=axis, dash=dash, width=width)
            traces.append({**trace, "legendgroup": name, "showlegend": index == 0})
    layout = rows(3, ["roll (°)", "pitch (°)", "yaw (°)"])
    return Panel(
        key="attitude",
        title="Trunk attitude",
        data=traces,
        layout=layout,
        height=460,
        wide=True,
        caption="Roll: right side down is positive; pitch: nose down; yaw: left.",
    )


def motion(series: RunSeries) -> Panel:
    """Speeds of the trunk against their commands, and its height."""
    traces: list[Trace] = []
    for index, axis in ((0, "y"), (1, "y2")):
        if series.has_truth:
            traces.append(
                curve(
                    series.time, 1e3 * series.velocity_truth[:, index], "truth", "@ink", axis=axis, width=1.2
                )
            )
        traces.append(
            curve(
                series.time,
                1e3 * series.velocity_estimate[:, index],
                "estimate",
                ESTIMATE,
                axis=axis,
                width=1.2,
            )
        )
        traces.append(
            curve(
                series.time,
                1e3 * series.velocity_command[:, index],
                "commanded",
                COMMAND,
                axis=axis,
                dash="dash",
            )
        )
    for trace in traces[len(traces) // 2 :]:
        trace["showlegend"] = False
    traces.append(
        {**curve(series.time, 1e3 * series.height, "height", NEUTRAL, axis="y3"), "showlegend": False}
    )
    return Panel(
        key="motion",
        title="Trunk speed and height",
        data=traces,
        height=430,
        layout=rows(3, ["forward (mm/s)", "left (mm/s)", "height (mm)"]),
        caption="In the trunk's own heading.",
    )


def gait_window(series: RunSeries) -> list[float]:
    """A few cycles to begin with: the window of the run that the replay starts in."""
    width = min(6.0, max(series.duration, 0.1))
    start = width * np.floor(replay_start(series) / width)
    return [float(start), float(start + width)]


def replay_start(series: RunSeries) -> float:
    """Time (s) at which the replay opens: just before the robot first walks."""
    moving = np.flatnonzero(series.walking)
    return max(0.0, float(series.time[moving[0]]) - 0.3) if len(moving) else 0.0
