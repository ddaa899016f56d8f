"""``bluefoot list`` and ``bluefoot run``."""

from __future__ import annotations

import dataclasses
import logging

from rich.table import Table

from bluefoot_mpc.cli.arguments import ListCommand, RunCommand
from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.cli.summary import summary_page
from bluefoot_mpc.runtime.data import happenings
from bluefoot_mpc.scenarios import RunOptions, RunResult, scenario_names
from bluefoot_mpc.scenarios import run as run_scenario

log = logging.getLogger(__name__)


def list_scenarios(_: ListCommand) -> Outcome:
    """Name every scenario that ships."""
    names = scenario_names()
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    for name, line in names.items():
        table.add_row(name, line)
    return Outcome(data={"scenarios": names}, page=(table, "\nRun one with: bluefoot run NAME"))


def run(command: RunCommand) -> Outcome:
    """Run a scenario by name or script."""
    if command.robot == "hardware":
        log.warning("nothing asks here whether this configuration was validated; bluefoot deploy does")
    return outcome_of(run_scenario(command.scenario, RunOptions(**command.run_fields())))


def outcome_of(result: RunResult) -> Outcome:
    """A finished run as data and as a page."""
    criteria = [dataclasses.asdict(criterion) for criterion in result.criteria]
    extra = {"criteria": criteria, "folder": result.folder, "exit_status": result.exit_status}
    return Outcome(
        status=result.exit_status,
        data={**result.summary, **extra},
        page=summary_page(result.summary, result.criteria, result.folder, happenings(result.data.telemetry)),
    )
