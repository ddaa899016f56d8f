"""A serial port as a `Link`: opened for oneself, read with deadlines, told apart when it is lost.

No thread and no spinning: a read sleeps in `select` until bytes or the deadline
come. Works for USB adapters, UARTs and pseudo-terminals of Linux.
"""

from __future__ import annotations

import array
import contextlib
import errno
import fcntl
import glob
import grp
import os
import select
import stat
import termios
from pathlib import Path

import serial
from serial.tools import list_ports

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.link import LinkError, LinkLostError

WRITE_PATIENCE = 0.2
"""Seconds after which a port that takes no bytes counts as lost.

It has kilobytes of room, so it has been hanging for longer already. Whoever waits must be back before
guard and watchdog process give the program up, which they do after 0.5 s.
"""

MOST_AT_ONCE = 4096
"""Bytes asked of the system when old ones are thrown away."""

SYSFS = Path("/sys/class/tty")

_GONE = frozenset({errno.EIO, errno.ENXIO, errno.ENODEV, errno.EBADF, errno.EPIPE})
_BUSY = frozenset({errno.EBUSY, errno.EAGAIN, errno.EACCES})
_TCGETS2 = 0x802C542A
_ASYNC_LOW_LATENCY = 0x2000
_FLAGS, _OUTPUT_SPEED = 4, 10
"""Places (32-bit words) of the flags in Linux' serial_struct and of the output speed in its termios2."""

_BAUD_TOLERANCE = 0.03


class SerialLink:
    """A serial port, eight data bits, no parity, one stop bit; nobody else may open it meanwhile.

    Args:
        port: device file, e.g. ``/dev/ttyUSB0``; a link under ``/dev/serial/by-id`` keeps its name when an
            adapter comes back under another number.
        baud: bit/s.
        clock: the machine's clock, on which deadlines are given.

    Raises:
        LinkError: it cannot be opened.

    Attributes:
        name: the port as given.
        baud: bit/s.
        is_paced: True where bytes take their time; a pseudo-terminal may be faster than its baud rate.
        openings: how often it has been opened.
    """

    def __init__(self, port: str, baud: int, clock: Clock) -> None:
        self.name = port
        self.baud = baud
        self.is_paced = not _is_pseudo(port)
        self._clock = clock
        self._wants_low_latency = False
        self.openings = 0
        self._serial: serial.Serial | None = None
        self._fd = -1
        self._open()

    @property
    def is_open(self) -> bool:
        """False while the port is lost, or given back."""
        return self._fd >= 0

    def fileno(self) -> int:
        """The descriptor to wait on, for several ports at once.

        Raises:
            LinkLostError: the port is closed.
        """
        if self._fd < 0:
            raise LinkLostError(f"{self.name} is closed")
        return self._fd

    def write(self, data: bytes) -> None:
        """Hand bytes to the system; returns before they have left.

        Raises:
            LinkLostError: the port is gone, or takes nothing for `WRITE_PATIENCE`.
        """
        try:
            sent = os.write(self.fileno(), data)
        except BlockingIOError:
            sent = 0
        except OSError as error:
            raise self._lost(error) from error
        if sent < len(data):
            self._write_rest(data[sent:])

    def _write_rest(self, data: bytes) -> None:
        give_up = self._clock.now() + WRITE_PATIENCE
        while data:
            if self._clock.now() >= give_up:
                raise LinkLostError(
                    f"{self.name} takes no more bytes: its adapter hangs. Unplug and plug it in"
                )
            try:
                select.select([], [self.fileno()], [], WRITE_PATIENCE / 10.0)
                data = data[os.write(self.fileno(), data) :]
            except BlockingIOError:
                continue
            except (OSError, ValueError) as error:
                raise self._lost(error) from error

    def read(self, count: int, deadline: float) -> bytes:
        """At least one byte and at most `count`, as soon as any are there; ``b""`` at the deadline.

        Args:
            count: most bytes wanted.
            deadline: s, on the link's clock; one that is past still gives what waits.

        Raises:
            LinkLostError: the port is gone.
        """
        fd = self.fileno()
        try:
            patience = deadline - self._clock.now()
            ready, _, _ = select.select((fd,), (), (), patience if patience > 0.0 else 0.0)
            if not ready:
                return b""
            data = os.read(fd, count)
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as error:
            raise self._lost(error) from error
        if not data:  # readable, and nothing to read: hung up
            raise self._lost(None)
        return data

    def discard(self) -> None:
        """Forget what has arrived and was not read."""
        try:
            termios.tcflush(self.fileno(), termios.TCIFLUSH)
        except termios.error as error:
            raise self._lost(error) from error

    def reopen(self) -> None:
        """Close and open anew, with the same latency setting.

        Raises:
            LinkError: it does not come back.
        """
        self.close()
        self._open()

    def close(self) -> None:
        """Give the port back. Idempotent, never raises."""
        port, self._serial, self._fd = self._serial, None, -1
        if port is None:
            return
        # A port that is gone may refuse whatever is asked of it.
        with contextlib.suppress(OSError, termios.error, serial.SerialException):
            fcntl.ioctl(port.fd, termios.TIOCNXCL)
        # A watchdog process shares the descriptor, and with it the lock that `exclusive` takes.
        with contextlib.suppress(OSError, serial.SerialException):
            fcntl.flock(port.fd, fcntl.LOCK_UN)
        with contextlib.suppress(OSError, termios.error, serial.SerialException):
            port.close()

    def set_low_latency(self) -> bool:
        """Ask the adapter to deliver bytes at once, and look whether it took it.

        Sets the driver's low-latency flag, and the latency timer where that
        may be written; both are set again by `reopen`.

        Returns:
            True where the flag is set or the timer is at most 1 ms. False is no fault for a port without a
            timer (UART, pseudo-terminal, microcontroller bridge): see `latency_timer_ms`.
        """
        self._wants_low_latency = True
        flag = array.array("i", [0] * 32)
        taken = False
        # Pseudo-terminals and many bridges know no such flag.
        with contextlib.suppress(OSError):
            fcntl.ioctl(self.fileno(), termios.TIOCGSERIAL, flag)
            flag[_FLAGS] |= _ASYNC_LOW_LATENCY
            fcntl.ioctl(self.fileno(), termios.TIOCSSERIAL, flag)
            fcntl.ioctl(self.fileno(), termios.TIOCGSERIAL, flag)
            taken = bool(flag[_FLAGS] & _ASYNC_LOW_LATENCY)
        timer = self.latency_timer_ms()
        if timer is not None and timer > 1.0:
            # Only the owner of the file may; where not, the value that is read afterwards says so.
            with contextlib.suppress(OSError):
                self._timer_file().write_text("1", encoding="ascii")
            timer = self.latency_timer_ms()
        return taken if timer is None else timer <= 1.0

    def latency_timer_ms(self) -> float | None:
        """How long the adapter may hold back a short reply, ms; None for a port without such a timer."""
        try:
            return float(self._timer_file().read_text(encoding="ascii"))
        except (OSError, ValueError):
            return None

    def _timer_file(self) -> Path:
        return SYSFS / Path(os.path.realpath(self.name)).name / "device" / "latency_timer"

    def _lost(self, error: Exception | None) -> LinkError:
        number = getattr(error, "errno", None) or (error.args[0] if error and error.args else None)
        if error is None or number in _GONE or isinstance(error, ValueError):
            self.close()
            return LinkLostError(
                f"{self.name} is gone: unplugged, or its other end hung up. Check the USB cable"
            )
        return LinkLostError(f"{self.name} failed: {error}. Unplug its adapter and plug it in again")

    def _open(self) -> None:
        try:
            # No reading ahead by pyserial: it opens and sets the line up, the bytes go past it.
            self._serial = serial.Serial(self.name, self.baud, timeout=0, exclusive=True)
        except (serial.SerialException, OSError, ValueError, OverflowError, termios.error) as error:
            raise LinkError(self._why_not(error)) from error
        self._fd = int(self._serial.fd)
        self.openings += 1
        if not _is_pseudo(self.name):
            # Keeps out programs that take no lock. A pseudo-terminal would stay shut after a crash.
            with contextlib.suppress(OSError):
                fcntl.ioctl(self._fd, termios.TIOCEXCL)
        self._check_baud()
        if self._wants_low_latency:
            self.set_low_latency()

    def _check_baud(self) -> None:
        """Refuse a port whose driver quietly took another rate."""
        line = array.array("i", [0] * 64)
        try:
            fcntl.ioctl(self._fd, _TCGETS2, line)
        except OSError:
            return  # not Linux' termios2: nothing to compare with
        actual = line[_OUTPUT_SPEED]
        if actual and abs(actual / self.baud - 1.0) > _BAUD_TOLERANCE:
            self.close()
            raise LinkError(self._baud_refused(f"it took {actual} instead"))

    def _baud_refused(self, detail: str) -> str:
        return (
            f"{self.name} refuses {self.baud} bit/s ({detail}). "
            "Choose a rate that the adapter has; the servos' factory rate is 1000000"
        )

    def _why_not(self, error: Exception) -> str:
        """Port, cause and way out of a failed opening."""
        number = getattr(error, "errno", None) or (error.args[0] if error.args else None)
        if not Path(self.name).exists() or number in {errno.ENOENT, errno.ENXIO, errno.ENODEV}:
            there = ", ".join(available_ports()) or "none: check the USB cable and the adapter's power"
            return f"there is no port {self.name}. Ports that exist: {there}"
        if not os.access(self.name, os.R_OK | os.W_OK):
            return (
                f"{self.name} may not be opened by this user. Join group '{self._group()}' "
                f"(sudo usermod -aG {self._group()} $USER), then log in anew"
            )
        if number in _BUSY:
            return f"{self.name} is busy: another program has it open. Close it (see `fuser {self.name}`)"
        if number == errno.ENOTTY or not stat.S_ISCHR(os.stat(self.name).st_mode):
            return (
                f"{self.name} is no serial port. Ports that exist: {', '.join(available_ports()) or 'none'}"
            )
        if isinstance(error, (ValueError, OverflowError)) or number == errno.EINVAL:
            return self._baud_refused(str(error))
        return f"{self.name} cannot be opened: {error}. Unplug its adapter and plug it in again"

    def _group(self) -> str:
        try:
            name = grp.getgrgid(os.stat(self.name).st_gid).gr_name
        except (KeyError, OSError):
            return "dialout"
        # Root's own group opens too much: what the port is given to is set by udev, mostly to dialout.
        return "dialout" if name == "root" else name


def _is_pseudo(port: str) -> bool:
    return os.path.realpath(port).startswith("/dev/pts/")


def available_ports() -> list[str]:
    """Serial ports of this machine, names that stay first."""
    stable = glob.glob("/dev/serial/by-id/*")
    return stable + sorted(port.device for port in list_ports.comports())
