"""MAVLink 2 signing: commands that were forged, or recorded and sent again, are told from true ones.

Layout of the signature (MAVLink guide, "Message Signing"): link ID, 48-bit time
stamp in units of 10 µs since 2015, and the first six bytes of SHA-256 over key
and frame. pymavlink signs what goes out. What comes in is checked here, because
the stamp of a stream may only move on when the signature is right: otherwise a
single forged frame with a stamp from the future would lock the true sender out.
"""

from __future__ import annotations

import hashlib
import hmac
import time
from collections.abc import Callable
from pathlib import Path

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.station.framing import SIGNATURE, Received

KEY_SIZE = 32
_EPOCH = 1420070400.0
"""s, 1 January 2015 UTC."""
_TICK = 1e-5
_NEW_STREAM = int(60.0 / _TICK)
"""A sender not heard before may be at most this far behind (MAVLink guide: one minute)."""


def load_key(path: Path) -> bytes:
    """The (32,) bytes of a key file: 32 raw bytes, or 64 hexadecimal digits.

    Raises:
        ConfigurationError: the file cannot be read, or holds something else.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise ConfigurationError(f"cannot read the key {path}: {error.strerror or error}") from error
    if len(data) == KEY_SIZE:
        return data
    try:
        key = bytes.fromhex(data.decode("ascii").strip())
    except ValueError:
        key = b""
    if len(key) != KEY_SIZE:
        raise ConfigurationError(
            f"{path} is no key: it must hold {KEY_SIZE} bytes or {2 * KEY_SIZE} hexadecimal digits. "
            f"Make one with: head -c {KEY_SIZE} /dev/urandom > {path}; chmod 600 {path}"
        )
    return key


def stamp_of(wall: float) -> int:
    """Time stamp of a wall-clock time (s since 1970)."""
    return max(0, int((wall - _EPOCH) / _TICK))


class Signer:
    """A key at one end of the link: stamps for what goes out, judgement of what comes in.

    Args:
        key: (32,) bytes, the same at both ends.
        wall: s since 1970; the only place of the link where the wall clock counts.
    """

    def __init__(self, key: bytes, wall: Callable[[], float] = time.time) -> None:
        self.key = key
        self._wall = wall
        self._newest = stamp_of(wall())
        self._streams: dict[tuple[int, int, int], int] = {}

    def stamp(self) -> int:
        """Time stamp for the next frame: that of the wall clock, but never one that was used already."""
        self._newest = max(self._newest + 1, stamp_of(self._wall()))
        return self._newest

    def accepts(self, received: Received) -> bool:
        """True for a frame that carries our key's signature and is newer than all before it."""
        frame = received.frame
        if not received.signed or len(frame) <= SIGNATURE:
            return False
        wanted = hashlib.sha256(self.key + frame[:-6]).digest()[:6]
        if not hmac.compare_digest(wanted, frame[-6:]):
            return False
        stamp = int.from_bytes(frame[-12:-6], "little")
        stream = (frame[-13], received.system, received.component)
        last = self._streams.get(stream)
        if stamp <= (max(0, self._newest - _NEW_STREAM) if last is None else last):
            return False
        self._streams[stream] = stamp
        self._newest = max(self._newest, stamp)
        return True
