"""Arguments of ``bluefoot validate``."""

from __future__ import annotations

import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from bluefoot_mpc.cli.arguments import Common
from bluefoot_mpc.control.names import DEFAULT_CONTROLLER
from bluefoot_mpc.evaluation.validation_plan import LEAST_SEEDS, Plan
from bluefoot_mpc.exceptions import ConfigurationError

_Unset = tyro.conf.arg(help_behavior_hint="")


@dataclass(frozen=True, kw_only=True)
class ValidateCommand(Common):
    """Try a configuration in simulation and on emulated devices, and record whether it may be deployed.

    Standing, walking, a push, a controlled and an emergency stop, each over several robots drawn at
    random. The record goes under the hash of the configuration and is what 'bluefoot deploy' asks for.
    Runs are kept in the output folder: a validation that was stopped goes on where it stopped.
    Exit status 1 where a limit is broken; a record is written then, too.
    """

    config_file: Annotated[
        tuple[Path, ...],
        tyro.conf.Positional,
        tyro.conf.arg(metavar="[CONFIG.toml]", help_behavior_hint=""),
    ] = ()
    """TOML file with any part of the configuration, as in a run's config.toml; without one, the
    configuration that ships is validated."""
    config: Annotated[Path | None, _Unset] = None
    """The same file, as 'run' and 'deploy' take it."""
    model: Annotated[str | None, _Unset] = None
    """Parameter file of the robot (TOML), or the name of one that ships."""
    controller: Annotated[
        str | None,
        tyro.conf.arg(metavar="{cpg,mpc}", help_behavior_hint=f"(default: {DEFAULT_CONTROLLER})"),
    ] = None
    """What decides."""
    scenario_speed: float = 0.06
    """Forward speed of the walks, m/s: a deployment may not walk faster."""
    gait: Annotated[str, tyro.conf.arg(metavar="{trot,walk}")] = "trot"
    """Gait of the walks."""
    seeds: int = LEAST_SEEDS
    """Robots that every situation is tried with; a deployment asks for this many at least."""
    quick: bool = False
    """One robot and shorter walks: shows a mistake early, allows no deployment."""
    workers: Annotated[int | None, _Unset] = None
    """Processes for the runs (one per core unless given)."""
    out: Path = Path("runs/validate")
    """Working folder: the runs that are done."""
    records: Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")] = None
    """Folder of the records ($BLUEFOOT_RECORDS, or ~/.local/share/bluefoot/validation, unless given)."""

    def __post_init__(self) -> None:
        given = [*self.config_file, *([] if self.config is None else [self.config])]
        if len(given) > 1:
            raise ConfigurationError(f"two configurations: {given[0]} and {given[1]}; give one")
        if self.workers is not None and self.workers < 1:
            raise ConfigurationError(f"--workers = {self.workers} must be at least 1")
        self.plan()

    def plan(self) -> Plan:
        """How much is validated.

        Raises:
            ConfigurationError: a value is impossible.
        """
        return Plan(speed=self.scenario_speed, gait=self.gait, seeds=self.seeds, quick=self.quick)

    def run_fields(self) -> dict[str, Any]:
        """What chooses the configuration, by the names that RunOptions gives it."""
        config = next(iter(self.config_file), self.config)
        return {"config": config, "model": self.model, "controller": self.controller}

    def deploy_words(self) -> str:
        """The command that deploys what was validated."""
        words = ["bluefoot", "deploy"]
        for option, value in {**self.run_fields(), "records": self.records}.items():
            words += [f"--{option}", str(value)] if value is not None else []
        return shlex.join([*words, "--dry-run"])
