"""The search itself: an optuna study on a file, which goes on where it was left.

Every trial runs the same seeds, a few at first and more only while it keeps up
with the earlier trials, so most of the time goes to good points. The budget is
a number of trials, whatever the controller, so that two controllers tuned with
the same budget compare fairly.
"""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import optuna

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.tuning.cases import TuningCase, measure
from bluefoot_mpc.tuning.objective import Figures, cost
from bluefoot_mpc.tuning.path import Candidate
from bluefoot_mpc.tuning.space import Space, Values

Measure = Callable[[TuningCase, str, tuple[str, ...], int], Figures]
"""Runs a case with a controller, overrides and a seed."""

Judge = Callable[[Sequence[TuningCase], Mapping[str, Sequence[Figures]]], float]
"""Makes one cost of the figures of every case, by name, in the order of the seeds; smaller is better."""

FIRST_SEED = 100
"""Seeds below this are kept for figures that are reported: no study may use them."""
_FINISHED = (optuna.trial.TrialState.COMPLETE, optuna.trial.TrialState.PRUNED)


@dataclass(frozen=True, kw_only=True, slots=True)
class StudyConfig:
    """How a search runs."""

    name: str  # of the study; the same name and file go on with the same study
    storage: Path | None = None  # SQLite file; None keeps the study in memory
    controller: str = "cpg"
    trials: int = 100  # budget, pruned ones included
    seeds: tuple[int, ...] = tuple(range(FIRST_SEED, FIRST_SEED + 6))
    rungs: tuple[int, ...] = (2, 6)  # seeds after which a trial has to have kept up
    keep: float = 0.33  # share of the trials that goes on beyond a rung
    startup: int = 6  # trials before the search models and compares anything
    sampler_seed: int = 0

    def __post_init__(self) -> None:
        """Check ranges, and that no reported seed is used."""
        require_positive(trials=self.trials, startup=self.startup)
        require_range(0.01, 1.0, keep=self.keep)
        if not self.seeds or min(self.seeds) < FIRST_SEED:
            raise ConfigurationError(
                f"seeds = {self.seeds!r} must be {FIRST_SEED} or more: those below are for reported figures"
            )
        rising = all(a < b for a, b in zip(self.rungs, self.rungs[1:], strict=False))
        if not self.rungs or not rising or self.rungs[0] < 1 or self.rungs[-1] != len(self.seeds):
            raise ConfigurationError(
                f"rungs = {self.rungs!r} must rise and end at the number of seeds ({len(self.seeds)})"
            )


@dataclass(frozen=True, kw_only=True, slots=True)
class StudyResult:
    """The best point of a study.

    Attributes:
        values: the point.
        overrides: the same as settings.
        cost: its cost over all seeds.
        trials: how many trials were spent.
        figures: figures by case and seed.
    """

    values: Values
    overrides: tuple[str, ...]
    cost: float
    trials: int
    figures: Mapping[str, Mapping[str, Mapping[str, float]]] = field(default_factory=dict)


def weighted_cost(cases: Sequence[TuningCase], seen: Mapping[str, Sequence[Figures]]) -> float:
    """Mean of the cases' costs against their bars, by their weights."""
    whole = sum(case.weight for case in cases)
    return sum(case.weight * cost(seen[case.name], case.bars) for case in cases) / whole


def run_study(
    config: StudyConfig,
    space: Space,
    cases: Sequence[TuningCase],
    start: Sequence[Mapping[str, float]] = (),
    evaluate: Measure = measure,
    judge: Judge = weighted_cost,
) -> StudyResult:
    """Search until the budget is spent; a study on a file counts its earlier trials.

    Args:
        config: budget, seeds and storage.
        space: what may vary.
        cases: what each point is judged on.
        start: points to try first, in this order; skipped where the study has them already.
        evaluate: runs one seed of one case.
        judge: makes one cost of all figures.

    Raises:
        ConfigurationError: there is no case, or a start point does not fit the space.
    """
    if not cases:
        raise ConfigurationError("a study needs at least one case")
    study = _open(config)
    for point in start:
        study.enqueue_trial(space.checked(point), skip_if_exists=True)

    def objective(trial: optuna.Trial) -> float:
        return _trial(trial, config, space, cases, (evaluate, judge))

    while (left := config.trials - _spent(study)) > 0:
        study.optimize(objective, n_trials=left)
    return best(study, space)


def best(study: optuna.Study, space: Space) -> StudyResult:
    """The best point of a study, which must have one that met every rung."""
    trial = study.best_trial
    values = space.checked(trial.params)
    return StudyResult(
        values=values,
        overrides=space.overrides(values),
        cost=float(trial.value if trial.value is not None else float("nan")),
        trials=_spent(study),
        figures=json.loads(trial.user_attrs["figures"]),
    )


def candidates(config: StudyConfig, space: Space, count: int) -> list[Candidate]:
    """The best points of a study that met every rung, best first, `count` at most."""
    complete = _open(config).get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    found = [
        Candidate(space.checked(trial.params), trial.value) for trial in complete if trial.value is not None
    ]
    return sorted(found, key=lambda candidate: candidate.cost)[:count]


def _open(config: StudyConfig) -> optuna.Study:
    """The study on its file, or a new one; a killed worker's trial is tried again."""
    storage: optuna.storages.BaseStorage | None = None
    if config.storage is not None:
        config.storage.parent.mkdir(parents=True, exist_ok=True)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
            storage = optuna.storages.RDBStorage(
                f"sqlite:///{config.storage}",
                heartbeat_interval=60,
                heartbeat_stale_trial_callback=optuna.storages.RetryHeartbeatStaleTrialCallback(),
            )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
        sampler = optuna.samplers.TPESampler(
            seed=config.sampler_seed, n_startup_trials=config.startup, multivariate=True
        )
    pruner = optuna.pruners.PercentilePruner(100.0 * config.keep, n_startup_trials=config.startup)
    return optuna.create_study(
        study_name=config.name, storage=storage, sampler=sampler, pruner=pruner, load_if_exists=True
    )


def _spent(study: optuna.Study) -> int:
    return len(study.get_trials(deepcopy=False, states=_FINISHED))


def _trial(
    trial: optuna.Trial,
    config: StudyConfig,
    space: Space,
    cases: Sequence[TuningCase],
    how: tuple[Measure, Judge],
) -> float:
    """Cost of one point over all seeds, given up at a rung where it falls behind."""
    evaluate, judge = how
    values = {
        p.name: trial.suggest_float(p.name, p.low, p.high, step=p.step, log=p.log) for p in space.parameters
    }
    overrides = space.overrides(values)
    seen: dict[str, dict[int, Figures]] = {case.name: {} for case in cases}
    total, done = float("inf"), 0
    for rung in config.rungs:
        for seed in config.seeds[done:rung]:
            for case in cases:
                seen[case.name][seed] = evaluate(case, config.controller, overrides, seed)
        done = rung
        total = judge(cases, {name: list(runs.values()) for name, runs in seen.items()})
        trial.report(total, rung)
        record = {name: {seed: asdict(f) for seed, f in runs.items()} for name, runs in seen.items()}
        trial.set_user_attr("figures", json.dumps(record))
        if rung < config.rungs[-1] and trial.should_prune():
            raise optuna.TrialPruned
    return total
