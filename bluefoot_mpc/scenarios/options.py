"""Options that every run takes, whatever the scenario: what the command line and scripts fill in."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from bluefoot_mpc.control.names import CONTROLLERS
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

ROBOTS = ("sim", "emulator", "hardware")
LINKS = ("memory", "pty")
"""How an emulated robot is reached: in this process on a virtual clock, or in real time over terminals."""
RANDOMIZATIONS = ("none", "standard")
GAITS = ("trot", "walk")
LEVELS = ("none", "pd", "narx")
"""No levelling, attitude feedback alone, and with the disturbance that the network predicts."""
MIN_BAUD, MAX_BAUD = 7843, 1_000_000
"""bit/s, what register 4 of an AX-12A can choose."""
MAX_SEED = 2**63 - 1
"""Largest whole number that TOML and the log can hold."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RunOptions:
    """What a user may choose for one run; ``None`` leaves the scenario's own value.

    Raises:
        ConfigurationError: a value is impossible, naming it.
        UnknownNameError: a name is not one of the valid choices.
    """

    robot: str = "sim"
    port: tuple[str, ...] = ()  # serial ports of the servos, for hardware
    baud: int | None = None  # bit/s of the servos' bus
    link: str | None = None  # one of LINKS, for the emulator
    station: str | None = None  # address of a ground station
    controller: str | None = None  # None: what the configuration file says, or the default
    model: str | None = None  # parameter file, or the name of one that ships
    seed: int = 0
    duration: float | None = None  # s
    out: Path | None = None  # folder for the results
    view: bool = False
    config: Path | None = None  # TOML with any part of the resolved configuration
    overrides: tuple[str, ...] = ()  # "section.key=value"
    randomize: str = "none"
    report: bool = True
    world: str | None = None  # name or file
    friction: float | None = None
    slope: float | None = None  # degrees, positive climbs
    payload: tuple[float, float, float, float] | None = None  # kg, x, y, z in the base frame (m)
    gait: str | None = None
    speed: float | None = None  # m/s
    lateral_speed: float | None = None  # m/s
    yaw_rate: float | None = None  # rad/s
    impulse: float | None = None  # N·s
    direction: float | None = None  # degrees from forward, left positive
    push_time: float | None = None  # s
    leader: str | None = None  # kind of a wheeled robot, see bluefoot_mpc.wheels.ready
    blind: bool | None = None  # cross rough ground without looking
    level: str | None = None  # trunk levelling, one of LEVELS
    level_mix: float | None = None  # share of the levelling goals, between 0 and 1

    def __post_init__(self) -> None:
        _require_choice("robot", self.robot, ROBOTS)
        self._check_devices()
        if self.controller is not None:
            _require_choice("controller", self.controller, CONTROLLERS)
        _require_choice("randomization", self.randomize, RANDOMIZATIONS)
        if self.gait is not None:
            _require_choice("gait", self.gait, GAITS)
        if self.level is not None:
            _require_choice("levelling", self.level, LEVELS)
        if self.level_mix is not None and not 0.0 < self.level_mix < 1.0:
            raise ConfigurationError(
                f"--level-mix = {self.level_mix} must lie between 0 and 1, both excluded"
            )
        for name in ("speed", "lateral_speed", "yaw_rate", "slope", "direction"):
            value = getattr(self, name)
            if value is not None and not math.isfinite(value):
                raise ConfigurationError(f"--{name.replace('_', '-')} = {value} must be a finite number")
        if self.payload is not None and not all(map(math.isfinite, self.payload)):
            raise ConfigurationError(f"--payload = {self.payload} must be finite numbers KG,X,Y,Z")
        for name in ("duration", "friction", "impulse"):
            _require_positive(name, getattr(self, name))
        if self.push_time is not None and not (math.isfinite(self.push_time) and self.push_time >= 0.0):
            raise ConfigurationError(f"--push-time = {self.push_time} must not be negative (seconds)")
        if not 0 <= self.seed <= MAX_SEED:
            raise ConfigurationError(f"--seed = {self.seed} must lie in 0..{MAX_SEED}")

    def _check_devices(self) -> None:
        """Options of devices fit the robot that has them."""
        if self.link is not None:
            _require_choice("link", self.link, LINKS)
        if self.link is not None and self.robot != "emulator":
            raise ConfigurationError("--link is for --robot emulator; real servos are reached by --port")
        if (self.port or self.baud is not None) and self.robot != "hardware":
            raise ConfigurationError("--port and --baud are for --robot hardware; an emulator brings its own")
        if self.baud is not None and not MIN_BAUD <= self.baud <= MAX_BAUD:
            raise ConfigurationError(f"--baud = {self.baud} must lie in {MIN_BAUD}..{MAX_BAUD}")


def _require_choice(kind: str, value: str, valid: tuple[str, ...]) -> None:
    if value not in valid:
        raise UnknownNameError(kind, value, valid)


def _require_positive(name: str, value: float | None) -> None:
    if value is not None and not (math.isfinite(value) and value > 0.0):
        raise ConfigurationError(f"--{name} = {value} must be a positive number")
