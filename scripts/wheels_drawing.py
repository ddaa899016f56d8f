"""Drawing and HTML for scripts/wheels.py: robots seen from above (forward is up), curves, tables."""

from __future__ import annotations

import html
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

from bluefoot_mpc.geometry import convex_hull
from bluefoot_mpc.viz.style import BAD, COMMAND, ESTIMATE, NEUTRAL, TRUTH
from bluefoot_mpc.wheels import WheeledRobot, icr_of, zero_motion_lines
from bluefoot_mpc.wheels.wheel import Wheel, contact, rolling_direction

Trace = dict[str, Any]
FONT = {"family": "Inter, 'Helvetica Neue', Arial, sans-serif", "size": 12, "color": "#333c48"}
STYLE = """
body { margin: 0; background: #fff; color: #1a212b;
  font: 15px/1.55 Inter, "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 32px 28px 64px; }
h1 { font-size: 30px; margin: 0 0 4px; letter-spacing: -.015em; }
h2 { font-size: 20px; margin: 28px 0 4px; }
p { margin: 4px 0 10px; max-width: 100ch; }
.lead { color: #5b6675; }
section { break-inside: avoid; border-top: 1px solid #e2e7ed; margin-top: 22px; }
pre { background: #f5f7f9; border-left: 3px solid #1273c4; padding: 8px 12px; margin: 8px 0;
  overflow-x: auto; font: 12.5px/1.5 "JetBrains Mono", "DejaVu Sans Mono", Menlo, monospace; }
pre i { color: #0b7d5f; font-style: normal; }
sub { line-height: 0; }
table { border-collapse: collapse; font-size: 13.5px; margin: 8px 0; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: 3px 16px 3px 0; border-bottom: 1px solid #e2e7ed; }
th { color: #5b6675; font-weight: 600; }
.side { display: grid; grid-template-columns: repeat(2, minmax(0, 1fr)); gap: 8px 36px; }
.key span { margin-right: 18px; font-size: 13px; white-space: nowrap; }
.key b { font-size: 15px; }
@media print { main { padding: 0; max-width: none; } section { margin-top: 10px; } }
"""


def document(title: str, lead: str, sections: Iterable[str]) -> str:
    """The page; the plotting library is in it, so that it opens without a network."""
    return (
        f'<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>{title}</title>'
        f"<style>{STYLE}</style><script>{get_plotlyjs()}</script></head><body><main><h1>{title}</h1>"
        f'<p class="lead">{lead}</p>{"".join(sections)}</main></body></html>'
    )


def section(title: str, text: str, content: str) -> str:
    return f"<section><h2>{title}</h2><p>{text}</p>{content}</section>"


def picture(figure: go.Figure) -> str:
    figure.update_layout(font=FONT, template="plotly_white", margin={"l": 48, "r": 12, "t": 36, "b": 40})
    if figure.layout.showlegend is None:
        figure.update_layout(showlegend=False)
    figure.update_annotations(font_size=13)
    config = {"displayModeBar": False, "responsive": True}
    return str(figure.to_html(full_html=False, include_plotlyjs=False, config=config))


def cells(names: dict[str, Any], *sources: str) -> str:
    """Lines of Python with what they give."""
    with np.printoptions(precision=4, suppress=True):
        shown = [
            f"&gt;&gt;&gt; {html.escape(s)}\n<i>{html.escape(text_of(eval(s, names)))}</i>" for s in sources
        ]
    return "<pre>" + "\n".join(shown) + "</pre>"


def text_of(value: Any) -> str:
    """A value as a reader wants it: no minus before a zero, no sixteen digits."""
    if isinstance(value, float):
        return f"{value:.4g}"
    return str(value if isinstance(value, str) else np.round(value, 9) + 0.0)


def table(head: list[str], rows: list[list[Any]]) -> str:
    cell = "<td>{}</td>".format
    body = "".join("<tr>" + "".join(cell(html.escape(str(x))) for x in row) + "</tr>" for row in rows)
    return "<table><tr>" + "".join(f"<th>{x}</th>" for x in head) + f"</tr>{body}</table>"


def curve(x: Any, y: Any, colour: str, name: str = "", **more: Any) -> Trace:
    return {
        "type": "scatter", "x": x, "y": y, "mode": "lines", "name": name, "showlegend": bool(name),
        "line": {"color": colour, "width": 1.6},
    } | more  # fmt: skip


def outline(points: Any, colour: str, width: float = 1.5, fill: str = "", **more: Any) -> Trace:
    """A line through (n, 2) points of the robot's frame, forward up."""
    trace = curve(
        -points[:, 1], points[:, 0], colour, line={"color": colour, "width": width}, hoverinfo="skip"
    )
    return trace | ({"fill": "toself", "fillcolor": fill} if fill else {}) | more


def dot(point: Any, **marker: Any) -> Trace:
    return outline(np.array([point]), TRUTH, mode="markers", marker=marker)


def label(point: Any, text: str, colour: str = "#5b6675") -> Trace:
    return outline(
        np.array([point]), colour, mode="text", text=[text], textfont={"color": colour, "size": 12}
    )


def arrow(figure: go.Figure, start: Any, end: Any, colour: str, column: int) -> None:
    x, y = (f"{axis}{column if column > 1 else ''}" for axis in "xy")
    figure.add_annotation(
        x=-end[1], y=end[0], ax=-start[1], ay=start[0], xref=x, yref=y, axref=x, ayref=y, text="",
        arrowhead=2, arrowwidth=2.2, arrowcolor=colour,
    )  # fmt: skip


def add(figure: go.Figure, traces: Iterable[Trace], row: int = 1, column: int = 1) -> None:
    for trace in traces:
        figure.add_trace(trace, row=row, col=column)


def seen_from_above(figure: go.Figure, x: tuple[float, float], y: tuple[float, float], **place: int) -> None:
    """Axes with equal scales and without ticks, of all subplots or of one."""
    figure.update_xaxes(range=x, visible=False, constrain="domain", **place)
    figure.update_yaxes(range=y, visible=False, constrain="domain", **place)
    for axis in figure.select_xaxes(**place):
        axis.update(scaleanchor=axis.plotly_name.replace("xaxis", "y"), scaleratio=1)


def robot_traces(robot: WheeledRobot, steering: Any, twist: Any = None) -> list[Trace]:
    """Chassis, wheels, and for a motion the zero-motion lines and the centre of rotation."""
    hull = convex_hull(np.array([wheel.position for wheel in robot.wheels]))
    traces = [outline(np.vstack([hull, hull[:1]]), "#b8c0cb", 6 if len(hull) < 3 else 1.5, "#eef1f5")]
    for wheel, angle in zip(robot.wheels, steering, strict=True):
        traces += wheel_traces(wheel, float(angle))
    if twist is not None:
        centre = icr_of(twist).point
        dotted = {"color": NEUTRAL, "width": 1, "dash": "dot"}
        for point, _ in zero_motion_lines(robot, steering):
            ends = np.array([point, centre + 0.12 * (centre - point)])
            traces.append(outline(ends, NEUTRAL, line=dotted))
        traces.append(dot(centre, size=10, color=BAD))
    return [*traces, dot(np.zeros(2), size=7, symbol="cross-thin", line={"width": 1.5})]


def wheel_traces(wheel: Wheel, steering: float) -> list[Trace]:
    along, centre = rolling_direction(wheel, steering), contact(wheel, steering)
    across = np.array([-along[1], along[0]])
    half, wide = wheel.radius, 0.3 * wheel.radius
    corners = ((1, 1), (1, -1), (-1, -1), (-1, 1), (1, 1))
    box = centre + np.array([a * half * along + b * wide * across for a, b in corners])
    colour = ESTIMATE if wheel.driven else NEUTRAL
    traces = [outline(box, COMMAND if wheel.turns else colour, 2 if wheel.turns else 1, colour)]
    if wheel.kind == "castor":
        traces.append(outline(np.array([wheel.position, centre]), TRUTH))
    if wheel.kind == "swedish":
        c, s = math.cos(wheel.gamma), math.sin(wheel.gamma)
        slanted = abs(s) > 0.1
        roller = (0.9 * wide / abs(s) if slanted else 0.25 * half) * (c * along + s * across)
        for place in (-0.7, -0.23, 0.23, 0.7) if slanted else (-0.6, 0.0, 0.6):
            middle = centre + place * half * along
            traces.append(outline(np.array([middle - roller, middle + roller]), "white", 1.6))
    return traces
