"""The levelling ablation: every part over the same seeds, against its own off windows and the other parts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from bluefoot_mpc.evaluation.battery import Store, Verdict, run_battery
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.comparison import Comparison, compare
from bluefoot_mpc.evaluation.level_measure import AXES, ON_WINDOWS
from bluefoot_mpc.evaluation.level_parts import FEEDBACK, NETWORK, PERSISTENCE, LevelPart, parts_of, with_part
from bluefoot_mpc.evaluation.tables import limit_rows, spread

COMPARED = tuple(f"on_{axis}_rms_deg" for axis in AXES)
"""Figures that rows are compared by; the last, both axes together, is what is judged."""
CREDIT = 0.10
"""Least part by which the network must lie under feedback and under persistence to be credited."""
CREDITED = "credited"
LEAST_PAIRS = 5
"""Fewer runs prove nothing, whatever their interval says."""
SHOWN = (
    *(f"{kind}_{axis}_rms_deg" for kind in ("off", "on") for axis in AXES),
    *(f"{axis}_reduction_percent" for axis in AXES),
    *(f"{axis}_smooth_reduction_percent" for axis in AXES),
    *(f"{axis}_reduction_{k + 1}_percent" for axis in AXES for k in range(ON_WINDOWS)),
    "off_tilt_peak_deg", "on_tilt_peak_deg", "tilt_peak_reduction_percent",
    "off_speed_mmps", "on_speed_mmps", "speed_change_percent", "height_change_mm", "attitude_error_deg",
)  # fmt: skip
"""Figures whose spread over the seeds each row holds."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelRow:
    """One part in one case.

    Attributes:
        case: name of the case.
        part: what levelled.
        verdict: its figures over the seeds.
        against: other row to figure to comparison with it: feedback and persistence, where they ran.
    """

    case: str
    part: LevelPart
    verdict: Verdict
    against: Mapping[str, Mapping[str, Comparison]]

    def as_plain(self) -> dict[str, Any]:
        """The row for programs; spreads are over the runs that stayed on their feet."""
        return {
            "case": self.case,
            "part": self.part.name,
            "controller": self.verdict.case.options["controller"],
            "overrides": list(self.verdict.case.options["overrides"]),
            "runs": len(self.verdict.figures),
            "falls": self.count("falls"),
            "disengaged": self.count("disengaged"),
            "figures": {figure: spread(_standing(self.verdict), figure) for figure in SHOWN},
            "against": {
                other: {figure: asdict(found) for figure, found in comparisons.items()}
                for other, comparisons in self.against.items()
            },
        }

    def count(self, figure: str) -> int:
        """Runs in which something happened."""
        return sum(bool(value) for value in self.verdict.values(figure))


def ablate_leveling(
    cases: Mapping[str, Case],
    parts: Sequence[LevelPart],
    store: Store,
    *,
    workers: int | None = None,
    progress: Callable[[Case, int], None] | None = None,
) -> list[LevelRow]:
    """Run every part in every case for whose controller it is meant.

    Args:
        cases: name to case.
        parts: what levels.
        store: earlier results; new ones are added as they come.
        workers: processes; None takes one per core.
        progress: called after every run.

    Raises:
        ConfigurationError: a case is under a controller for which none of the parts is meant.
    """
    jobs = _jobs(cases, parts)
    found = run_battery([job for _, _, job in jobs], store, workers=workers, progress=progress)
    verdicts = {(name, part.name): v for (name, part, _), v in zip(jobs, found, strict=True)}
    return [
        LevelRow(
            case=name,
            part=part,
            verdict=verdicts[name, part.name],
            against={
                other: _compared(verdicts[name, part.name], verdicts[name, other])
                for other in (FEEDBACK, PERSISTENCE)
                if other != part.name and (name, other) in verdicts
            },
        )
        for name, part, _ in jobs
    ]


def missing_level_runs(cases: Mapping[str, Case], parts: Sequence[LevelPart], store: Store) -> int:
    """Runs that are not in the store yet.

    Raises:
        ConfigurationError: a case is under a controller for which none of the parts is meant.
    """
    return sum(store.get(job, seed) is None for _, _, job in _jobs(cases, parts) for seed in job.seeds)


def credits_of(rows: Sequence[LevelRow]) -> list[dict[str, Any]]:
    """Case by case, whether the network is worth having, and why not.

    It is credited where the trunk tilts less with it than without levelling, and by at
    least `CREDIT` less than with feedback alone and than with persistence, both intervals
    ending short of no difference. Cases that lack one of the three rows are not judged.
    """
    found = []
    for row in rows:
        if row.part.name != NETWORK or {FEEDBACK, PERSISTENCE} - row.against.keys():
            continue
        tilts = {other: comparisons[COMPARED[-1]] for other, comparisons in row.against.items()}
        verdict = _judged(spread(_standing(row.verdict), "tilt_reduction_percent"), tilts)
        found.append(
            {
                "case": row.case,
                "credited": verdict == CREDITED,
                "verdict": verdict,
                "against": {other: asdict(tilt) for other, tilt in tilts.items()},
            }
        )
    return found


def level_criteria(rows: Sequence[LevelRow]) -> list[dict[str, Any]]:
    """What levelling as it is delivered must keep, case by case: that is feedback with the network."""
    return [limit for row in rows if row.part.name == NETWORK for limit in limit_rows(row.verdict)]


def _judged(reduction: Mapping[str, float] | None, tilts: Mapping[str, Comparison]) -> str:
    if min(tilt.pairs for tilt in tilts.values()) < LEAST_PAIRS:
        return "too few runs"
    if reduction is None or reduction["median"] <= 0.0:
        return "does harm"
    for other, tilt in tilts.items():
        if not tilt.reduces_by(CREDIT) or tilt.ratio is None or tilt.ratio.high >= 1.0:
            return f"no better than {other}"
    return CREDITED


def _jobs(cases: Mapping[str, Case], parts: Sequence[LevelPart]) -> list[tuple[str, LevelPart, Case]]:
    return [
        (name, part, with_part(case, part))
        for name, case in cases.items()
        for part in parts_of(name, case, parts)
    ]


def _standing(verdict: Verdict) -> Verdict:
    standing = {seed: seen for seed, seen in verdict.figures.items() if not seen.get("falls")}
    return replace(verdict, figures=standing)


def _compared(ours: Verdict, theirs: Verdict) -> dict[str, Comparison]:
    # The same numbers on every call: an interval must not change from one look to the next.
    rng = np.random.default_rng(0)
    return {figure: compare(figure, ours.figures, theirs.figures, rng) for figure in COMPARED}
