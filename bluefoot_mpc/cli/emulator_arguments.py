"""Arguments of ``bluefoot emulator``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from bluefoot_mpc.cli.arguments import Common
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

PHYSICS = ("own", "robot")
"""What can turn the shafts of emulated servos."""


@dataclass(frozen=True, kw_only=True)
class EmulatorCommand(Common):
    """Emulate AX-12A servos, or the whole robot, on ports that other programs can open, until Ctrl-C.

    A port is a pseudo-terminal: every program for these servos may open it, at the servos' baud
    rate. With --json the line with the port comes first, and the servos run on until Ctrl-C.
    """

    ids: Annotated[str, tyro.conf.arg(metavar="ID,...")] = "1-16"
    """IDs of the servos, for example 1-16 or 1,2,7-9."""
    baud: int = 1_000_000
    """Baud rate of the servos."""
    faults: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """TOML file with faults (docs/emulator.md)."""
    link: Annotated[Path | None, tyro.conf.arg(metavar="PATH", help_behavior_hint="")] = None
    """Make a symbolic link to the port, so that its name is always the same."""
    physics: Annotated[str, tyro.conf.arg(metavar="{own,robot}")] = "own"
    """What the servos turn: joints of their own, or the simulated robot's (with its sensor board)."""
    calibration: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Robot: write the calibration that fits the emulated servos into this file."""

    def __post_init__(self) -> None:
        parse_ids(self.ids)
        if self.physics not in PHYSICS:
            raise UnknownNameError("physics", self.physics, PHYSICS)
        if self.physics == "robot" and (self.link is not None or self.ids != "1-16"):
            raise ConfigurationError("--link and --ids are for --physics own: the robot has servos 1-16")
        if self.physics == "own" and self.calibration is not None:
            raise ConfigurationError("--calibration is for --physics robot")


def parse_ids(text: str) -> tuple[int, ...]:
    """Servo IDs from a list of numbers and ranges.

    Raises:
        ConfigurationError: the text has another form, or an ID is impossible or given twice.
    """
    ids: list[int] = []
    for part in text.split(","):
        first, dash, last = (word.strip() for word in part.partition("-"))
        numbers = (first, last) if dash else (first, first)
        if not all(number.isascii() and number.isdigit() and len(number) <= 3 for number in numbers):
            raise ConfigurationError(f"--ids = '{text}' is not of the form 1-16 or 1,2,7-9")
        low, high = (int(number) for number in numbers)
        if low > high or high > 253:
            raise ConfigurationError(f"--ids = '{text}': IDs lie in 0..253, and ranges go upwards")
        ids += range(low, high + 1)
    if len(set(ids)) < len(ids):
        raise ConfigurationError(f"--ids = '{text}' has an ID twice")
    return tuple(ids)
