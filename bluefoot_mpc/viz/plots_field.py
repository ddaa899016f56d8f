"""The report's pictures of the potential field: what the rays of some sweeps pulled and pushed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.navigation import potential_field
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.outline import OutlineConfig
from bluefoot_mpc.settings import build
from bluefoot_mpc.types import FloatArray, Guided
from bluefoot_mpc.viz.guided_series import GuidedSeries
from bluefoot_mpc.viz.packing import pack
from bluefoot_mpc.viz.plots import Panel, Step, Trace
from bluefoot_mpc.viz.scans import ReadScan
from bluefoot_mpc.viz.style import BAD, COMMAND, ESTIMATE, GUIDED_NAMES, NEUTRAL

INSTANTS = 8
"""Instants that one can step through, at most."""
PULL, PUSH = 0.35, 0.20
"""m, length of the longest arrow of a pull, and of a push, which ends before the robot's middle."""
_REACH = 2.1
"""m around the robot that are shown; arrows of farther points stand at the edge."""
_ARROWS = 48
"""Rays with an arrow, at most."""
_IN_PLACE, _TURN = 0.05, 0.30
"""m (and rad) of a motion that counts as none, and m, radius at which a turn in place is drawn."""
_AHEAD = 3.0
"""s for which the decided motion is drawn on."""


def navigation_config(table: Mapping[str, Any]) -> NavigationConfig:
    """How navigation was configured in a run; what is not recorded, or of another version, is as by default.

    Args:
        table: the run's configuration.
    """
    try:
        return build(NavigationConfig, table["control"]["navigation"], "control.navigation")
    except (KeyError, TypeError, ConfigurationError):
        return NavigationConfig()


def field_pictures(guided: GuidedSeries, scans: Sequence[ReadScan], config: NavigationConfig) -> Panel | None:
    """The field at some instants, to step through; None where no sweep belongs to a decision.

    Args:
        guided: how the run found its way.
        scans: its sweeps.
        config: of the laws.
    """
    reports = guided.reports
    usable = [scan for scan in scans if reports[scan.tick]]
    if not usable:
        return None
    # A robot that has arrived stands, and one picture of it is like the other.
    usable = [scan for scan in usable if guided.guided[scan.tick] != Guided.ARRIVED] or usable
    steps = tuple(
        Step(
            label=f"{guided.time[item.tick]:.1f} s",
            note=note,
            time=float(guided.time[item.tick]),
            data=field_traces(guided, item, config),
        )
        for item, note in _instants(guided, usable)
    )
    first = next((step for step in steps if step.note), steps[0])
    return Panel(
        key="field", title="Potential field", data=first.data, layout=_layout(), height=560, time=False,
        steps=steps,
        caption="The newest sweep, forward is up. Arrows: what every few rays pull (blue) or push (red), "
        "each kind at its own scale.",
    )  # fmt: skip


def field_traces(guided: GuidedSeries, item: ReadScan, config: NavigationConfig) -> list[Trace]:
    """One sweep: points, forces, their sum, and what was decided; all in the levelled robot frame."""
    scan, tick = item.scan, item.tick
    near = scan.points[scan.hit]
    weight = potential_field.weights(scan.bearing, config.field)
    force = weight * potential_field.forces(scan.distance, config.field)
    summed = potential_field.field(scan.bearing, scan.distance, config.field).force
    outline = config.guard.outline
    around = math.radians(config.field.view_deg)
    rays = (scan.origin, scan.bearing, scan.distance, force)
    circle = np.linspace(-around, around, 49)
    ring = scan.origin + config.field.wanted_distance * np.column_stack([np.cos(circle), np.sin(circle)])
    wanted = f"wanted distance, {config.field.wanted_distance:g} m"
    least = f"guard, {config.guard.least:g} m"
    led = GUIDED_NAMES.get(guided.guided[tick], guided.guided[tick])
    return [
        {
            **_trace(near, "markers", "sweep"),
            "marker": {"size": 3.5, "color": "@ink", "opacity": 0.75},
        },
        _line(ring, wanted, NEUTRAL, 1.2, "dot"),
        _line(box_outline(outline, config.guard.least), least, BAD, 1.2, "dash"),
        {**_line(box_outline(outline, 0.0), "robot's outline", "@ink", 1.6), "fill": "toself",
         "fillcolor": "rgba(138,148,166,0.18)"},
        _line(force_arrows(*rays, pulls=True), "pull", ESTIMATE, 1.3),
        _line(force_arrows(*rays, pulls=False), "push", BAD, 1.6),
        _line(arrow(np.zeros(2), _direction(summed) * 0.8, 0.09), "sum of the field", ESTIMATE, 3.5),
        _line(way_ahead(guided.velocity[tick], float(guided.yaw_rate[tick])),
              f"decided ({led}), {_AHEAD:g} s on", COMMAND, 3.5),
    ]  # fmt: skip


def force_arrows(
    origin: FloatArray, bearing: FloatArray, distance: FloatArray, force: FloatArray, *, pulls: bool
) -> FloatArray:
    """Arrows (k, 2) m of pulls, away from the LIDAR, or of pushes, towards it; separated by NaN.

    Args:
        origin: (2,) m, the LIDAR in the levelled robot frame.
        bearing: (n,) rad.
        distance: (n,) m, lengths of the rays.
        force: (n,) weighted forces; pulls positive.
        pulls: which of them to draw.
    """
    size = force if pulls else -force
    chosen = np.flatnonzero(size > 0.0)
    chosen = chosen[:: max(1, -(-len(chosen) // _ARROWS))]
    scale = (PULL if pulls else PUSH) / (float(size[chosen].max()) if len(chosen) else 1.0)
    pieces = [np.zeros((0, 2))]
    for k in chosen:
        ray = np.array([math.cos(bearing[k]), math.sin(bearing[k])])
        length = scale * float(size[k])
        end = min(float(distance[k]), _REACH - PULL)
        # A pull begins short of what it is drawn to, a push at the thing that pushes.
        tip = ray * length if pulls else -ray * length
        pieces.append(arrow(origin + end * ray, tip, 0.3 * length))
    return np.concatenate(pieces)


def arrow(start: FloatArray, along: FloatArray, head: float) -> FloatArray:
    """(6, 2) m, an arrow as one line: shaft, tip, and both sides of the head; ends with NaN."""
    tip = start + along
    size = float(np.hypot(*along))
    if size == 0.0:
        return np.full((6, 2), np.nan)
    back = -along / size * head
    side = np.array([-back[1], back[0]]) * 0.5
    return np.array([start, tip, tip + back + side, tip, tip + back - side, [np.nan, np.nan]])


def box_outline(config: OutlineConfig, margin: float) -> FloatArray:
    """(k, 2) m, the robot's outline, grown by a margin on all sides; closed."""
    radius = config.rounding + margin
    corners = [(1, 1, 0.0), (-1, 1, 0.5), (-1, -1, 1.0), (1, -1, 1.5)]
    arcs = []
    for sign_x, sign_y, start in corners:
        angle = math.pi * (start + np.linspace(0.0, 0.5, 7))
        middle = np.array([sign_x * config.half_length, sign_y * config.half_width])
        arcs.append(middle + radius * np.column_stack([np.cos(angle), np.sin(angle)]))
    ring = np.concatenate(arcs)
    return np.concatenate([ring, ring[:1]])


def way_ahead(velocity: FloatArray, yaw_rate: float) -> FloatArray:
    """(k, 2) m, where a motion leads in the next seconds, with an arrow's head; robot frame.

    A turn in place is an arc around the robot.
    """
    time = np.linspace(0.0, _AHEAD, 25)
    heading = yaw_rate * (time[1:] + time[:-1]) / 2
    step = np.diff(time)[:, None] * np.column_stack(
        [
            np.cos(heading) * velocity[0] - np.sin(heading) * velocity[1],
            np.sin(heading) * velocity[0] + np.cos(heading) * velocity[1],
        ]
    )
    points = np.concatenate([np.zeros((1, 2)), np.cumsum(step, axis=0)])
    if not np.isfinite(points).all():
        return np.zeros((1, 2))
    if np.hypot(*points[-1]) < _IN_PLACE:
        if abs(yaw_rate) * _AHEAD < _IN_PLACE:
            return np.zeros((1, 2))
        points = _TURN * np.column_stack([np.cos(yaw_rate * time), np.sin(yaw_rate * time)])
    last = points[-1] - points[-2]
    return np.concatenate([points, arrow(points[-1], last / np.hypot(*last) * 1e-3, 0.08)[1:5]])


def _instants(guided: GuidedSeries, usable: Sequence[ReadScan]) -> list[tuple[ReadScan, str]]:
    """Sweeps worth a look, in order of time: closest approach, ways out, and others spread evenly."""
    ticks = np.array([item.tick for item in usable])
    led = guided.guided
    wanted: dict[int, str] = {}

    apart = float(ticks[-1] - ticks[0]) / (2 * INSTANTS)

    def want(tick: int, note: str) -> None:
        index = int(np.argmin(np.abs(ticks - tick)))
        if len(wanted) < INSTANTS and all(abs(ticks[index] - ticks[k]) >= apart for k in wanted):
            wanted[index] = note

    if guided.closest is not None:
        want(guided.closest, "closest approach")
    begins = [k for k in range(1, len(led)) if led[k] == "escape" != led[k - 1]]
    for k in begins[:2]:
        want(k, "boxed in")
    first, last = int(ticks[0]), int(ticks[-1])
    spread = np.linspace(first, last, INSTANTS)
    for tick in spread:
        want(round(float(tick)), "")
    return [(usable[index], wanted[index]) for index in sorted(wanted)]


def _direction(vector: FloatArray) -> FloatArray:
    size = float(np.hypot(*vector))
    return vector / size if size > 0.0 else np.zeros(2)


def _trace(points: FloatArray, mode: str, name: str) -> Trace:
    """A trace of points in the robot frame: forward is up, left is left."""
    return {
        "type": "scatter", "mode": mode, "x": pack(-points[:, 1]), "y": pack(points[:, 0]), "name": name,
        "hoverinfo": "name",
    }  # fmt: skip


def _line(points: FloatArray, name: str, colour: str, width: float, dash: str = "solid") -> Trace:
    return {**_trace(points, "lines", name), "line": {"color": colour, "width": width, "dash": dash}}


def _layout() -> dict[str, Any]:
    return {
        "xaxis": {"title": {"text": "to the right (m)"}, "range": [-_REACH, _REACH]},
        "yaxis": {
            "title": {"text": "forward (m)"},
            "range": [-0.45 * _REACH, _REACH],
            "scaleanchor": "x",
            "scaleratio": 1,
        },
        "hovermode": "closest",
    }
