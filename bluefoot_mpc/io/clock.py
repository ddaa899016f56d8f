"""Time as devices see it: the machine's monotonic clock, or one that passes only when somebody waits."""

from __future__ import annotations

import time
from typing import Protocol


class Clock(Protocol):
    """A clock that never goes back; its zero means nothing."""

    def now(self) -> float:
        """Seconds."""
        ...

    def sleep_until(self, when: float) -> None:
        """Wait until `when` (s); returns at once where that is past."""
        ...


class MonotonicClock:
    """The machine's monotonic clock; changes of the wall clock do not touch it.

    Args:
        zero: s on the machine's clock that count as zero; two processes with one zero agree.
    """

    def __init__(self, zero: float = 0.0) -> None:
        self.zero = zero

    def now(self) -> float:
        """Seconds."""
        return time.monotonic() - self.zero

    def sleep_until(self, when: float) -> None:
        """Sleep, without spinning."""
        time.sleep(max(0.0, when - self.now()))


class VirtualClock:
    """Time that passes only by waiting: a day of bus traffic takes as long as its computing does."""

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def now(self) -> float:
        """Seconds."""
        return self._now

    def sleep_until(self, when: float) -> None:
        """Let time pass."""
        self._now = max(self._now, when)


class PacedClock(VirtualClock):
    """A virtual clock that is never ahead of the wall's: for looking on."""

    def __init__(self) -> None:
        super().__init__()
        self._started = time.monotonic()

    def sleep_until(self, when: float) -> None:
        """Let time pass on both clocks."""
        super().sleep_until(when)
        time.sleep(max(0.0, self._started + self._now - time.monotonic()))
