"""Figures of runs over rough ground, for batteries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

LAST_LINK = "link4"
"""How the names of the links end that carry the feet's balls."""


def ground_figures(summary: Mapping[str, Any]) -> dict[str, float | None]:
    """Whether the ground was crossed, and how well it was known and met; None for other scenarios."""
    figures = summary["figures"]
    is_crossing = "goal_left_m" in figures
    left, touched = figures.get("goal_left_m"), figures.get("touched") or {}
    brushed_at_most = all(name.endswith(LAST_LINK) for name in touched)
    return {
        "crossed": float(summary["success"]) if is_crossing else None,
        "brushed_at_most": float(figures.get("reached_s") is not None and brushed_at_most)
        if is_crossing
        else None,
        "upright": None if figures.get("toppled") is None else float(not figures["toppled"]),
        "goal_left_mm": None if left is None else 1e3 * left,
        "reached_s": figures.get("reached_s"),
        "sweeps": figures.get("sweeps"),
        "map_error_median_mm": figures.get("map_error_median_mm"),
        "map_error_95_mm": figures.get("map_error_95_mm"),
        "foothold_error_median_mm": figures.get("foothold_error_median_mm"),
        "foothold_error_95_mm": figures.get("foothold_error_95_mm"),
    }
