"""Arguments of ``bluefoot deploy``."""

from __future__ import annotations

import json
import shlex
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import tyro

from bluefoot_mpc.cli.arguments import Common
from bluefoot_mpc.control.names import DEFAULT_CONTROLLER

_Unset = tyro.conf.arg(help_behavior_hint="")


@dataclass(frozen=True, kw_only=True)
class DeployCommand(Common):
    """Run a validated configuration on the robot, after every gate was passed.

    Asked for are: a record of 'bluefoot validate' that passed, for exactly this configuration and this
    code; a calibration that holds; servos, board and timing without a refusal ('bluefoot doctor'); and a
    person at the robot who says so. Exit status 3 where a gate refuses; no torque is on then.
    """

    config: Annotated[Path | None, _Unset] = None
    """TOML file with any part of the configuration; without one, the configuration that ships."""
    port: Annotated[
        tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="PATH", help_behavior_hint="")
    ] = ()
    """Serial port of the servos; again for each further one."""
    baud: Annotated[int | None, tyro.conf.arg(help_behavior_hint="(default: 1000000)")] = None
    """Rate of the servos' bus, bit/s."""
    board: Annotated[str | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")] = None
    """Serial port of the sensor and power board."""
    calibration: Annotated[
        Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="(default: calibration.toml)")
    ] = None
    """Calibration of this robot."""
    scenario: str = "stand"
    """What to run: a scenario's name, or the path of a scenario script."""
    duration: Annotated[float | None, _Unset] = None
    """Length of the run, s."""
    speed: Annotated[float | None, _Unset] = None
    """Forward speed, m/s; no faster than was validated."""
    gait: Annotated[str | None, tyro.conf.arg(metavar="{trot,walk}", help_behavior_hint="")] = None
    """Gait to walk with, as validated."""
    model: Annotated[str | None, _Unset] = None
    """Parameter file of the robot (TOML), or the name of one that ships."""
    controller: Annotated[
        str | None,
        tyro.conf.arg(metavar="{cpg,mpc}", help_behavior_hint=f"(default: {DEFAULT_CONTROLLER})"),
    ] = None
    """What decides."""
    station: Annotated[str | None, tyro.conf.arg(metavar="ADDRESS", help_behavior_hint="")] = None
    """Address of a ground station, e.g. udp:127.0.0.1:14550."""
    out: Annotated[Path | None, _Unset] = None
    """Folder for the results (runs/<time>-<scenario> unless given)."""
    no_report: bool = False
    """Do not write report.html."""
    records: Annotated[Path | None, tyro.conf.arg(metavar="DIR", help_behavior_hint="")] = None
    """Folder of the records ($BLUEFOOT_RECORDS, or ~/.local/share/bluefoot/validation, unless given)."""
    dry_run: bool = False
    """Show what would be done and how every gate stands; no torque. Exit status 0 or 3."""
    yes_i_am_at_the_robot: bool = False
    """Do not ask: a person stands at the robot, the emergency switch in reach."""

    def run_fields(self) -> dict[str, Any]:
        """Arguments by the names that RunOptions gives them."""
        names = (
            "config",
            "port",
            "baud",
            "duration",
            "speed",
            "gait",
            "model",
            "controller",
            "station",
            "out",
        )
        fields = {name: getattr(self, name) for name in names}
        places = {"board_port": self.board, "calibration": self.calibration}
        overrides = tuple(
            # A JSON string is a TOML string.
            f"devices.{key}={json.dumps(str(value))}"
            for key, value in places.items()
            if value is not None
        )
        return {**fields, "robot": "hardware", "overrides": overrides, "report": not self.no_report}

    def validate_words(self) -> str:
        """The command that makes the record which is asked for."""
        words = ["bluefoot", "validate"]
        if self.config is not None:
            words.append(str(self.config))
        for option in ("model", "controller", "records"):
            value = getattr(self, option)
            words += [f"--{option}", str(value)] if value is not None else []
        return shlex.join(words)
