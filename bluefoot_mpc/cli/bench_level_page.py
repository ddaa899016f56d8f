"""What ``bluefoot bench`` shows of trunk levelling on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import RenderableType
from rich.padding import Padding
from rich.table import Table

from bluefoot_mpc.viz.bench_level import credit_line, lower, ratio_text


def level_pages(level: Mapping[str, Any]) -> list[RenderableType]:
    """One table a case, the meaning of its rows, and what the network is worth.

    Args:
        level: part ``level`` of what ``bluefoot bench --json`` prints.
    """
    parts: list[RenderableType] = []
    for name, title in level["cases"].items():
        rows = [row for row in level["rows"] if row["case"] == name]
        if rows:
            parts.append(_case(title, rows))
    parts.append(_pairs(level["parts"]))
    if level["credits"]:
        verdicts = {level["cases"][credit["case"]]: credit["verdict"] for credit in level["credits"]}
        parts += ["\nWhat the network adds", _pairs(verdicts), Padding(credit_line(level), (1, 0))]
    return parts


def _pairs(pairs: Mapping[str, str]) -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name, meaning in pairs.items():
        table.add_row(name, meaning)
    return table


def _case(title: str, rows: Sequence[Mapping[str, Any]]) -> Table:
    table = Table(
        title=f"Levelling, {title}: change of RMS in %, median (best…worst)", title_justify="left",
        box=SIMPLE_HEAD, padding=(0, 1, 0, 0),
    )  # fmt: skip
    for k, name in enumerate(("part", "falls", "roll", "pitch", "tilt", "speed", "tilt over pd")):
        table.add_column(name, justify="left" if k < 1 else "right", no_wrap=True)
    for row in rows:
        figures = row["figures"]
        table.add_row(
            row["part"],
            f"{row['falls']}/{row['runs']}",
            _change(figures["roll_reduction_percent"], -1.0),
            _change(figures["pitch_reduction_percent"], -1.0),
            lower(figures["tilt_reduction_percent"]),
            _change(figures["speed_change_percent"]),
            ratio_text(row["against"].get("pd")),
        )
    return table


def _change(found: Mapping[str, float] | None, sign: float = 1.0) -> str:
    return "–" if found is None else f"{sign * found['median']:+.0f}"
