"""Validating a configuration: every case of the battery, resumable, then a record of it all."""

from __future__ import annotations

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from bluefoot_mpc.evaluation.battery import Store, Verdict
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.measure import Figures
from bluefoot_mpc.evaluation.validation_cases import validation_cases
from bluefoot_mpc.evaluation.validation_measure import measure_validation
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_record import Record, record_table, save_record
from bluefoot_mpc.evaluation.validation_subject import Subject, code_now
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.runtime.versions import installed_versions

RUNS = "runs.jsonl"
"""File of the runs that are done, in the working folder."""

Progress = Callable[[Case, int], None]


@dataclass(frozen=True, kw_only=True, slots=True)
class Job:
    """A validation that can be stopped, and goes on when it is started again.

    Attributes:
        subject: what is validated.
        plan: how much.
        out: working folder: runs that are done, and the configuration as it is run.
        records: where the record goes.
        workers: processes; None takes one a core.
    """

    subject: Subject
    plan: Plan
    out: Path
    records: Path
    workers: int | None = None

    def cases(self) -> tuple[Case, ...]:
        """The battery; the configuration under test is written into the working folder first.

        Raises:
            ConfigurationError: the folder cannot be written.
        """
        # Runs are kept by this name: neither another configuration nor other solvers may use them.
        file = self.out / f"config-{self.subject.sha256[:16]}-{code_now().sha256[:8]}.toml"
        try:
            self.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ConfigurationError(
                f"cannot write to --out {self.out}: {error.strerror or error}"
            ) from error
        self.subject.write(file)
        return validation_cases(self.plan, file)


def missing_runs(cases: Sequence[Case], store: Store) -> list[tuple[Case, int]]:
    """Runs that are still to be made."""
    return [(case, seed) for case in cases for seed in case.seeds if store.get(case, seed) is None]


def validate(job: Job, cases: Sequence[Case], store: Store, progress: Progress | None = None) -> Record:
    """Make the runs that are missing, judge all, and write the record.

    Args:
        job: what and where.
        cases: of `Job.cases`.
        store: runs that are done.
        progress: called after every run.

    Raises:
        ConfigurationError: the record cannot be written.
    """
    code, began = code_now(), datetime.now(UTC)
    workers = job.workers or os.cpu_count() or 1
    for case, seed, figures in _runs(missing_runs(cases, store), workers):
        store.put(case, seed, figures)
        if progress is not None:
            progress(case, seed)
    verdicts = [
        Verdict(case=case, figures={seed: store.get(case, seed) or {} for seed in case.seeds})
        for case in cases
    ]
    if code_now() != code:
        raise ConfigurationError(
            "the code was changed while it was validated: no record was written. Validate again"
        )
    now = datetime.now(UTC)
    extra = {
        "made": now.isoformat(timespec="seconds"),
        "took_s": round((now - began).total_seconds(), 1),
        "versions": installed_versions(),
    }
    return save_record(job.records, record_table(job.subject, code, job.plan, verdicts, extra))


def _runs(jobs: Sequence[tuple[Case, int]], workers: int) -> Iterator[tuple[Case, int, Figures]]:
    if workers == 1 or len(jobs) < 2:
        for case, seed in jobs:
            yield case, seed, measure_validation(case, seed)
        return
    # Forked children would inherit threads of the linear algebra: start fresh ones.
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(
        max_workers=min(workers, len(jobs)), mp_context=context,
        initializer=signal.signal, initargs=(signal.SIGINT, signal.SIG_IGN),
    ) as pool:  # fmt: skip
        waiting = {pool.submit(measure_validation, case, seed): (case, seed) for case, seed in jobs}
        try:
            for future in as_completed(waiting):
                yield (*waiting[future], future.result())
        except BaseException:
            # Ctrl-C. A run that is under way would bring its robot to rest first: it is only a simulated one.
            ended = set(multiprocessing.active_children()) - others
            for child in ended:
                child.kill()
            pool.shutdown(wait=False, cancel_futures=True)
            for child in ended:
                child.join()
            raise
