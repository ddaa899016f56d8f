"""Time stamps of devices: counters that wrap, on a crystal of their own, put on the host's clock."""

from __future__ import annotations

from collections import deque


class Counter:
    """A counter of few bits, made one that never wraps.

    Args:
        bits: width of the counter.
        unit: s a count.
    """

    def __init__(self, bits: int, unit: float) -> None:
        self._span = 1 << bits
        self._unit = unit
        self._last: int | None = None

    def reset(self) -> None:
        """Forget the past: the next reading starts anew."""
        self._last = None

    def seconds(self, count: int) -> float:
        """Seconds of the device's clock; steps of less than half the range are taken as they are, also back.

        Args:
            count: reading of the counter, 0 .. 2^bits - 1.
        """
        if self._last is None:
            self._last = count
        step = (count - self._last) % self._span
        if step > self._span // 2:
            step -= self._span
        self._last += step
        return self._last * self._unit


class ClockOffset:
    """Offset from a device's clock to the host's, from pairs of times that delay can only push one way.

    A message that left at one time and was stamped at another has travelled in
    between. Of all pairs of a while, the one that travelled the shortest tells the
    offset best; the window makes it follow the drift of the two crystals.

    Args:
        window: s, how long a pair counts.
    """

    def __init__(self, window: float) -> None:
        self._window = window
        self._best: deque[tuple[float, float]] = deque()
        self.known = False

    def reset(self) -> None:
        """Forget every pair."""
        self._best.clear()
        self.known = False

    def observe(self, delay: float, time: float) -> None:
        """Take a pair.

        Args:
            delay: s, later minus earlier stamp, each on its own clock: offset plus travelling time.
            time: s, host's clock.
        """
        best = self._best
        while best and best[-1][0] >= delay:
            best.pop()
        best.append((delay, time))
        while best[0][1] < time - self._window:
            best.popleft()
        self.known = True

    @property
    def least(self) -> float:
        """The least delay of the window, s; 0 before the first pair."""
        return self._best[0][0] if self._best else 0.0
