"""``bluefoot bench``: ablation, time of every layer, limit of pushes, parts of trunk levelling."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from typing import Any

from rich import progress as bars
from rich.console import Console

from bluefoot_mpc.cli.arguments import BenchCommand
from bluefoot_mpc.cli.bench_page import bench_page
from bluefoot_mpc.cli.bench_plan import Plan, plan_of
from bluefoot_mpc.cli.outcome import FAILED, OK, Outcome, to_json
from bluefoot_mpc.evaluation import ablation, level_ablation, push_limit
from bluefoot_mpc.evaluation.battery import Store, source_hash
from bluefoot_mpc.evaluation.timing import ROUNDS, time_layers
from bluefoot_mpc.evaluation.variants import VARIANTS
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.runtime.versions import installed_versions
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.viz.bench import bench_html

TIMED = {"trot 60 mm/s": ("trot", 0.06), "walk 30 mm/s": ("walk", 0.03)}
"""Runs whose ticks are timed: two feet on the ground, and three or four."""
_RESULTS, _PAGE, _RUNS = "bench.json", "bench.html", "runs.jsonl"
_Done = Callable[..., None]


def bench(command: BenchCommand) -> Outcome:
    """Measure, write the page and the figures, and show them."""
    plan = plan_of(command)
    out = command.out
    try:
        out.mkdir(parents=True, exist_ok=True)
        store = Store(out / _RUNS)
        data = _measured(plan, store, command.workers)
        files = [out / _RESULTS, out / _PAGE]
        data |= {"files": [str(file) for file in files]}
        files[0].write_text(to_json(data) + "\n", encoding="utf-8")
        files[1].write_text(bench_html(data), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"cannot write to --out {out}: {error.strerror or error}") from error
    return Outcome(status=data["exit_status"], data=data, page=bench_page(data))


def _measured(plan: Plan, store: Store, workers: int | None) -> dict[str, Any]:
    data: dict[str, Any] = {
        "parts": list(plan.parts), "seeds": plan.pushes.seeds, "cases": {},
        "variants": {row.name: row.meaning for row in plan.rows} if plan.needs_variants else {},
        "ablation": [], "criteria": [], "timing": {}, "pushes": {}, "level": {},
    }  # fmt: skip
    if "ablation" in plan.parts:
        data |= _ablation(plan, store, workers)
    if "level" in plan.parts:
        data = _with_level(data, plan, store, workers)
    if "pushes" in plan.parts:
        data |= _pushes(plan, store, workers)
    if "timing" in plan.parts:
        data |= _timing(plan)
    success = all(row["holds"] for row in data["criteria"])
    return data | {
        "success": success, "exit_status": OK if success else FAILED,
        "source": source_hash(), "versions": installed_versions(),
    }  # fmt: skip


def _ablation(plan: Plan, store: Store, workers: int | None) -> dict[str, Any]:
    count = ablation.missing_runs(plan.cases, plan.rows, store)
    with _bar("ablation", count) as done:
        rows = ablation.ablate(plan.cases, plan.rows, store, workers=workers, progress=done)
    # Judged is all of model-based control; a bench without that row judges nothing.
    return {
        "cases": {name: case.name for name, case in plan.cases.items()},
        "ablation": [row.as_plain() for row in rows],
        "criteria": ablation.criteria(rows, VARIANTS[-1].name),
    }


def _with_level(data: dict[str, Any], plan: Plan, store: Store, workers: int | None) -> dict[str, Any]:
    """The data with the ablation of trunk levelling, its limits behind the others."""
    cases, parts = plan.level_cases, plan.level_parts
    with _bar("level", level_ablation.missing_level_runs(cases, parts, store)) as done:
        rows = level_ablation.ablate_leveling(cases, parts, store, workers=workers, progress=done)
    level = {
        "cases": {name: case.name for name, case in cases.items()},
        "parts": {part.name: part.meaning for part in parts},
        "rows": [row.as_plain() for row in rows],
        "credits": level_ablation.credits_of(rows),
        "least_gain": level_ablation.CREDIT,
    }
    return data | {"level": level, "criteria": [*data["criteria"], *level_ablation.level_criteria(rows)]}


def _pushes(plan: Plan, store: Store, workers: int | None) -> dict[str, Any]:
    controllers = dict.fromkeys(row.controller for row in plan.rows)
    found = {}
    with _bar("pushes", len(controllers) * plan.pushes.runs) as done:
        for controller in controllers:
            limits = push_limit.push_limits(controller, plan.pushes, store, workers=workers, progress=done)
            found[controller] = push_limit.as_plain(limits)
    return {"pushes": found, "push_search": asdict(plan.pushes)}


def _timing(plan: Plan) -> dict[str, Any]:
    timing: dict[str, dict[str, Any]] = {}
    with _bar("timing", ROUNDS * len(TIMED) * len(plan.rows)) as done:
        for name, (gait, speed) in TIMED.items():
            runs = {
                row.name: RunOptions(
                    controller=row.controller, overrides=row.overrides, duration=plan.duration,
                    gait=gait, speed=speed,
                )
                for row in plan.rows
            }  # fmt: skip
            found = time_layers("walk", runs, done)
            timing[name] = {
                run: {layer: asdict(times) for layer, times in layers.items()}
                for run, layers in found.items()
            }
    return {"timing": timing}


@contextmanager
def _bar(label: str, total: int) -> Iterator[_Done]:
    """A bar on a terminal; piped, nothing."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda *_: None
        return
    columns = (bars.TextColumn("{task.description}"), bars.BarColumn(), bars.MofNCompleteColumn())
    with bars.Progress(*columns, bars.TimeRemainingColumn(), console=console, transient=True) as bar:
        task = bar.add_task(label, total=total)
        yield lambda *_: bar.advance(task)
