"""The thread between one end of the link and its port."""

from __future__ import annotations

import contextlib
import logging
import select
import threading
from typing import Protocol

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.station.transport import Transport

_LOG = logging.getLogger(__name__)
_LONGEST_WAIT = 0.02
"""s; what is offered to the end of the link is seen after this time at the latest."""
_READS = 32
"""Reads in a row: however much babble arrives, what is to be sent gets its turn."""


class End(Protocol):
    """One end of the link, without port or thread."""

    def receive(self, data: bytes, now: float) -> int:
        """Take bytes; gives the number of messages that came from the true other end."""
        ...

    def produce(self, now: float) -> bytes | None:
        """The next frame to send now, or None."""
        ...

    def wait(self, now: float) -> float:
        """Time (s) until there may be one."""
        ...


class Pump:
    """Moves bytes between a port and an end of the link, in a thread of its own.

    Args:
        name: of the thread.
        transport: the port; closed with the pump.
        end: what makes and takes frames; called from this thread only.
        clock: whose times the end gets.
    """

    def __init__(self, name: str, transport: Transport, end: End, clock: Clock) -> None:
        self._transport, self._end, self._clock = transport, end, clock
        self._rest = b""
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._serve, name=name, daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and give the port back. Idempotent."""
        self._ending.set()
        self._thread.join(timeout=2.0)
        self._transport.close()

    def _serve(self) -> None:
        while not self._ending.is_set():
            try:
                self._wait()
                self._receive()
                self._send()
            except Exception:
                # The boundary that keeps the robot safe: a link that broke is a silent one, and ages.
                _LOG.exception("%s failed; it goes on", self._transport.name)
                self._ending.wait(0.1)

    def _wait(self) -> None:
        pause = _LONGEST_WAIT if self._rest else min(_LONGEST_WAIT, self._end.wait(self._clock.now()))
        descriptor = self._transport.fileno()
        if descriptor < 0:
            self._ending.wait(_LONGEST_WAIT)
            return
        # A port that vanishes between the two lines shows with the next read.
        with contextlib.suppress(OSError, ValueError):
            select.select([descriptor], [], [], pause)

    def _receive(self) -> None:
        for _ in range(_READS):
            data = self._transport.read()
            if not data:
                return
            if self._end.receive(data, self._clock.now()):
                self._transport.confirm()

    def _send(self) -> None:
        while not self._ending.is_set():
            self._rest = self._rest or self._end.produce(self._clock.now()) or b""
            if not self._rest:
                return
            taken = self._transport.write(self._rest)
            self._rest = self._rest[taken:]
            if self._rest:
                return
