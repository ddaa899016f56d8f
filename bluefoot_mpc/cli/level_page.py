"""What a terminal shows of trunk levelling: every window, and what on windows differ by."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.table import Table

LEVEL_FIGURES = (
    "leveling", "windows", "off", "on", "reduction_percent", "peak_reduction_percent",
    "smooth_reduction_percent", "speed_change_percent", "height_change_m", "partial_windows",
    "partial_reasons", "stopped_ticks", "stopped",
)  # fmt: skip
"""Figures of a run in windows that the table holds, instead of a line each."""
_NONE = "–"
_COLUMNS = {
    "roll °": ("roll_rms_deg", 1.0, 2), "pitch °": ("pitch_rms_deg", 1.0, 2),
    "peak °": ("tilt_peak_deg", 1.0, 1), "mm/s": ("speed_mps", 1e3, 1), "high mm": ("height_m", 1e3, 1),
    "MSE": ("mse", 1.0, 3), "rate": ("rate", 1.0, 5),
}  # fmt: skip
"""Title to figure of a window, its factor and digits."""


def level_table(figures: Mapping[str, Any]) -> Table | None:
    """Windows of a run, those without and those with levelling put together; None for other runs.

    Args:
        figures: ``figures`` of a summary.
    """
    windows = figures.get("windows")
    if not windows:
        return None
    table = Table(
        title="RMS and peak tilt by window", title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0)
    )
    for title in ("window", "level", *_COLUMNS):
        table.add_column(title, justify="right", no_wrap=True)
    for window in windows:
        span = f"{window['start_s']:.0f}–{window['end_s']:.0f} s"
        table.add_row(span, window["kind"], *_cells(window), style="" if window["kind"] == "on" else "dim")
    table.add_section()
    for kind in ("off", "on"):
        if figures[kind]:
            table.add_row("all", kind, *_cells(figures[kind]))
    if figures["off"] and figures["on"]:
        table.add_row("change", "", *_changes(figures))
    return table


def _cells(row: Mapping[str, Any]) -> list[str]:
    return [_number(row.get(key), factor, digits) for key, factor, digits in _COLUMNS.values()]


def _changes(figures: Mapping[str, Any]) -> list[str]:
    """What on windows differ by, in percent; the height in mm. Short windows may lack some."""
    reduction, peak = figures["reduction_percent"], figures["peak_reduction_percent"]
    lower = (reduction["roll"], reduction["pitch"], peak["tilt"])
    change, height = figures["speed_change_percent"], figures["height_change_m"]
    percent = [*(None if value is None else -value for value in lower), change]
    shown = [_NONE if value is None else f"{value:+.0f} %" for value in percent]
    return [*shown, _NONE if height is None else f"{1e3 * height:+.1f}", "", ""]


def _number(value: Any, factor: float, digits: int) -> str:
    return _NONE if value is None else f"{factor * value:.{digits}f}"
