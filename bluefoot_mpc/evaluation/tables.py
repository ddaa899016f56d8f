"""Tables of figures for people (Markdown) and for programs (plain values)."""

from __future__ import annotations

import statistics
from collections.abc import Mapping, Sequence
from typing import Any

from bluefoot_mpc.evaluation.battery import Verdict
from bluefoot_mpc.exceptions import ConfigurationError

WALKING_COLUMNS = {
    "falls": "falls", "speed_mmps": "speed mm/s", "drift_percent": "drift %", "clearance_mm": "clearance mm",
    "roll_rms_deg": "roll RMS °", "pitch_rms_deg": "pitch RMS °", "attitude_error_deg": "estimate error °",
}  # fmt: skip
"""Figures that the walking table shows, and their titles."""

WALKING_BATTERIES = ("mpc trot", "mpc walk", "walking")
"""Batteries that are shown as tables of walking."""

_LEAST_IS_WORST = ("clearance_mm",)


def spread(verdict: Verdict, figure: str) -> dict[str, float] | None:
    """Median, least and greatest of a figure over the seeds; None where one is unknown."""
    values = [figures.get(figure) for figures in verdict.figures.values()]
    known = [value for value in values if value is not None]
    if not known or len(known) < len(values):
        return None
    return {"median": statistics.median(known), "min": min(known), "max": max(known)}


def limit_rows(verdict: Verdict) -> list[dict[str, Any]]:
    """What was asked of a case and what was reached, limit by limit."""
    return [
        {
            "case": verdict.case.name,
            "figure": limit.figure,
            "limit": limit.describe(),
            "over": limit.over,
            "value": verdict.value(limit),
            "holds": verdict.holds(limit),
        }
        for limit in verdict.case.limits
    ]


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
                "limits": limit_rows(verdict),
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
    """Markdown table, one row a limit: what is asked, and what was reached."""
    lines = ["| case | figure | limit | reached | kept |", "|---|---|---|---|---|"]
    for verdict in verdicts:
        for limit in verdict.case.limits:
            reached = verdict.value(limit)
            shown = "unknown" if reached is None else f"{reached:.3g}"
            kept = "yes" if verdict.holds(limit) else "NO"
            lines.append(f"| {verdict.case.name} | {limit.figure} | {limit.describe()} | {shown} | {kept} |")
    return "\n".join(lines)


def battery_line(name: str, verdicts: Sequence[Verdict]) -> str:
    """One sentence about a battery: how many runs, how many falls, the worst of each other limit."""
    runs = [figures for verdict in verdicts for figures in verdict.figures.values()]
    falls = sum(figures.get("falls") or 0.0 for figures in runs)
    parts = [f"{len(runs)} runs, {falls:.0f} falls"]
    limits = dict.fromkeys(limit for verdict in verdicts for limit in verdict.case.limits)
    for limit in limits:
        worst = limit.value([figures.get(limit.figure) for figures in runs])
        same_for_all = all(limit in verdict.case.limits for verdict in verdicts)
        if limit.figure != "falls" and limit.over == "worst" and same_for_all and worst is not None:
            parts.append(f"{limit.figure} at worst {worst:.2f} (limit {limit.describe()})")
    return f"- {name}: {', '.join(parts)}"


def readme_section(batteries: Mapping[str, Sequence[Verdict]]) -> str:
    """What the README shows of the figures: tables of the straight walks, a line for each other battery."""
    parts = [walking_table(batteries[name]) for name in WALKING_BATTERIES if name in batteries]
    lines = [
        battery_line(name, verdicts) for name, verdicts in batteries.items() if name not in WALKING_BATTERIES
    ]
    return "\n\n".join([*parts, "\n".join(lines)]).strip()


def replace_between(text: str, section: str, begin: str, end: str) -> str:
    """`text` with everything between the lines that hold the two marks replaced by `section`.

    Raises:
        ConfigurationError: a mark is missing.
    """
    head, mark, rest = text.partition(begin)
    first_line, _, rest = rest.partition("\n")
    _, closing, tail = rest.partition(end)
    if not mark or not closing:
        raise ConfigurationError(f"the marks '{begin}' and '{end}' are not there, in this order")
    return f"{head}{mark}{first_line}\n{section}\n{closing}{tail}"


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
