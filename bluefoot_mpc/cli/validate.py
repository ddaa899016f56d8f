"""``bluefoot validate``: try a configuration before it may move the robot, and keep the result."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from rich import progress as bars
from rich.console import Console

from bluefoot_mpc.cli.outcome import FAILED, OK, Outcome
from bluefoot_mpc.cli.validate_arguments import ValidateCommand
from bluefoot_mpc.cli.validate_page import validation_page
from bluefoot_mpc.evaluation.battery import Store
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.validation import RUNS, Job, Progress, missing_runs
from bluefoot_mpc.evaluation.validation import validate as run_validation
from bluefoot_mpc.evaluation.validation_record import records_folder
from bluefoot_mpc.evaluation.validation_subject import subject_of
from bluefoot_mpc.scenarios import RunOptions


def validate(command: ValidateCommand) -> Outcome:
    """Make the runs that are missing, write the record, show the table."""
    job = Job(
        subject=subject_of(RunOptions(**command.run_fields())), plan=command.plan(), out=command.out,
        records=records_folder(command.records), workers=command.workers,
    )  # fmt: skip
    cases = job.cases()
    store = Store(command.out / RUNS)
    with _told_where_to_go_on(job.out), _bar(len(missing_runs(cases, store))) as done:
        record = run_validation(job, cases, store, done)
    status = OK if record.passed else FAILED
    deployable = record.passed and job.plan.is_full
    data = {**record.table, "record": record.file, "deployable": deployable, "exit_status": status}
    return Outcome(
        status=status,
        data=data,
        page=validation_page(record, command.run_fields()["config"], command.deploy_words()),
    )


@contextmanager
def _told_where_to_go_on(out: Path) -> Iterator[None]:
    try:
        yield
    except KeyboardInterrupt as stop:
        stop.add_note(f"no record was written; the runs that are done are in {out}: the same command goes on")
        raise


@contextmanager
def _bar(total: int) -> Iterator[Progress]:
    """A bar on a terminal; piped, nothing."""
    console = Console(stderr=True)
    if not console.is_terminal:
        yield lambda case, seed: None
        return
    columns = (bars.TextColumn("{task.description}"), bars.BarColumn(), bars.MofNCompleteColumn())
    with bars.Progress(*columns, bars.TimeRemainingColumn(), console=console, transient=True) as bar:
        task = bar.add_task("validate", total=total)
        yield _advancing(bar, task)


def _advancing(bar: bars.Progress, task: bars.TaskID) -> Callable[[Case, int], None]:
    return lambda case, seed: bar.update(task, advance=1, description=f"{case.name}, seed {seed}")
