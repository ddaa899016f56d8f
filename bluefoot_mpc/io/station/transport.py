"""Ways to the other end: UDP and serial ports, none of which ever waits.

Addresses: ``udp:HOST:PORT`` sends to HOST, ``udpin:HOST:PORT`` waits there for
the other end to speak first, ``serial:PATH:BAUD`` is a radio on a serial port.
``,key=FILE`` behind any of them names the key that frames are signed with.
"""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.link import LinkError

FORMS = "udp:HOST:PORT, udpin:HOST:PORT, serial:PATH:BAUD; each with ,key=FILE behind it where it is signed"
_WAITING_LIMIT = 160
"""bytes that may wait in a serial port: what is older than that many is better not sent at all."""
_PEER_TIMEOUT = 5.0
"""s of silence after which `udpin` takes to another peer."""
_FULL = (errno.EAGAIN, errno.EWOULDBLOCK, errno.ENOBUFS)


@dataclass(frozen=True, kw_only=True, slots=True)
class Address:
    """Where the other end is.

    Attributes:
        kind: ``"udp"``, ``"udpin"`` or ``"serial"``.
        place: host, or path of the port.
        number: UDP port, or baud rate.
        key: file of the key; None where frames are not signed.
    """

    kind: str
    place: str
    number: int
    key: Path | None = None

    @classmethod
    def parse(cls, text: str) -> Address:
        """The address that a text stands for.

        Raises:
            ConfigurationError: the text has another form.
        """
        head, *options = text.split(",")
        kind, _, rest = head.partition(":")
        place, _, number = rest.rpartition(":")
        wrong = [option for option in options if not option.startswith("key=") or option == "key="]
        most = 10_000_000 if kind == "serial" else 65535
        if kind not in ("udp", "udpin", "serial") or not place or wrong or not number.isdecimal():
            raise ConfigurationError(f"'{text}' is no address of a link. Valid: {FORMS}")
        if not 1 <= int(number) <= most:
            raise ConfigurationError(f"'{text}': {number} must lie in 1..{most}")
        key = Path(options[-1].removeprefix("key=")) if options else None
        return cls(kind=kind, place=place, number=int(number), key=key)


class Transport(Protocol):
    """One way to the other end; neither call ever waits.

    Attributes:
        name: for messages.
    """

    name: str

    def fileno(self) -> int:
        """Descriptor to wait on; -1 while there is none."""
        ...

    def read(self) -> bytes:
        """What has arrived; may be empty."""
        ...

    def confirm(self) -> None:
        """What was read last was a true frame: whoever sent it is the other end."""
        ...

    def write(self, data: bytes) -> int:
        """Number of bytes that were taken; fewer than all where the line is full."""
        ...

    def close(self) -> None:
        """Give the port back. Idempotent."""
        ...


def open_transport(address: Address) -> Transport:
    """Open an address.

    Raises:
        LinkError: it cannot be opened.
    """
    return SerialTransport(address) if address.kind == "serial" else UdpTransport(address)


class UdpTransport:
    """Datagrams to and from one peer."""

    def __init__(self, address: Address) -> None:
        self.name = f"{address.kind}:{address.place}:{address.number}"
        waits = address.kind == "udpin"
        try:
            found = socket.getaddrinfo(address.place, address.number, type=socket.SOCK_DGRAM)
            family, kind, protocol, _, target = found[0]
            self._socket = socket.socket(family, kind, protocol)
        except OSError as error:
            raise LinkError(
                f"{self.name}: the host is not known ({error.strerror}); an IP address always is"
            ) from error
        self._socket.setblocking(False)
        self._fixed = not waits
        self._peer = None if waits else target[:2]
        self._heard = 0.0
        self._sender: tuple[str, int] | None = None
        if waits:
            self._bind(target)

    def _bind(self, target: tuple[str, int] | tuple[str, int, int, int] | tuple[int, bytes]) -> None:
        try:
            self._socket.bind(target)
        except OSError as error:
            self._socket.close()
            way_out = "is another station running? End it, or take another port"
            raise LinkError(f"{self.name} cannot be opened: {error.strerror}; {way_out}") from error

    def fileno(self) -> int:
        """Descriptor of the socket."""
        return self._socket.fileno()

    def read(self) -> bytes:
        """One datagram of the peer, or of anybody while there is no peer."""
        while True:
            try:
                data, sender = self._socket.recvfrom(2048)
            except OSError:  # nothing there, or the peer's port is closed
                return b""
            self._sender = sender[:2]
            now = time.monotonic()
            if not self._fixed and self._peer is not None and now - self._heard > _PEER_TIMEOUT:
                self._peer = None
            if self._peer in (None, self._sender):
                return data

    def confirm(self) -> None:
        """The sender of the last datagram is the peer."""
        self._heard = time.monotonic()
        if not self._fixed:
            self._peer = self._sender

    def write(self, data: bytes) -> int:
        """Send a datagram; what the network has no room for is gone."""
        if self._peer is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(data, self._peer)
        return len(data)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class SerialTransport:
    """A radio on a serial port; comes back by itself after it was unplugged."""

    _RETRY = 1.0  # s

    def __init__(self, address: Address) -> None:
        self.name = f"serial:{address.place}:{address.number}"
        self._address = address
        self._retry = 0.0
        self._port = self._open()

    def fileno(self) -> int:
        """Descriptor of the port; -1 while it is unplugged."""
        return -1 if self._port is None else int(self._port.fileno())

    def read(self) -> bytes:
        """What has arrived."""
        if not self._there():
            return b""
        try:
            data = os.read(self.fileno(), 4096)
        except BlockingIOError:
            return b""
        except OSError:
            data = b""
        if not data and self._hung_up():
            self._lose()
        return data

    def confirm(self) -> None:
        """There is only one other end."""

    def write(self, data: bytes) -> int:
        """Put bytes on the line, unless too many wait there already."""
        if not self._there():
            return len(data)  # unplugged: what would have been sent is gone
        try:
            if self._port.out_waiting > _WAITING_LIMIT:
                return 0
            return os.write(self.fileno(), data)
        except OSError as error:
            if error.errno not in _FULL:
                self._lose()
                return len(data)
            return 0

    def close(self) -> None:
        """Close the port."""
        self._retry = float("inf")
        self._lose()

    def _open(self) -> Any:
        import serial  # noqa: PLC0415 - only links over a serial port need it

        try:
            # Zero times out at once; the descriptor itself never waits either.
            port = serial.Serial(
                self._address.place, self._address.number, timeout=0, write_timeout=0, exclusive=True
            )
        except (serial.SerialException, ValueError, OSError) as error:
            raise LinkError(
                f"{self.name} cannot be opened: {error}. "
                "Is it plugged in, free, and may you read it (group dialout)?"
            ) from error
        os.set_blocking(port.fileno(), False)
        return port

    def _there(self) -> bool:
        if self._port is None and time.monotonic() >= self._retry:
            self._retry = time.monotonic() + self._RETRY
            with contextlib.suppress(LinkError):
                self._port = self._open()
        return self._port is not None

    def _hung_up(self) -> bool:
        try:
            return bool(self._port.in_waiting < 0)
        except OSError:
            return True

    def _lose(self) -> None:
        if self._port is not None:
            with contextlib.suppress(OSError):
                self._port.close()
        self._port = None
