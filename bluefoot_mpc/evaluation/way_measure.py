"""Figures of runs that find their own way, for batteries."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


def way_figures(figures: Mapping[str, Any]) -> dict[str, float | None]:
    """Nearness, coverage, standstill, view and distance out of a summary's figures; None where missing."""
    touched, error = figures.get("collisions"), figures.get("distance_error_m")
    arrived = figures.get("arrived_s") is not None
    return {
        "collisions": None if touched is None else float(len(touched)),
        "closest_approach_mm": _scaled(figures.get("closest_approach_m"), 1e3),
        "seen_percent": figures.get("seen_percent"),
        "stuck_s": figures.get("stuck_longest_s"),
        "path_m": figures.get("path_m"),
        "in_view_percent": figures.get("in_view_percent"),
        "distance_error_mm": None if error is None or not arrived else abs(1e3 * error),
        "distance_median_mm": _scaled(figures.get("distance_median_m"), 1e3),
        "first_seen_s": figures.get("first_seen_s"),
        "arrived_s": figures.get("arrived_s"),
    }


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
