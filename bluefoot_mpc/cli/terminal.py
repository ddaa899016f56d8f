"""The terminal as a keyboard: keys one by one, and the terminal as it was afterwards, whatever happens."""

from __future__ import annotations

import contextlib
import os
import select
import signal
import sys
import termios
import tty
from collections.abc import Iterator
from types import FrameType

from bluefoot_mpc.exceptions import ConfigurationError

_ARROWS = {b"A": "up", b"B": "down", b"C": "right", b"D": "left"}
_ESCAPE = b"\x1b"


def decode_keys(data: bytes) -> tuple[list[str], bytes]:
    """Names of the keys in what a terminal sent, and the start of a sequence that is still incomplete.

    Letters come in lower case, arrows as ``"up"`` and so on, space as ``"space"``;
    other sequences (function keys, mouse) are left out.
    """
    keys: list[str] = []
    while data:
        if data.startswith(_ESCAPE):
            used, key = _escape_sequence(data)
            if used == 0:
                return keys, data
        else:
            used, key = 1, _plain_key(data[0])
        if key:
            keys.append(key)
        data = data[used:]
    return keys, b""


def _escape_sequence(data: bytes) -> tuple[int, str]:
    """(bytes used, key) of a sequence that starts with escape; 0 bytes while it is incomplete."""
    if len(data) == 1:
        return 0, ""
    if data[1:2] not in (b"[", b"O"):
        return 1, ""  # escape alone, or Alt: the letter after it counts
    for end in range(2, len(data)):
        if 0x40 <= data[end] <= 0x7E:
            return end + 1, _ARROWS.get(data[end : end + 1], "")
    return 0, ""


def _plain_key(code: int) -> str:
    if code == 0x20:
        return "space"
    return chr(code).lower() if 0x21 <= code <= 0x7E else ""


class Keyboard:
    """Keys pressed since the last look, without waiting.

    Args:
        descriptor: file descriptor of a terminal in `raw_terminal`.
    """

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._rest = b""
        self.closed = False

    def read(self) -> list[str]:
        """Names of the keys, oldest first; `closed` becomes True when the terminal is gone."""
        arrived = b""
        while not self.closed and select.select([self._descriptor], [], [], 0.0)[0]:
            try:
                chunk = os.read(self._descriptor, 1024)
            except OSError:  # the terminal was closed
                chunk = b""
            self.closed = not chunk
            arrived += chunk
        keys, self._rest = decode_keys(self._rest + arrived)
        if not arrived and self._rest == _ESCAPE:
            self._rest = b""  # nothing followed: it was the escape key
        return keys


@contextlib.contextmanager
def raw_terminal() -> Iterator[int]:
    """Give standard input as a terminal that hands over each key at once, and restore it on any way out.

    Raises:
        ConfigurationError: standard input is no terminal.
    """
    try:
        descriptor = sys.stdin.fileno()
    except (OSError, ValueError, AttributeError):
        descriptor = -1
    if descriptor < 0 or not os.isatty(descriptor):
        raise ConfigurationError(
            "driving needs a keyboard: standard input is no terminal. "
            "Start it in a terminal, or walk without one: bluefoot run walk"
        )
    before = termios.tcgetattr(descriptor)
    with _termination_as_exit():
        try:
            tty.setcbreak(descriptor, termios.TCSANOW)
            _without_suspend(descriptor)
            yield descriptor
        finally:
            with contextlib.suppress(termios.error):  # a terminal that is gone needs no restoring
                termios.tcsetattr(descriptor, termios.TCSAFLUSH, before)


def _without_suspend(descriptor: int) -> None:
    """Ctrl-Z must not freeze a walking robot (and leave the shell with this terminal)."""
    state = termios.tcgetattr(descriptor)
    state[6][termios.VSUSP] = b"\x00"
    termios.tcsetattr(descriptor, termios.TCSANOW, state)


@contextlib.contextmanager
def _termination_as_exit() -> Iterator[None]:
    """Turn SIGTERM and SIGHUP into SystemExit, so that clean-up runs."""

    def leave(number: int, stack: FrameType | None) -> None:
        raise SystemExit(128 + number)

    previous = {number: signal.signal(number, leave) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        yield
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)
