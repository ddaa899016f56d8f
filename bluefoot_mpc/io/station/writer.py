"""From messages to frames: numbering, signing, and the share of the line that they may use."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.schedule import TokenBucket
from bluefoot_mpc.io.station.signing import Signer


@dataclass(slots=True)
class Count:
    """Traffic of one kind of message."""

    messages: int = 0
    bytes: int = 0


class FrameWriter:
    """The sending half of an end of the link.

    Args:
        system: MAVLink system of this end.
        component: its component.
        bucket: bytes that may leave.
        signer: signs every frame; None: they are not signed.

    Attributes:
        counts: traffic so far by the message's name.
    """

    def __init__(self, system: int, component: int, bucket: TokenBucket, signer: Signer | None) -> None:
        self._mav = mavlink.MAVLink(None, system, component)
        self._signer = signer
        if signer is not None:
            self._mav.signing.secret_key = signer.key
            self._mav.signing.sign_outgoing = True
        self._bucket = bucket
        self._waiting: deque[Any] = deque(maxlen=64)
        self.counts: dict[str, Count] = {}

    @property
    def waiting(self) -> bool:
        """True while answers wait that go before everything else."""
        return bool(self._waiting)

    def answer(self, message: Any) -> None:
        """Send a message before all streams."""
        self._waiting.append(message)

    def take_answer(self) -> Any:
        """The oldest of the answers, or None."""
        return self._waiting.popleft() if self._waiting else None

    def may_send(self, now: float) -> bool:
        """True while the line has room."""
        return self._bucket.level(now) > 0.0

    def wait(self, now: float) -> float:
        """Time (s) until the line has room."""
        return self._bucket.wait(now)

    def frame(self, message: Any) -> bytes:
        """The bytes of a message, counted."""
        if self._signer is not None:
            self._mav.signing.timestamp = self._signer.stamp()
        data = bytes(message.pack(self._mav))
        self._mav.seq = (self._mav.seq + 1) % 256
        self._bucket.take(len(data))
        count = self.counts.setdefault(message.get_type(), Count())
        count.messages += 1
        count.bytes += len(data)
        return data
