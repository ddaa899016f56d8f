"""Arguments of ``bluefoot doctor``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from bluefoot_mpc.cli.arguments import ModelArguments
from bluefoot_mpc.cli.servo_arguments import ServoArguments
from bluefoot_mpc.exceptions import ConfigurationError


@dataclass(frozen=True, kw_only=True)
class DoctorCommand(ServoArguments, ModelArguments):
    """Check robot and software, and say how to mend each finding; writes nothing, gives no torque.

    Without devices it checks the software alone. Exit status 3 where something would refuse to be armed.
    """

    lidar: Annotated[str | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")] = None
    """Serial port of the LIDAR."""
    lidar_baud: int = 115_200
    """Baud rate of the LIDAR."""
    calibration: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Calibration file (calibration.toml where there is one)."""
    seconds: float = 2.0
    """How long timing and sensors are watched, s."""

    def __post_init__(self) -> None:
        if not 0.2 <= self.seconds <= 60.0:
            raise ConfigurationError(f"--seconds = {self.seconds:g} must lie in 0.2..60")
