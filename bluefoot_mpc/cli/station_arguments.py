"""Arguments of ``bluefoot station``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from bluefoot_mpc.cli.arguments import Common
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError

ROBOTS = ("none", "sim", "emulator")
"""What `bluefoot station` can start itself."""


@dataclass(frozen=True, kw_only=True)
class StationCommand(Common):
    """Watch and drive a robot over its radio, from a page in the browser, the keyboard or a gamepad.

    With --robot sim one command starts a simulated robot and shows everything. Else start the robot
    with: bluefoot run remote --station ADDRESS. Everything received and sent is kept in a log.
    """

    connect: Annotated[str, tyro.conf.arg(metavar="ADDRESS")] = "udpin:127.0.0.1:14550"
    """Where the robot is: udpin:HOST:PORT (wait for it there), udp:HOST:PORT, serial:PATH:BAUD."""
    key: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Key that both ends sign with (32 bytes): forged and replayed commands are refused."""
    robot: Annotated[str, tyro.conf.arg(metavar="{none,sim,emulator}")] = "none"
    """Start a robot of this kind here, and end it with the station."""
    controller: Annotated[str | None, tyro.conf.arg(metavar="{cpg,mpc}", help_behavior_hint="")] = None
    """What decides in the robot that is started here."""
    world: Annotated[str | None, tyro.conf.arg(metavar="NAME", help_behavior_hint="")] = None
    """World of the robot that is started here: room, corridors, chairs ... (see: bluefoot run --help)."""
    set: Annotated[
        tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="SECTION.KEY=VALUE")
    ] = ()
    """One value of the configuration of the robot that is started here."""
    host: str = "127.0.0.1"
    """Interface to serve the page on; any but this machine's own adds a token to the address."""
    page_port: Annotated[int | None, tyro.conf.arg(metavar="PORT", help_behavior_hint="")] = None
    """Port of the page (the first that is free from 7100 on unless given)."""
    no_page: bool = False
    """Do not serve a page: keyboard and gamepad only."""
    log: Annotated[Path | None, tyro.conf.arg(metavar="FILE", help_behavior_hint="")] = None
    """Operator's log, JSON lines (runs/<time>-station/operator.jsonl unless given)."""
    timeout: float = 5.0
    """Dead man: seconds without a key until the robot stops walking."""
    gamepad: Path = Path("/dev/input/js0")
    """Device of the gamepad; used where there is one."""

    def __post_init__(self) -> None:
        if self.robot not in ROBOTS:
            raise UnknownNameError("robot", self.robot, ROBOTS)
        if not 0.0 < self.timeout <= 600.0:
            raise ConfigurationError(f"--timeout = {self.timeout} must lie in 0..600 seconds, 0 excluded")
        if self.page_port is not None and not 1 <= self.page_port <= 65535:
            raise ConfigurationError(f"--page-port = {self.page_port} must lie in 1..65535")
        if self.robot == "none" and (self.world is not None or self.set):
            raise ConfigurationError(
                "--world and --set are for a robot that is started here: add --robot sim"
            )
        if self.robot != "none" and not self.connect.startswith("udpin:"):
            raise ConfigurationError(
                f"--robot {self.robot} starts a robot that speaks over UDP: leave --connect out, "
                "or take udpin:HOST:PORT"
            )

    @property
    def address(self) -> str:
        """The link's address with its key."""
        return self.connect if self.key is None else f"{self.connect},key={self.key}"
