"""Starts the watchdog process, keeps it content, and notices when it is gone."""

from __future__ import annotations

import contextlib
import logging
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.safety import watchdog
from bluefoot_mpc.io.safety.watchdog import GuardedPort
from bluefoot_mpc.settings import require_positive

log = logging.getLogger(__name__)

TORQUE_OFF = bytes((0xFF, 0xFF, 0xFE, 0x04, 0x03, 0x18, 0x00, 0xE2))
"""Broadcast, WRITE, address 24 (torque enable), 0; checksum ~(FE + 04 + 03 + 18 + 00) (AX-12A e-manual)."""
_FIRED = "this program was silent for too long: the watchdog has switched torque off"
START_TIMEOUT = 10.0
"""s until the process must have reported; a busy machine takes a second."""


class WatchdogProcess:
    """A process that writes torque off when this one dies or hangs. Start it before torque is on.

    Args:
        ports: ports with the bytes that switch their devices off; a descriptor given with a port
            is handed over, so that it can be written although this process holds it exclusively.
        timeout: s without `beat` that count as hung, from the first beat on.

    Raises:
        DeviceError: it did not start.
        ConfigurationError: the timeout is not positive.
    """

    def __init__(self, ports: Sequence[GuardedPort], timeout: float = 0.5) -> None:
        require_positive(timeout=timeout)
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._channel = ours
        self._lock = threading.Lock()
        self._lost = ""
        self._closed = False
        # A process that is starved for a while must find room for what it has not read yet.
        self._pause, self._due = 0.1 * timeout, 0.0
        command = [sys.executable, "-I", str(Path(watchdog.__file__)), "--channel", str(theirs.fileno())]
        command += ["--timeout", repr(timeout)]
        for port in ports:
            command += ["--port", f"{port.path},{port.baud},{port.descriptor},{port.payload.hex()}"]
        handed = [theirs.fileno(), *(port.descriptor for port in ports if port.descriptor >= 0)]
        try:
            # A session of its own: Ctrl-C and a closed terminal reach this process, not that one.
            self._process = subprocess.Popen(
                command, pass_fds=handed, start_new_session=True, stdin=subprocess.DEVNULL, cwd="/"
            )
        except OSError as error:
            ours.close()
            raise DeviceError(f"the watchdog process does not start: {error}") from error
        finally:
            theirs.close()
        self._await()

    @property
    def lost(self) -> str:
        """Why it does not watch any more; empty while it does."""
        return self._lost

    @property
    def pid(self) -> int:
        """Its process number."""
        return self._process.pid

    def beat(self) -> bool:
        """Tell it that all is well; never blocks.

        Call it once per bus cycle, before anything is written that could move a servo.

        Returns:
            False when it has switched torque off: nothing may be written any more. Where it is
            only gone, `lost` says so, and the robot should sit down.
        """
        with self._lock:
            if not self._lost and not self._closed:
                now = time.monotonic()
                beats = now >= self._due
                self._due = now + self._pause if beats else self._due
                self._lost = self._exchange(watchdog.HEARTBEAT if beats else b"", ())
            return self._lost != _FIRED

    def replace(self, index: int, descriptor: int | None) -> None:
        """Hand over the descriptor of a port that was opened anew, None of one that is lost.

        An adapter that is plugged in again gets its old name only when nobody holds the
        old one's descriptor any more.

        Args:
            index: of the port, as in the ports at the start.
            descriptor: open here.
        """
        handed = () if descriptor is None else (descriptor,)
        with self._lock:
            if not self._lost and not self._closed:
                self._lost = self._exchange(watchdog.PORT + bytes((index,)), handed)

    def close(self, *, is_off: bool = True) -> None:
        """Dismiss it. Idempotent, never raises.

        Args:
            is_off: torque is known to be off; where it is not, the process tries it before it ends.
        """
        with self._lock:
            if self._closed:
                return
            self._closed = True
            if is_off:
                with contextlib.suppress(OSError):
                    self._channel.send(watchdog.FAREWELL)
            self._channel.close()
        try:
            self._process.wait(timeout=2.0 * watchdog.RETRY)
        except subprocess.TimeoutExpired:
            log.warning("the watchdog process %d does not end", self._process.pid)

    def _await(self) -> None:
        self._channel.settimeout(START_TIMEOUT)
        try:
            answer = self._channel.recv(16)
        except OSError:
            answer = b""
        if answer != watchdog.READY:
            self._channel.close()
            self._closed = True
            self._process.kill()
            self._process.wait()
            raise DeviceError("the watchdog process did not report. Look for its message above")
        self._channel.setblocking(False)

    def _exchange(self, message: bytes, descriptors: Sequence[int]) -> str:
        """Send a message, if any, and hear what came back; gives why it does not watch any more."""
        try:
            if message:
                socket.send_fds(self._channel, [message], list(descriptors))
        except BlockingIOError:
            return "the watchdog process does not take heartbeats any more"
        except OSError:
            return "the watchdog process is gone"
        try:
            answer = self._channel.recv(16)
        except BlockingIOError:
            return ""
        except OSError:
            answer = b""
        if answer.startswith(watchdog.FIRED):
            return _FIRED
        return "" if answer else "the watchdog process is gone"
