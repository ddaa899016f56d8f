"""A link to an emulated device in the same thread: bytes cost time on a virtual clock, and nothing else.

A write occupies the line (ten bits a byte) without letting time pass, as a
serial port's driver takes bytes and returns. A read lets time pass until the
device's bytes have arrived, or until the deadline. Several links may share a
clock: waiting on one lets time pass for all.
"""

from __future__ import annotations

from collections.abc import Callable

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.device import Device
from bluefoot_mpc.io.link import LinkError, LinkLostError
from bluefoot_mpc.settings import require_positive

BITS_PER_BYTE = 10
"""Start bit, eight data bits, stop bit."""


def _never(_: float) -> bool:
    """A device that is never hung up."""
    return False


class MemoryLink:
    """A serial line in memory.

    A device may have two things more than `Device` asks for: `hung_up(time)`,
    True while its USB adapter is gone, and `host_baud`, which is told the baud
    rate that the host talks with.

    Args:
        device: the far end.
        clock: shared with whoever uses the link.
        baud: bit/s of the host's side.
        name: of the port, for messages.
    """

    def __init__(
        self, device: Device, clock: VirtualClock, baud: int = 1_000_000, name: str = "emulated line"
    ) -> None:
        require_positive(baud=baud)
        self.name = name
        self.baud = baud
        self._device = device
        self._clock = clock
        self._byte_time = BITS_PER_BYTE / baud
        self._free_at = clock.now()
        self._buffer = b""
        self._is_open = True
        self._hung_up: Callable[[float], bool] = getattr(device, "hung_up", _never)
        if hasattr(device, "host_baud"):
            device.host_baud = baud

    def write(self, data: bytes) -> None:
        """Put bytes on the line, after those that are still leaving.

        Raises:
            LinkLostError: the device's adapter is gone, or the link is closed.
        """
        now = self._clock.now()
        self._check(now)
        self._free_at = max(now, self._free_at) + len(data) * self._byte_time
        self._device.receive(data, self._free_at)

    def read(self, count: int, deadline: float) -> bytes:
        """At least one byte and at most `count`; ``b""`` at the deadline.

        Args:
            count: most bytes wanted.
            deadline: s on the link's clock.

        Raises:
            LinkLostError: the device's adapter is gone, or the link is closed.
        """
        clock, device = self._clock, self._device
        self._check(clock.now())
        while not self._buffer:
            due = device.due()
            if due > deadline:
                clock.sleep_until(deadline)
                self._check(clock.now())
                self._buffer = device.transmit(clock.now())
                break
            clock.sleep_until(due)
            self._check(clock.now())
            self._buffer = device.transmit(clock.now())
        taken, self._buffer = self._buffer[:count], self._buffer[count:]
        return taken

    def discard(self) -> None:
        """Forget what has arrived and was not read."""
        self._buffer = b""
        if self._is_open:
            self._device.transmit(self._clock.now())

    def reopen(self) -> None:
        """Close and open anew.

        Raises:
            LinkError: the device's adapter is still gone.
        """
        self.close()
        if self._hung_up(self._clock.now()):
            raise LinkError(f"{self.name} cannot be opened: it is not there. Plug the adapter in again")
        self._is_open = True
        self.discard()

    def close(self) -> None:
        """Give the port back. Idempotent, never raises."""
        self._is_open = False
        self._buffer = b""

    def _check(self, now: float) -> None:
        if not self._is_open:
            raise LinkLostError(f"{self.name} is closed; reopen it")
        if self._hung_up(now):
            self.close()
            raise LinkLostError(f"{self.name} is gone: its adapter was unplugged. Plug it in and reopen")
