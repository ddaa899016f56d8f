"""Frames of the board link: consistent overhead byte stuffing, a CRC, and a parser that is never lost.

A frame on the line is ``COBS(type, sequence, payload, CRC) 00``. The stuffing
leaves no zero byte inside a frame, so a receiver that joins late, or that has seen
garbage, is in step again at the next zero. See docs/board-protocol.md.
Source of the stuffing: Cheshire and Baker, Consistent Overhead Byte Stuffing (1999).
"""

from __future__ import annotations

import binascii
from dataclasses import dataclass

from bluefoot_mpc.exceptions import DeviceError

MAX_PAYLOAD = 64
"""Bytes; longer frames are refused unread."""

_OVERHEAD = 4
_MAX_STUFFED = MAX_PAYLOAD + _OVERHEAD + 1
_MAX_RUN = 0xFF


class FrameError(DeviceError):
    """Bytes are not a frame of the board: wrong stuffing, length or CRC."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame whose CRC holds.

    Attributes:
        kind: type of the message.
        sequence: 0..255, one more with every frame of a sender.
        payload: bytes of the message.
    """

    kind: int
    sequence: int
    payload: bytes


def crc16(data: bytes) -> int:
    """CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xFFFF, not reflected; of ``123456789`` it is 0x29B1."""
    return binascii.crc_hqx(data, 0xFFFF)


def stuff(data: bytes) -> bytes:
    """`data` without zero bytes: before each run of others stands its length plus one."""
    out = bytearray()
    for run in data.split(b"\0"):
        rest = run
        while len(rest) >= _MAX_RUN - 1:
            out += b"\xff" + rest[: _MAX_RUN - 1]
            rest = rest[_MAX_RUN - 1 :]
        out += bytes((len(rest) + 1,)) + rest
    return bytes(out)


def unstuff(data: bytes) -> bytes:
    """What `stuff` was given.

    Raises:
        FrameError: a run goes past the end, or there is a zero inside.
    """
    out = bytearray()
    at, size = 0, len(data)
    while at < size:
        code = data[at]
        end = at + code
        if code == 0 or end > size:
            raise FrameError(f"byte {at} of a stuffed frame of {size} leads past its end")
        out += data[at + 1 : end]
        at = end
        if code != _MAX_RUN and at < size:
            out.append(0)
    return bytes(out)


def encode_frame(kind: int, sequence: int, payload: bytes = b"") -> bytes:
    """The bytes of a frame on the line, its closing zero included.

    Raises:
        FrameError: the payload is too long.
    """
    if len(payload) > MAX_PAYLOAD:
        raise FrameError(f"payload of {len(payload)} bytes; at most {MAX_PAYLOAD} fit into a frame")
    body = bytes((kind, sequence & 0xFF)) + payload
    return stuff(body + crc16(body).to_bytes(2, "little")) + b"\0"


def decode_frame(stuffed: bytes) -> Frame:
    """The frame from the bytes between two zeros.

    Raises:
        FrameError: its stuffing, length or CRC is wrong.
    """
    if len(stuffed) > _MAX_STUFFED:
        raise FrameError(f"{len(stuffed)} bytes without an end of frame")
    data = unstuff(stuffed)
    if len(data) < _OVERHEAD:
        raise FrameError(f"frame of {len(data)} bytes; the shortest has {_OVERHEAD}")
    body = data[:-2]
    if crc16(body) != int.from_bytes(data[-2:], "little"):
        raise FrameError("the CRC of a frame is wrong")
    return Frame(body[0], body[1], body[2:])


class FrameParser:
    """Frames from bytes as they come, in pieces of any size.

    Attributes:
        frames: good frames so far.
        bad: runs of bytes so far that were no frame.
        lost: frames so far that the sequence numbers say are missing.
    """

    def __init__(self) -> None:
        self.frames = 0
        self.bad = 0
        self.lost = 0
        self.reset()

    def reset(self) -> None:
        """Forget what was begun, as after a break of the line; the counts stay."""
        self._rest = b""
        self._next: int | None = None

    def feed(self, data: bytes) -> list[Frame]:
        """The frames that `data` completes."""
        *whole, rest = (self._rest + data).split(b"\0")
        # A babbling line must not fill the memory: what is too long already is bad, whatever follows.
        self._rest = rest if len(rest) <= _MAX_STUFFED else rest[: _MAX_STUFFED + 1]
        found: list[Frame] = []
        for stuffed in whole:
            if not stuffed:
                continue
            try:
                frame = decode_frame(stuffed)
            except FrameError:
                self.bad += 1
                continue
            if self._next is not None:
                self.lost += (frame.sequence - self._next) & 0xFF
            self._next = (frame.sequence + 1) & 0xFF
            found.append(frame)
        self.frames += len(found)
        return found
