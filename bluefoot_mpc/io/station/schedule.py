"""Which message leaves next: streams with rates and priorities, on a line that must not fill up."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.settings import require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class Stream:
    """One kind of message that is sent again and again."""

    name: str
    rate: float  # Hz
    urgent: bool = False  # leaves before those that are not

    def __post_init__(self) -> None:
        require_positive(rate=self.rate)


class TokenBucket:
    """Bytes that may leave: so many a second, and a few at once.

    A frame may leave while there is anything in the bucket, and what it takes
    too much is owed: the mean rate holds whatever the sizes are.

    Args:
        rate: bytes/s.
        burst: bytes, the most that is saved up.
    """

    def __init__(self, rate: float, burst: float) -> None:
        self.rate, self.burst = rate, burst
        self._level = burst
        self._time = -math.inf

    def level(self, now: float) -> float:
        """Bytes that may leave; negative while some are owed."""
        if math.isinf(self._time):
            self._time = now
        self._level = min(self.burst, self._level + self.rate * max(0.0, now - self._time))
        self._time = max(self._time, now)
        return self._level

    def take(self, count: int) -> None:
        """Note that bytes have left."""
        self._level -= count

    def wait(self, now: float) -> float:
        """Time (s) until something may leave."""
        return max(0.0, -self.level(now) / self.rate)


class Schedule:
    """Due times of streams. On a line that is too slow every stream slows down by the same share.

    Args:
        streams: the streams, named differently.
        start: s.
    """

    def __init__(self, streams: Sequence[Stream], start: float) -> None:
        self._streams = {stream.name: stream for stream in streams}
        # Spread over their periods, so that not all of them are due at the same moment.
        self._due = {
            stream.name: start + index / max(1, len(streams)) / stream.rate
            for index, stream in enumerate(streams)
        }

    def next(self, now: float) -> str | None:
        """Name of the stream that is most overdue, urgent ones first; None: nothing is due."""
        late = [
            (stream.urgent, (now - self._due[name]) * stream.rate, name)
            for name, stream in self._streams.items()
            if now >= self._due[name]
        ]
        return max(late)[2] if late else None

    def done(self, name: str, now: float) -> None:
        """Note that a stream has had its turn, whether there was something to send or not."""
        period = 1.0 / self._streams[name].rate
        # What was missed is not made up for: the newest value is all that counts.
        self._due[name] = max(self._due[name] + period, now + 0.5 * period)

    def hurry(self, name: str, now: float) -> None:
        """Make a stream due at once."""
        self._due[name] = min(self._due[name], now)

    def wait(self, now: float) -> float:
        """Time (s) until something is due."""
        return max(0.0, min(self._due.values()) - now)
