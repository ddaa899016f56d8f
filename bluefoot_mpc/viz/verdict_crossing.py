"""Key figures and events of runs over rough ground."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from bluefoot_mpc.viz.crossing_series import CrossingSeries
from bluefoot_mpc.viz.style import PHASE_NAMES
from bluefoot_mpc.viz.verdict import Tile
from bluefoot_mpc.viz.verdict_way import figure_tiles

CROSSING = "crossing: "
"""Start of what the controller itself tells of crossing; `crossing_events` tells more."""

_APART = 1.0
"""s between two touches of the ground that are told apart."""

_FIGURES = (
    ("goal_left_m", "Short of the goal line", 2, "m", "at best; below 0 is beyond it"),
    ("reached_s", "Goal line reached", 1, "s", ""),
    ("sweeps", "Sweeps", 0, "", ""),
    ("sweep_time_s", "Swept for", 1, "s", ""),
    ("levels", "Levels of the sweep", 0, "", ""),
    ("seen_within_reach_percent", "Ground seen", 0, "%", "of what lies ahead within 1.2 m"),
    ("map_error_median_mm", "Map error, median", 1, "mm", "of cells seen within 1.2 m"),
    ("map_error_95_mm", "Map error, 95 %", 1, "mm", "of cells seen within 1.2 m"),
    ("foothold_error_median_mm", "Footholds missed by", 0, "mm", "median, true landings"),
    ("foothold_error_95_mm", "Footholds missed, 95 %", 0, "mm", "true landings"),
)
"""Figures of the summary: key, label, digits, unit and what is measured."""


def crossing_tiles(summary: Mapping[str, Any], checks: Sequence[Mapping[str, Any]] = ()) -> list[Tile]:
    """Key figures of crossing rough ground; those that a run does not have are left out.

    Args:
        summary: the summary, as in ``summary.json``.
        checks: the scenario's criteria; one with a ``figure`` judges that tile by its ``goal``.
    """
    return figure_tiles(_FIGURES, summary, checks)


def crossing_events(crossing: CrossingSeries) -> list[tuple[float, str]]:
    """Time (s) and text of phases and their reasons, of touches, and of corrections of the map."""
    found: list[tuple[float, str]] = []
    before = ("", "")
    for k, (name, reason) in enumerate(zip(crossing.phase, crossing.reason, strict=True)):
        if name and (name, reason) != before:
            text = f"{CROSSING}{PHASE_NAMES.get(name, name)}"
            found.append((float(crossing.time[k]), f"{text} ({reason})" if reason else text))
        before = (name, reason)
    last = -math.inf
    for time, names in zip(crossing.time.tolist(), crossing.touching, strict=True):
        if names and time - last > _APART:
            found.append((time, f"touches the ground with {', '.join(names)}"))
        last = time if names else last
    for entry in crossing.maps[1:]:
        moved = crossing.drift[entry.tick]
        if moved > 0.0:
            text = f"{CROSSING}the older map moves by {1e3 * moved:.0f} mm onto the newest sweep"
            found.append((float(crossing.time[entry.tick]), text))
    return sorted(found)
