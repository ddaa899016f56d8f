"""Looking where to step against walking blind over the roughest rubble, on the same grounds.

    python benchmarks/rough_blind.py             goes on from what make figures has kept

Runs that are not kept yet are made. Prints how often each crossed, and the paired
difference to the best blind walk with its 95 % interval.
"""

from __future__ import annotations

import argparse
import os
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

os.environ.setdefault("OMP_NUM_THREADS", "1")

from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.comparison import compare_shares
from bluefoot_mpc.evaluation.ground_cases import blind_cases, crossing_cases


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
    ours, blind = verdicts[0], verdicts[1:]
    table = Table("rubble to 30 mm", "crossed", "only looking", "only blind", "difference", "95 %", "chance")
    table.add_row("looking", share(ours), "", "", "", "", "")
    for verdict in blind:
        found = compare_shares(successes(ours), successes(verdict), np.random.default_rng(0))
        d = found.difference
        table.add_row(
            verdict.case.name, share(verdict), f"{found.ours}", f"{found.theirs}",
            f"{100.0 * d.value:+.0f} %", f"{100.0 * d.low:+.0f} ... {100.0 * d.high:+.0f} %",
            f"{found.chance:.2g}",
        )  # fmt: skip
    Console(width=120).print(table)
    best = max(blind, key=lambda verdict: sum(successes(verdict).values()))
    print(f"best blind: {best.case.name}")


def successes(verdict: Verdict) -> dict[int, bool]:
    return {seed: bool(figures.get("crossed")) for seed, figures in verdict.figures.items()}


def share(verdict: Verdict) -> str:
    found = successes(verdict)
    return f"{sum(found.values())} of {len(found)}"


if __name__ == "__main__":
    main()
