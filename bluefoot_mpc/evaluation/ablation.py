"""The ablation: every variant over the same seeds of the same cases, compared pair by pair with the first."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from bluefoot_mpc.evaluation import model_cases
from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.comparison import Comparison, compare
from bluefoot_mpc.evaluation.tables import limit_rows, spread
from bluefoot_mpc.evaluation.variants import Variant
from bluefoot_mpc.exceptions import UnknownNameError

COMPARED = ("roll_rms_deg", "pitch_rms_deg", "tilt_rms_deg")
"""Figures that are compared; the last is what a reduction is judged by."""
SHOWN = (
    "falls", "roll_rms_deg", "pitch_rms_deg", "tilt_rms_deg", "clearance_mm", "speed_mmps",
    "zmp_inside_percent", "plan_margin_mm", "attitude_error_deg", "attitude_bias_deg",
    "qp_failures", "deadline_misses",
)  # fmt: skip
"""Figures whose spread over the seeds each row holds."""


def bench_cases() -> dict[str, Case]:
    """The cases that the bench can run, by the names that its options take."""
    trots = {f"trot-{1e3 * c.options['speed']:.0f}": c for c in model_cases.trot_cases()}
    walks = {f"walk-{1e3 * c.options['speed']:.0f}": c for c in model_cases.slow_walk_cases()}
    disturbed = ("payload", "slope-up", "slope-down", "steps", "friction")
    pushes = ("push-2", "push-3", "push-fast")
    manoeuvres = ("turn", "sideways", "transition")
    return {
        **walks,
        **trots,
        **dict(zip(disturbed, model_cases.disturbed_cases(), strict=True)),
        **dict(zip(pushes, model_cases.push_battery(), strict=True)),
        **dict(zip(manoeuvres, model_cases.manoeuvre_cases(), strict=True)),
    }


def chosen(names: Sequence[str], seeds: int, duration: float | None) -> dict[str, Case]:
    """Cases by name, with as many seeds and of that length.

    Args:
        names: of `bench_cases`.
        seeds: how many, from 0; a case with directions runs each of them with every seed.
        duration: s of every run; None keeps each case's own. Cases with an event keep their own.

    Raises:
        UnknownNameError: there is no such case.
    """
    known = bench_cases()
    for name in names:
        if name not in known:
            raise UnknownNameError("case", name, known)
    return {name: _cut(known[name], seeds, duration) for name in known if name in names}


def _cut(case: Case, seeds: int, duration: float | None) -> Case:
    case = replace(case, seeds=tuple(range(seeds * max(1, case.directions))))
    if duration is None or case.scenario in ("push", "transition"):
        return case
    return replace(case, options={**case.options, "duration": duration})


@dataclass(frozen=True, kw_only=True, slots=True)
class AblationRow:
    """One variant in one case.

    Attributes:
        case: name of the case.
        variant: what ran.
        verdict: its figures over the seeds.
        comparisons: figure to comparison with the first variant; empty for that one.
    """

    case: str
    variant: Variant
    verdict: Verdict
    comparisons: Mapping[str, Comparison]

    def as_plain(self) -> dict[str, Any]:
        """The row for programs."""
        return {
            "case": self.case,
            "variant": self.variant.name,
            "controller": self.variant.controller,
            "overrides": list(self.variant.overrides),
            "runs": len(self.verdict.figures),
            "falls": falls(self.verdict),
            "figures": {figure: spread(self.verdict, figure) for figure in SHOWN},
            "against_first": {figure: asdict(found) for figure, found in self.comparisons.items()},
        }


def falls(verdict: Verdict) -> int:
    """Runs that ended early."""
    return sum(bool(value) for value in verdict.values("falls"))


def ablate(
    cases: Mapping[str, Case],
    variants: Sequence[Variant],
    store: Store,
    *,
    workers: int | None = None,
    progress: Callable[[Case, int], None] | None = None,
) -> list[AblationRow]:
    """Run every variant in every case.

    Args:
        cases: name to case.
        variants: what runs; the others are compared with the first.
        store: earlier results; new ones are added as they come.
        workers: processes; None takes one per core.
        progress: called after every run.
    """
    jobs = [_with(case, variant) for case in cases.values() for variant in variants]
    verdicts = iter(run_battery(jobs, store, workers=workers, progress=progress))
    rows = []
    for name in cases:
        first: Verdict | None = None
        for variant in variants:
            verdict = next(verdicts)
            first = first or verdict
            rows.append(
                AblationRow(
                    case=name,
                    variant=variant,
                    verdict=verdict,
                    comparisons=_compared(verdict, first) if verdict is not first else {},
                )
            )
    return rows


def missing_runs(cases: Mapping[str, Case], variants: Sequence[Variant], store: Store) -> int:
    """Runs that are not in the store yet."""
    jobs = [_with(case, variant) for case in cases.values() for variant in variants]
    return sum(store.get(job, seed) is None for job in jobs for seed in job.seeds)


def criteria(rows: Sequence[AblationRow], variant: str) -> list[dict[str, Any]]:
    """What one variant must keep: the limits of its cases, and how much less than the first it must tilt."""
    found: list[dict[str, Any]] = []
    for row in rows:
        if row.variant.name != variant:
            continue
        found += limit_rows(row.verdict)
        least = model_cases.REDUCTIONS.get(row.verdict.case.name)
        if least is not None and row.comparisons:
            tilt = row.comparisons[COMPARED[-1]]
            found.append(
                {
                    "case": row.verdict.case.name,
                    "figure": COMPARED[-1],
                    "limit": f"≤ {1.0 - least:g} of the paper's laws",
                    "value": None if tilt.ratio is None else tilt.ratio.value,
                    "holds": tilt.reduces_by(least),
                }
            )
    return found


def _with(case: Case, variant: Variant) -> Case:
    overrides = (*case.options.get("overrides", ()), *variant.overrides)
    options = {**case.options, "controller": variant.controller, "overrides": overrides}
    return replace(case, options=options)


def _compared(ours: Verdict, theirs: Verdict) -> dict[str, Comparison]:
    # The same numbers on every call: an interval must not change from one look to the next.
    rng = np.random.default_rng(0)
    return {figure: compare(figure, ours.figures, theirs.figures, rng) for figure in COMPARED}
