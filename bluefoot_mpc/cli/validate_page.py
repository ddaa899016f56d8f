"""What ``bluefoot validate`` shows on a terminal."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from bluefoot_mpc.evaluation.validation_plan import LEAST_SEEDS
from bluefoot_mpc.evaluation.validation_record import Record


def validation_page(record: Record, config: Path | None, deploy: str) -> tuple[RenderableType, ...]:
    """Every case with its limits, then what it means.

    Args:
        record: the validation.
        config: the file that was validated; None for the configuration that ships.
        deploy: the command that deploys it.
    """
    table = record.table
    plan = record.plan
    head = (
        f"{config or 'the configuration that ships'}, controller {table['subject']['controller']}, "
        f"{plan.gait} {1e3 * plan.speed:.0f} mm/s, {len(plan.numbers)} robot(s)\n"
    )
    return (
        head,
        _cases(table["cases"]),
        *_verdict(record, deploy),
        f"record         {record.file}\nconfiguration  {table['subject_sha256'][:16]}\n"
        f"code           {table['code']['source']} (version {table['code']['package']})",
    )


def _cases(cases: list[dict[str, Any]]) -> Table:
    table = Table(box=SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name in ("case", "figure", "limit", "reached", ""):
        table.add_column(name, no_wrap=True, justify="right" if name in ("limit", "reached") else "left")
    for case in cases:
        for number, limit in enumerate(case["limits"]):
            bound = limit["text"].removeprefix(limit["figure"]).strip()
            table.add_row("" if number else case["name"], limit["figure"], bound, _value(limit), _mark(limit))
    return table


def _value(limit: Mapping[str, Any]) -> str:
    value = limit["value"]
    return "not measured" if value is None else f"{value:.3g} {limit['unit']}".rstrip()


def _mark(limit: Mapping[str, Any]) -> Text:
    return Text("yes", style="green") if limit["holds"] else Text("NO", style="bold red")


def _verdict(record: Record, deploy: str) -> tuple[RenderableType, ...]:
    if not record.passed:
        broken = record.broken
        return (Text(f"FAILED: {len(broken)} limit(s) broken: not to be deployed\n", style="bold red"),)
    if not record.plan.is_full:
        text = (
            "PASSED, but too little was tried to deploy it: "
            f"validate without --quick, with {LEAST_SEEDS} seeds or more\n"
        )
        return (Text(text, style="yellow"),)
    return (Text(f"PASSED: may be deployed; what that takes shows: {deploy}\n", style="green"),)
