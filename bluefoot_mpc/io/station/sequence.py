"""Telling new messages from repeated ones by the counter in MAVLink's header."""

from __future__ import annotations

import math

_COUNTER = 256


class SequenceGuard:
    """Takes a sender's message once, in order, and counts what was lost.

    A radio that repeats, or a network with two ways, delivers a message twice;
    the counter (0..255, one up with every message) shows it. It does not stop
    somebody who records messages and sends them again with a number that fits:
    that takes a key (see `signing`).

    Args:
        window: messages that may be lost in a row.
        timeout: s of silence after which any number is taken: the sender may have started anew.

    Attributes:
        taken: messages taken.
        lost: messages that never came.
        rejected: messages that came again, or out of order.
    """

    def __init__(self, window: int, timeout: float) -> None:
        self._window, self._timeout = window, timeout
        self._last = 0
        self._time = -math.inf
        self.taken = self.lost = self.rejected = 0

    def accepts(self, sequence: int, now: float) -> bool:
        """True for a message that is newer than all before it.

        Args:
            sequence: its counter, 0..255.
            now: s.
        """
        ahead = (sequence - self._last) % _COUNTER
        silent = now - self._time > self._timeout
        if not silent and not 1 <= ahead <= self._window:
            self.rejected += 1
            return False
        if math.isfinite(self._time) and ahead:
            self.lost += ahead - 1
        self._last, self._time = sequence, now
        self.taken += 1
        return True

    @property
    def loss(self) -> float:
        """Share of messages that were lost so far, 0..1."""
        return self.lost / max(1, self.lost + self.taken)
