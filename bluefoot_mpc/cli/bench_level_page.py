"""What ``bluefoot bench`` shows of trunk levelling on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import RenderableType
from rich.table import Table

from bluefoot_mpc.viz.bench_level import by_window, credit_line, credit_of, lower, ratio_text


def level_pages(level: Mapping[str, Any]) -> list[RenderableType]:
    """One table a case, the meaning of its rows, and what the network is worth.

    Args:
        level: part ``level`` of what ``bluefoot bench --json`` prints.
    """
    parts: list[RenderableType] = []
    for name, title in level["cases"].items():
        rows = [row for row in level["rows"] if row["case"] == name]
        if rows:
            parts.append(_case(title, rows, level["credits"]))
    legend = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name, meaning in level["parts"].items():
        legend.add_row(name, meaning)
    parts.append(legend)
    if level["credits"]:
        parts.append(f"\n{credit_line(level)}\n")
    return parts


def _case(
    title: str, rows: Sequence[Mapping[str, Any]], credits_: Sequence[Mapping[str, Any]]
) -> RenderableType:
    table = Table(
        title=f"Levelling, {title}: change of RMS in %, median (best…worst)", title_justify="left",
        box=SIMPLE_HEAD, padding=(0, 1, 0, 0),
    )  # fmt: skip
    for k, name in enumerate(("part", "falls", "roll", "pitch", "by window", "mm/s", "mm", "tilt over pd")):
        table.add_column(name, justify="left" if k < 1 else "right", no_wrap=True)
    for row in rows:
        figures = row["figures"]
        against = " ".join((ratio_text(row["against"].get("pd")), credit_of(row, credits_))).strip()
        table.add_row(
            row["part"],
            f"{row['falls']}/{row['runs']}",
            lower(figures["roll_reduction_percent"]),
            lower(figures["pitch_reduction_percent"]),
            by_window(figures),
            _change(figures["speed_change_percent"], " %", 0),
            _change(figures["height_change_mm"], "", 1),
            against,
        )
    return table


def _change(found: Mapping[str, float] | None, unit: str, digits: int) -> str:
    return "–" if found is None else f"{found['median']:+.{digits}f}{unit}"
