"""Tables of figures for people (Markdown) and for programs (plain values)."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any

from bluefoot_mpc.evaluation.battery import Verdict

WALKING_COLUMNS = {
    "falls": "falls", "speed_mmps": "speed mm/s", "drift_percent": "drift %", "clearance_mm": "clearance mm",
    "roll_rms_deg": "roll RMS °", "pitch_rms_deg": "pitch RMS °", "attitude_error_deg": "estimate error °",
}  # fmt: skip
"""Figures that the walking table shows, and their titles."""

_LEAST_IS_WORST = ("clearance_mm",)


def spread(verdict: Verdict, figure: str) -> dict[str, float] | None:
    """Median, least and greatest of a figure over the seeds; None where one is unknown."""
    values = [figures.get(figure) for figures in verdict.figures.values()]
    known = [value for value in values if value is not None]
    if not known or len(known) < len(values):
        return None
    return {"median": statistics.median(known), "min": min(known), "max": max(known)}


def as_plain(verdicts: Sequence[Verdict]) -> list[dict[str, Any]]:
    """Everything about every case, for ``figures.json``."""
    rows = []
    for verdict in verdicts:
        case = verdict.case
        names = sorted({name for figures in verdict.figures.values() for name in figures})
        rows.append(
            {
                "case": case.name,
                "scenario": case.scenario,
                "options": dict(case.options),
                "seeds": list(case.seeds),
                "passed": verdict.passed,
                "limits": [
                    {
                        "figure": limit.figure,
                        "limit": limit.describe(),
                        "worst": verdict.worst(limit),
                        "holds": verdict.holds(limit),
                    }
                    for limit in case.limits
                ],
                "figures": {name: spread(verdict, name) for name in names},
            }
        )
    return rows


def walking_table(verdicts: Sequence[Verdict]) -> str:
    """Markdown table, one row a case: median over the seeds, the worst seed in brackets."""
    head = ["case", *WALKING_COLUMNS.values(), "all limits kept"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for verdict in verdicts:
        cells = [verdict.case.name]
        cells += [_cell(verdict, figure) for figure in WALKING_COLUMNS]
        cells.append("yes" if verdict.passed else "NO")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def limits_table(verdicts: Sequence[Verdict]) -> str:
    """Markdown table, one row a limit: what is asked, and the worst seed."""
    lines = ["| case | figure | limit | worst seed | kept |", "|---|---|---|---|---|"]
    for verdict in verdicts:
        for limit in verdict.case.limits:
            worst = verdict.worst(limit)
            shown = "unknown" if worst is None else f"{worst:.3g}"
            kept = "yes" if verdict.holds(limit) else "NO"
            lines.append(f"| {verdict.case.name} | {limit.figure} | {limit.describe()} | {shown} | {kept} |")
    return "\n".join(lines)


def _cell(verdict: Verdict, figure: str) -> str:
    found = spread(verdict, figure)
    if found is None:
        return "–"
    if figure == "falls":
        return f"{sum(f['falls'] or 0 for f in verdict.figures.values()):.0f}"
    worst = found["min"] if figure in _LEAST_IS_WORST else found["max"]
    if figure == "speed_mmps":
        return f"{found['median']:.1f} ({found['min']:.1f}–{found['max']:.1f})"
    return f"{found['median']:.2f} ({worst:.2f})"
