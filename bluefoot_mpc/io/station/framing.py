"""Finding MAVLink 2 frames in a stream of bytes, some of them wrong.

Layout of a frame (MAVLink guide, "Packet Serialization"): ``FD LEN INC CMP
SEQ SYS COMP ID(3) payload CRC(2) [signature(13)]``. A frame that fails its sum
costs one byte, not the length that it pretends to have: good frames that began
inside it are still found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

START = 0xFD
HEADER = 10
CRC = 2
SIGNATURE = 13
_SIGNED = 0x01
_FULL_SIZE: dict[int, int] = {number: kind.unpacker.size for number, kind in mavlink.mavlink_map.items()}


@dataclass(frozen=True, kw_only=True, slots=True)
class Received:
    """One frame whose sum is right.

    Attributes:
        message: what pymavlink makes of it.
        frame: its bytes.
        sequence: 0..255, the sender's counter.
        system: MAVLink system of the sender.
        component: its component.
        signed: True when a signature follows (which nobody has checked yet).
    """

    message: Any
    frame: bytes
    sequence: int
    system: int
    component: int
    signed: bool


class FrameReader:
    """Incremental reader of one stream.

    Attributes:
        skipped: bytes that belonged to no frame.
        bad: frames that began well and failed their sum.
    """

    def __init__(self) -> None:
        # Without a file or a key it neither writes nor judges signatures.
        self._decoder = mavlink.MAVLink(None)
        self._buffer = bytearray()
        self.skipped = 0
        self.bad = 0

    def feed(self, data: bytes) -> list[Received]:
        """Take bytes, give the frames that they complete."""
        self._buffer += data
        found: list[Received] = []
        at = 0
        while True:
            at, length = self._next(at)
            if length == 0 or len(self._buffer) - at < length:
                break
            frame = bytes(self._buffer[at : at + length])
            message = self._decode(frame)
            if message is None:
                self.bad += 1
                self.skipped += 1
                at += 1
                continue
            at += length
            found.append(_received(message, frame))
        del self._buffer[:at]
        return found

    def clear(self) -> None:
        """Forget what has begun."""
        self._buffer.clear()

    def _next(self, at: int) -> tuple[int, int]:
        """Where the next frame may begin, and its length; 0: too little has come to know."""
        while True:
            start = self._buffer.find(START, at)
            if start < 0:
                self.skipped += len(self._buffer) - at
                return len(self._buffer), 0
            self.skipped += start - at
            at = start
            if len(self._buffer) - at < HEADER:
                return at, 0
            size, incompatible = self._buffer[at + 1], self._buffer[at + 2]
            number = int.from_bytes(self._buffer[at + 7 : at + HEADER], "little")
            # A longer payload than the message has may come from a newer dialect: not from ours.
            if size <= _FULL_SIZE.get(number, -1) and incompatible in (0, _SIGNED):
                return at, HEADER + size + CRC + (SIGNATURE if incompatible else 0)
            self.skipped += 1
            at += 1

    def _decode(self, frame: bytes) -> Any:
        try:
            return self._decoder.decode(bytearray(frame))
        except mavlink.MAVError:
            return None


def _received(message: Any, frame: bytes) -> Received:
    header = message.get_header()
    return Received(
        message=message,
        frame=frame,
        sequence=header.seq,
        system=header.srcSystem,
        component=header.srcComponent,
        signed=bool(frame[2] & _SIGNED),
    )
