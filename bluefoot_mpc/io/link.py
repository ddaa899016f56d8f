"""Bytes to and from a device, over a serial port, a pseudo-terminal, or in memory."""

from __future__ import annotations

from typing import Protocol

from bluefoot_mpc.exceptions import DeviceError


class LinkError(DeviceError):
    """A port cannot be opened; the message names the port, the cause and the way out."""


class LinkLostError(LinkError):
    """A port that was open is gone (unplugged, hung up); `Link.reopen` may bring it back."""


class Link(Protocol):
    """A serial line. Only one thread may use it.

    Attributes:
        name: of the port, for messages.
        baud: bit/s, eight data bits, no parity, one stop bit.
    """

    name: str
    baud: int

    def write(self, data: bytes) -> None:
        """Put bytes on the line; returns before they have left it.

        Raises:
            LinkLostError: the line is gone.
        """
        ...

    def read(self, count: int, deadline: float) -> bytes:
        """At least one byte and at most `count`, as soon as any are there; ``b""`` at the deadline.

        Args:
            count: most bytes wanted.
            deadline: s, on the clock that the link was made with; one that is past still gives what waits.

        Raises:
            LinkLostError: the line is gone.
        """
        ...

    def discard(self) -> None:
        """Forget what has arrived and was not read."""
        ...

    def reopen(self) -> None:
        """Close and open anew.

        Raises:
            LinkError: it does not come back.
        """
        ...

    def close(self) -> None:
        """Give the port back. Idempotent, never raises."""
        ...
