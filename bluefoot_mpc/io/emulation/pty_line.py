"""An emulated device on a pseudo-terminal, in real time, for any program that opens a serial port.

Linux only. The client's baud rate is read back from the terminal, so that a
device can tell a wrong one; bits, parity and break do not exist on a
pseudo-terminal. Bytes cost the time that they would cost on the wire.
"""

from __future__ import annotations

import contextlib
import fcntl
import math
import os
import select
import struct
import termios
import threading
import tty
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Self

from bluefoot_mpc.exceptions import BlueFootError, ConfigurationError
from bluefoot_mpc.io.clock import Clock, MonotonicClock
from bluefoot_mpc.io.emulation.device import Device
from bluefoot_mpc.io.emulation.memory_link import BITS_PER_BYTE
from bluefoot_mpc.io.link import LinkError
from bluefoot_mpc.settings import require_positive

_TCGETS2 = 0x802C542A
_TERMIOS2 = struct.Struct("=4IB19s2I")
"""Linux' termios2: four flags, line, control characters, speeds in and out (bit/s)."""
_CHUNK = 4096
_LONGEST_WAIT = 1.0
"""s until the thread looks around without a reason."""


class PtyLine:
    """Serves a device on a pseudo-terminal from a thread of its own, until `close`.

    Args:
        device: the far end; see `MemoryLink` for what it may have besides. Only the thread touches it.
        baud: bit/s that the terminal starts with.
        link: a symbolic link that always points to the port, also after a hang-up.
        lock: held whenever the device is touched; lines that share shafts share their lock.
        clock: real time.

    Attributes:
        baud: bit/s of the client.
        lost: bytes that the client did not fetch in time.
        error: what ended the service before `close`, if anything did.

    Raises:
        ConfigurationError: the link cannot be made.
        LinkError: the system has no pseudo-terminal left.
    """

    def __init__(
        self,
        device: Device,
        baud: int = 1_000_000,
        link: Path | None = None,
        lock: threading.RLock | None = None,
        clock: Clock | None = None,
    ) -> None:
        require_positive(baud=baud)
        self.baud = baud
        self.lost = 0
        self.error: BlueFootError | None = None
        self._device = device
        self._link = link
        self._lock = lock if lock is not None else threading.RLock()
        self._clock = clock or MonotonicClock()
        self._hung_up: Callable[[float], bool] | None = getattr(device, "hung_up", None)
        self._free_at = -math.inf
        self._master = self._slave = -1
        self._port = ""
        self._wake_out, self._wake_in = os.pipe()
        self._is_closing = False
        try:
            self._open()
        except BlueFootError:
            self._shut()
            os.close(self._wake_out)
            os.close(self._wake_in)
            raise
        self._thread = threading.Thread(target=self._serve, name=f"pty {self._port}", daemon=True)
        self._thread.start()

    @property
    def port(self) -> str:
        """Path that a client opens: the link where there is one."""
        return str(self._link) if self._link is not None else self._port

    @property
    def terminal(self) -> str:
        """Path of the pseudo-terminal itself; a new one after a hang-up."""
        return self._port

    @property
    def is_serving(self) -> bool:
        """False once closed, or ended by an error."""
        return self._thread.is_alive()

    def close(self) -> None:
        """Hang up, end the thread, remove the link. Idempotent."""
        if not self._is_closing:
            self._is_closing = True
            os.write(self._wake_in, b"x")
            self._thread.join()
            os.close(self._wake_out)
            os.close(self._wake_in)

    def __enter__(self) -> Self:
        """The line itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()

    # The thread.

    def _serve(self) -> None:
        try:
            while not self._is_closing:
                if self._master < 0:
                    self._wait_for_return()
                else:
                    self._exchange()
        except BlueFootError as error:
            # The physics behind the device gave up: the client sees a port that is gone.
            self.error = error
        finally:
            self._shut()

    def _exchange(self) -> None:
        """Wait until the client or the device has something, and hand it on."""
        now = self._clock.now()
        with self._lock:
            due = self._device.due()
        wait = min(max(0.0, due - now), _LONGEST_WAIT)
        ready, _, _ = select.select([self._master, self._wake_out], [], [], wait)
        now = self._clock.now()
        if self._is_closing:
            return
        with self._lock:
            if self._hung_up is not None and self._hung_up(now):
                self._shut()
                return
            if self._master in ready:
                self._take(now)
            reply = self._device.transmit(now)
        if reply:
            self._give(reply)

    def _take(self, now: float) -> None:
        """Bytes from the client to the device, with the time that they take on the wire."""
        data = os.read(self._master, _CHUNK)
        self.baud = self._terminal_baud() or self.baud
        if hasattr(self._device, "host_baud"):
            self._device.host_baud = self.baud
        self._free_at = max(now, self._free_at) + len(data) * BITS_PER_BYTE / self.baud
        self._device.receive(data, self._free_at)

    def _give(self, data: bytes) -> None:
        """Bytes from the device to the client; what does not fit into the terminal is lost."""
        try:
            written = os.write(self._master, data)
        except BlockingIOError:
            written = 0
        self.lost += len(data) - written

    def _wait_for_return(self) -> None:
        """The adapter is gone: wait until it is back, and open a new terminal."""
        now = self._clock.now()
        with self._lock:
            if self._hung_up is None or not self._hung_up(now):
                self._device.transmit(now)
                self._open()
                return
            due = self._device.due()
        select.select([self._wake_out], [], [], min(max(0.001, due - now), _LONGEST_WAIT))
        with self._lock:
            self._device.transmit(self._clock.now())

    # The terminal.

    def _open(self) -> None:
        try:
            self._master, self._slave = os.openpty()
        except OSError as error:
            raise LinkError(f"no pseudo-terminal to be had: {error.strerror or error}") from error
        # Raw, so that nothing is echoed. The slave stays open here, so that clients may come and go.
        tty.setraw(self._slave)
        attributes = termios.tcgetattr(self._slave)
        speed = getattr(termios, f"B{self.baud}", None)
        if speed is not None:
            attributes[4] = attributes[5] = speed
            termios.tcsetattr(self._slave, termios.TCSANOW, attributes)
        os.set_blocking(self._master, False)
        self._port = os.ttyname(self._slave)
        self._point_link()

    def _shut(self) -> None:
        for descriptor in (self._master, self._slave):
            if descriptor >= 0:
                os.close(descriptor)
        self._master = self._slave = -1
        if self._link is not None and self._link.is_symlink():
            with contextlib.suppress(OSError):
                if os.readlink(self._link) == self._port:
                    self._link.unlink()

    def _point_link(self) -> None:
        link = self._link
        if link is None:
            return
        if link.exists() and not link.is_symlink():
            raise ConfigurationError(f"{link} exists and is not a link; choose another name for the link")
        fresh = link.with_name(f".{link.name}.{os.getpid()}")
        try:
            fresh.unlink(missing_ok=True)
            fresh.symlink_to(self._port)
            fresh.replace(link)
        except OSError as error:
            reason = error.strerror or error
            raise ConfigurationError(f"the link {link} to the port cannot be made: {reason}") from error

    def _terminal_baud(self) -> int:
        """Bit/s that the client has set; 0 where the system does not tell."""
        try:
            raw = fcntl.ioctl(self._slave, _TCGETS2, bytes(_TERMIOS2.size))
        except OSError:
            return 0
        return int(_TERMIOS2.unpack(raw)[-1])
