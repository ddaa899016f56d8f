"""Looking where to step against walking blind over the roughest rubble, on the same grounds.

    python benchmarks/rough_blind.py             goes on from what make figures has kept

Runs that are not kept yet are made. Prints how often each crossed and how often each
reached the goal line, and the paired differences with their 95 % intervals.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

os.environ.setdefault("OMP_NUM_THREADS", "1")

from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.comparison import compare_shares
from bluefoot_mpc.evaluation.ground_cases import blind_cases, crossing_cases
from bluefoot_mpc.evaluation.measure import Figures
from bluefoot_mpc.scenarios.crossing import GOAL_TOLERANCE

Holds = Callable[[Figures], bool]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--store", type=Path, default=Path("runs/figures.jsonl"))
    parser.add_argument("--workers", type=int, default=None, help="processes; one per core by default")
    options = parser.parse_args()
    looking = [case for case in crossing_cases() if case.name == "rubble 30 mm"]
    store = Store(options.store)
    verdicts = run_battery((*looking, *blind_cases()), store, workers=options.workers)
    for title, holds in (
        ("crossed: goal line reached, nothing but feet touched", crossed),
        ("goal line reached", reached),
    ):
        Console(width=120).print(compared(title, verdicts[0], verdicts[1:], holds))


def compared(title: str, ours: Verdict, blind: list[Verdict], holds: Holds) -> Table:
    head = ("rubble to 30 mm", "runs", "only looking", "only blind", "difference", "95 %", "chance")
    table = Table(*head, title=title)
    table.add_row("looking", share(ours, holds), "", "", "", "", "")
    for verdict in blind:
        found = compare_shares(outcomes(ours, holds), outcomes(verdict, holds), np.random.default_rng(0))
        d = found.difference
        table.add_row(
            verdict.case.name, share(verdict, holds), f"{found.ours}", f"{found.theirs}",
            f"{100.0 * d.value:+.0f} %", f"{100.0 * d.low:+.0f} ... {100.0 * d.high:+.0f} %",
            f"{found.chance:.2g}",
        )  # fmt: skip
    return table


def crossed(figures: Figures) -> bool:
    return bool(figures.get("crossed"))


def reached(figures: Figures) -> bool:
    left = figures.get("goal_left_mm")
    return left is not None and left <= 1e3 * GOAL_TOLERANCE


def outcomes(verdict: Verdict, holds: Holds) -> dict[int, bool]:
    return {seed: holds(figures) for seed, figures in verdict.figures.items()}


def share(verdict: Verdict, holds: Holds) -> str:
    found = outcomes(verdict, holds)
    return f"{sum(found.values())} of {len(found)}"


if __name__ == "__main__":
    main()
