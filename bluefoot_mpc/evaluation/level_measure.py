"""What levelling did in one run, as plain figures."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

AXES = ("roll", "pitch", "tilt")
ON_WINDOWS = 3
"""On windows of the protocol whose reductions are told one by one."""


def leveling_figures(figures: Mapping[str, Any]) -> dict[str, float | None]:
    """Figures of a run in windows; none of other runs.

    Reductions are in percent of the same run's off windows.

    Args:
        figures: ``figures`` of the run's summary.
    """
    if "leveling" not in figures:
        return {}
    found: dict[str, float | None] = {
        "speed_change_percent": figures["speed_change_percent"],
        "height_change_mm": _scaled(figures["height_change_m"], 1e3),
        "disengaged": float(figures["stopped_ticks"] > 0 or figures["partial_windows"] > 0),
    }
    for kind in ("off", "on"):
        part = figures[kind] or {}
        found[f"{kind}_speed_mmps"] = _scaled(part.get("speed_mps"), 1e3)
        for axis in AXES:
            for name in ("rms_deg", "peak_deg", "smooth_rms_deg"):
                found[f"{kind}_{axis}_{name}"] = part.get(f"{axis}_{name}")
    for axis in AXES:
        for name in ("reduction_percent", "peak_reduction_percent", "smooth_reduction_percent"):
            found[f"{axis}_{name}"] = figures[name][axis]
    windows = [window for window in figures["windows"] if window["kind"] == "on"]
    for number in range(ON_WINDOWS):
        for axis in AXES:
            seen = windows[number] if number < len(windows) else {}
            found[f"{axis}_reduction_{number + 1}_percent"] = seen.get(f"{axis}_reduction_percent")
    return found


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else factor * value
