"""What ``bluefoot bench`` shows on a terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from bluefoot_mpc.cli.bench_level_page import level_pages
from bluefoot_mpc.viz.bench import layers_in_order

_NONE = "–"


def bench_page(data: Mapping[str, Any]) -> tuple[RenderableType, ...]:
    """The tables of a bench, top to bottom.

    Args:
        data: what ``bluefoot bench --json`` prints.
    """
    parts: list[RenderableType] = []
    if data["ablation"]:
        for name, title in data["cases"].items():
            parts.append(_ablation(title, [row for row in data["ablation"] if row["case"] == name]))
        parts.append(_legend(data["variants"]))
    if data["level"]:
        parts += level_pages(data["level"])
    if data["criteria"]:
        parts.append(_criteria(data["criteria"]))
    if data["pushes"]:
        parts.append(_pushes(data))
    parts += [_timing(name, columns) for name, columns in data["timing"].items()]
    return (*parts, "\n".join(f"wrote {file}" for file in data["files"]))


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title, title_justify="left", box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for k, column in enumerate(columns):
        table.add_column(column, justify="left" if k < 1 else "right", no_wrap=True)
    return table


def _ablation(name: str, rows: Sequence[Mapping[str, Any]]) -> Table:
    table = _table(
        f"{name}: median (worst) RMS in degrees; tilt over the first row's",
        "variant", "falls", "roll", "pitch", "ratio, 95 %", "lift mm", "mm/s",
    )  # fmt: skip
    for row in rows:
        figures = row["figures"]
        table.add_row(
            row["variant"],
            f"{row['falls']}/{row['runs']}",
            _spread(figures["roll_rms_deg"]),
            _spread(figures["pitch_rms_deg"]),
            _ratio(row["against_first"].get("tilt_rms_deg")),
            _median(figures["clearance_mm"], 1),
            _median(figures["speed_mmps"], 0),
        )
    return table


def _legend(variants: Mapping[str, str]) -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name, meaning in variants.items():
        table.add_row(name, meaning)
    return table


def _criteria(criteria: Sequence[Mapping[str, Any]]) -> RenderableType:
    missed = [row for row in criteria if not row["holds"]]
    if not missed:
        return Text(f"all {len(criteria)} limits hold\n", style="green")
    table = _table(f"{len(missed)} of {len(criteria)} limits missed", "case", "figure", "limit", "reached")
    for row in missed:
        reached = "unknown" if row["value"] is None else f"{row['value']:.3g}"
        table.add_row(row["case"], row["figure"], row["limit"], reached)
    return table


def _pushes(data: Mapping[str, Any]) -> Table:
    search = data["push_search"]
    title = f"Largest push survived in trot at {1e3 * search['speed']:.0f} mm/s, N·s: median (least)"
    table = _table(title, "direction", *data["pushes"])
    for rows in zip(*data["pushes"].values(), strict=True):
        cells = (f"{row['median_ns']:.2f} ({row['least_ns']:.2f})" for row in rows)
        table.add_row(f"{rows[0]['direction_deg']:.0f}°", *cells)
    return table


def _timing(name: str, columns: Mapping[str, Mapping[str, Any]]) -> Table:
    table = _table(f"Time of every layer per tick, {name}, µs: median (p99)", "layer", *columns)
    for layer in layers_in_order(columns):
        if layer == "whole tick":
            table.add_section()
        found = (timing.get(layer) for timing in columns.values())
        table.add_row(layer, *(_NONE if t is None else f"{t['p50']:.0f} ({_short(t['p99'])})" for t in found))
    return table


def _short(microseconds: float) -> str:
    return f"{1e-3 * microseconds:.0f}k" if microseconds >= 9999.5 else f"{microseconds:.0f}"


def _spread(found: Mapping[str, float] | None) -> str:
    return _NONE if found is None else f"{found['median']:.2f} ({found['max']:.2f})"


def _median(found: Mapping[str, float] | None, digits: int) -> str:
    return _NONE if found is None else f"{found['median']:.{digits}f}"


def _ratio(found: Mapping[str, Any] | None) -> str:
    if found is None:
        return ""
    ratio = found["ratio"]
    if ratio is None:
        return f"{_NONE} ({found['pairs']} pairs)"
    left_out = f" -{found['left_out']}" if found["left_out"] else ""
    return f"{ratio['value']:.2f} [{ratio['low']:.2f}, {ratio['high']:.2f}]{left_out}"
