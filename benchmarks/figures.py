"""Measure every figure that the README and the documentation state.

    python benchmarks/figures.py                 everything; goes on where it stopped
    python benchmarks/figures.py walking pushes  some batteries

Results of single runs are kept in runs/figures.jsonl until the code changes;
figures.json holds the outcome. Exit status 1 when a limit is broken.
"""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path

import orjson
from rich.console import Console
from rich.markdown import Markdown
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

os.environ.setdefault("OMP_NUM_THREADS", "1")

from bluefoot_mpc.evaluation.batteries import BATTERIES, battery
from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery, source_hash
from bluefoot_mpc.evaluation.tables import (
    as_plain,
    limits_table,
    readme_section,
    replace_between,
    walking_table,
)
from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.runtime.versions import installed_versions

MARKS = ("<!-- figures:begin", "<!-- figures:end")


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("batteries", nargs="*", help=f"which; all of them by default: {', '.join(BATTERIES)}")
    parser.add_argument("--out", type=Path, default=Path("figures.json"))
    parser.add_argument("--store", type=Path, default=Path("runs/figures.jsonl"))
    parser.add_argument("--workers", type=int, default=None, help="processes; one per core by default")
    parser.add_argument(
        "--readme", type=Path, help="write the table into this file, between its figures marks"
    )
    options = parser.parse_args()
    console = Console()
    try:
        found = measure(options.batteries or list(BATTERIES), options, console)
    except BlueFootError as error:
        print(error, file=sys.stderr)
        return error.exit_status
    for name, verdicts in found.items():
        text = (
            walking_table(verdicts)
            if name in ("walking", "other robots", "robustness")
            else limits_table(verdicts)
        )
        console.print(Markdown(f"## {name}\n\n{text}") if console.is_terminal else f"\n## {name}\n\n{text}")
    if options.readme:
        text = options.readme.read_text(encoding="utf-8")
        section = readme_section(found)
        options.readme.write_text(replace_between(text, section, *MARKS), encoding="utf-8")
    return 0 if all(verdict.passed for verdicts in found.values() for verdict in verdicts) else 1


def measure(names: list[str], options: argparse.Namespace, console: Console) -> dict[str, list[Verdict]]:
    batteries = {name: battery(name) for name in names}
    store = Store(options.store)
    total = sum(len(case.seeds) for cases in batteries.values() for case in cases)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    found = {}
    with Progress(*columns, console=console, disable=not console.is_terminal) as bar:
        task = bar.add_task("measuring", total=total)
        for name, cases in batteries.items():
            known = sum(store.get(case, seed) is not None for case in cases for seed in case.seeds)
            bar.update(task, advance=known, description=name)
            found[name] = run_battery(
                cases, store, workers=options.workers, progress=lambda case, seed: bar.advance(task)
            )
            write(found, options.out)
    return found


def write(found: dict[str, list[Verdict]], path: Path) -> None:
    table = {
        "source": source_hash(),
        "versions": installed_versions(),
        "batteries": {name: as_plain(verdicts) for name, verdicts in found.items()},
    }
    path.write_bytes(orjson.dumps(table, option=orjson.OPT_INDENT_2) + b"\n")


if __name__ == "__main__":
    sys.exit(main())
