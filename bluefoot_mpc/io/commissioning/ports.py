"""Ports with servos on them: opened together, closed together, and left without torque whatever happens."""

from __future__ import annotations

import contextlib
import logging
import signal
from collections.abc import Callable, Iterator, Sequence
from types import FrameType, TracebackType
from typing import Self

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.dynamixel.arming import broadcast_off
from bluefoot_mpc.io.dynamixel.bus import BusConfig, ServoBus
from bluefoot_mpc.io.dynamixel.errors import ServoError
from bluefoot_mpc.io.link import Link, LinkError
from bluefoot_mpc.io.serial_link import SerialLink

log = logging.getLogger(__name__)

STANDARD_BAUDS = (1_000_000, 57_600, 115_200, 500_000, 200_000, 250_000, 400_000, 19_200, 9_600)
"""Rates that an AX-12A can have (e-manual, address 4), likely ones first."""

PATIENCE = 0.02
"""s that a reply may be late."""

Opener = Callable[[str, int, Clock], Link]
"""Opens a port at a baud rate."""


class ServoPorts:
    """One or more ports, and which servo hangs on which.

    Args:
        ports: device files.
        baud: bit/s of all.
        allow_eeprom: permanent memory may be written; for set-up alone.
        clock: real time unless given.
        opener: how a port is opened; serial ports unless given.

    Attributes:
        buses: one a port.
        clock: of all ports.

    Raises:
        LinkError: a port cannot be opened; all others are closed again.
    """

    def __init__(
        self,
        ports: Sequence[str],
        baud: int,
        *,
        allow_eeprom: bool = False,
        clock: Clock | None = None,
        opener: Opener = SerialLink,
    ) -> None:
        self.clock = clock or MonotonicClock()
        self.baud = baud
        self._opener = opener
        # Nobody is in a hurry here: a host that is busy must not look like a servo that is missing.
        self._config = BusConfig(allow_eeprom=allow_eeprom, margin=PATIENCE)
        self.buses: list[ServoBus] = []
        try:
            for port in ports:
                self.buses.append(self._open(port, baud))
        except LinkError:
            self.close()
            raise

    def close(self) -> None:
        """Close all ports. Idempotent."""
        for bus in self.buses:
            bus.link.close()

    def __enter__(self) -> Self:
        """The ports themselves."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()

    def change_baud(self, baud: int) -> None:
        """Talk at another rate from now on.

        Raises:
            LinkError: a port does not come back, or refuses the rate.
        """
        for index, bus in enumerate(self.buses):
            bus.link.close()
            self.buses[index] = self._open(bus.name, baud)
        self.baud = baud

    def _open(self, port: str, baud: int) -> ServoBus:
        link = self._opener(port, baud, self.clock)
        quick = getattr(link, "set_low_latency", None)
        if quick is not None:
            quick()
        return ServoBus(link, self.clock, self._config)


def split_ports(words: Sequence[str]) -> tuple[str, ...]:
    """Device files from words that may hold several, separated by commas.

    Raises:
        ConfigurationError: there is none, or one is given twice.
    """
    ports = tuple(part.strip() for word in words for part in word.split(",") if part.strip())
    if not ports:
        raise ConfigurationError(
            "--port is missing: the device file of the servos' adapter, say /dev/ttyUSB0"
        )
    for port in ports:
        if ports.count(port) > 1:
            raise ConfigurationError(f"--port {port} is given twice")
    return ports


def torque_off(ports: ServoPorts, ids: Sequence[int]) -> tuple[int, ...]:
    """Switch every servo on every port off, three times, and look at register 24. Never raises.

    Args:
        ports: where.
        ids: servos that are looked at.

    Returns:
        Those that still have torque, or whose state could not be read.
    """
    broadcast_off(ports.buses)
    return tuple(servo for servo in ids if not _is_limp(ports, servo))


@contextlib.contextmanager
def limp_afterwards(ports: ServoPorts, ids: Sequence[int]) -> Iterator[None]:
    """Whatever happens inside, Ctrl-C and a hang-up included: the torque of all servos is off afterwards.

    A port that was lost is opened once more to that end. Where a servo cannot be
    verified, a log message says that its power must be cut.
    """
    with _termination_as_exit():
        try:
            yield
        finally:
            with _undisturbed():
                left = torque_off(ports, ids)
                if left and _reopened(ports):
                    left = torque_off(ports, left)
                if left:
                    log.error(
                        "torque off could not be verified for servo %s: cut the servos' power",
                        ", ".join(map(str, left)),
                    )


def _is_limp(ports: ServoPorts, servo: int) -> bool:
    for bus in ports.buses:
        with contextlib.suppress(ServoError, LinkError):
            return bus.read(servo, "torque_enable") == 0
    return False


def _reopened(ports: ServoPorts) -> bool:
    try:
        for bus in ports.buses:
            bus.wire.reopen()
    except LinkError:
        return False
    return True


@contextlib.contextmanager
def _undisturbed() -> Iterator[None]:
    """Hold back Ctrl-C and termination: switching off takes a few milliseconds."""
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextlib.contextmanager
def _termination_as_exit() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into SystemExit, so that clean-up runs; only the main thread can."""

    def leave(number: int, stack: FrameType | None) -> None:
        raise SystemExit(128 + number)

    previous = {}
    with contextlib.suppress(ValueError):
        for number in (signal.SIGTERM, signal.SIGHUP):
            previous[number] = signal.signal(number, leave)
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
