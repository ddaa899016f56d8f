"""Key figures and events of runs that find their own way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.pictures import FIRST_SEEN, LOST, MARKER_LOST, SEEN_AGAIN
from bluefoot_mpc.viz.guided_series import GuidedSeries
from bluefoot_mpc.viz.style import GUIDED_NAMES
from bluefoot_mpc.viz.verdict import Tile, number

_FIGURES = (
    ("closest_approach_m", "Closest approach", 3, "m", "to any thing, by any part"),
    ("distance_error_m", "Off the wanted distance", 3, "m", "camera to marker, at the end"),
    ("in_view_percent", "Marker in view", 1, "%", "since it was to be looked for"),
    ("seen_percent", "Floor seen", 0, "%", "of what the robot can get at"),
    ("waypoint_distance_m", "Waypoints missed by", 2, "m", "the worst one"),
    ("first_seen_s", "Marker first seen", 1, "s", ""),
    ("arrived_s", "Arrived", 1, "s", ""),
    ("path_m", "Way", 2, "m", ""),
    ("stuck_longest_s", "Longest in one place", 1, "s", "while it should have moved"),
)
"""Figures of the summary: key, label, digits, unit and what is measured."""


NAVIGATION = "navigation: "
"""Start of what the controller itself tells of its way; `way_events` tells more."""


def way_tiles(summary: Mapping[str, Any], checks: Sequence[Mapping[str, Any]] = ()) -> list[Tile]:
    """Key figures of finding the way; those that a run does not have are left out.

    Args:
        summary: the summary, as in ``summary.json``.
        checks: the scenario's criteria; one with a ``figure`` judges that tile by its ``goal``.
    """
    return figure_tiles(_FIGURES, summary, checks)


def figure_tiles(
    table: Sequence[tuple[str, str, int, str, str]],
    summary: Mapping[str, Any],
    checks: Sequence[Mapping[str, Any]],
) -> list[Tile]:
    """Key figures by a table; those that a run does not have are left out.

    Args:
        table: key, label, digits, unit and what is measured, of each figure.
        summary: the summary, as in ``summary.json``.
        checks: the scenario's criteria; one with a ``figure`` judges that tile by its ``goal``.
    """
    figures = summary.get("figures") or {}
    judged = {check["figure"]: check for check in checks if check.get("figure")}
    found = []
    for key, label, digits, unit, note in table:
        value = figures.get(key)
        if isinstance(value, list):
            value = max((entry for entry in value if entry is not None), default=None)
        if value is None or not np.isfinite(value):
            continue
        check = judged.get(key)
        status = "" if check is None else "good" if check["holds"] else "bad"
        said = note if check is None else str(check["goal"])
        found.append(Tile(label=label, value=number(value, digits), unit=unit, note=said, status=status))
    return found


def way_events(run: RunData, guided: GuidedSeries) -> list[tuple[float, str]]:
    """Time (s) and text of what happened on the way: what leads, what was touched, marker seen and lost."""
    found = [(time, f"touches {', '.join(names)}") for time, names in guided.collisions]
    found += _sightings(guided)
    before = ""
    for k, name in enumerate(guided.guided):
        if name and name != before:
            report = run.telemetry[k].navigation
            reason = report.reason if report is not None else ""
            text = f"led by: {GUIDED_NAMES.get(name, name)}"
            found.append((float(guided.time[k]), f"{text} ({reason})" if reason else text))
        before = name
    return found


def _sightings(guided: GuidedSeries) -> list[tuple[float, str]]:
    """Time (s) and text of each time that the marker came into view, and was out of it for a while."""
    found: list[tuple[float, str]] = []
    has_seen = is_lost = False
    for k in np.flatnonzero(guided.reports):
        time = float(guided.time[k])
        if guided.in_view[k]:
            if not has_seen or is_lost:
                found.append((time, SEEN_AGAIN if has_seen else FIRST_SEEN))
            has_seen, is_lost = True, False
        elif has_seen and not is_lost and guided.marker_age[k] > LOST:
            is_lost = True
            found.append((time, MARKER_LOST))
    return found
