"""What every emulated device offers to the line it hangs on, in memory or on a pseudo-terminal."""

from __future__ import annotations

from typing import Protocol


class Device(Protocol):
    """The far end of a serial line. Times are those of the line's clock and never go back."""

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes of which the last arrived at `time` (s)."""
        ...

    def due(self) -> float:
        """Time (s) at which the host has the device's next byte; infinity where none is on its way."""
        ...

    def transmit(self, time: float) -> bytes:
        """Every byte that has arrived at the host by `time` (s) and was not handed out before."""
        ...
