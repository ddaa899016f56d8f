"""When to try again to open a port that was lost: soon at first, less often the longer it is gone."""

from __future__ import annotations


class Retry:
    """Back-off of a reconnecting driver.

    Args:
        first: s to the first attempt.
        longest: s between attempts in the end; each wait is twice the one before.

    Attributes:
        successes: times that the port came back.
    """

    def __init__(self, first: float, longest: float) -> None:
        self._first, self._longest = first, longest
        self._wait = first
        self._due = 0.0
        self.successes = 0

    def begin(self, now: float) -> None:
        """The port is lost, or the attempt failed. Only good data makes the next wait short again."""
        self._due = now + self._wait
        self._wait = min(2.0 * self._wait, self._longest)

    def is_due(self, now: float) -> bool:
        """True when it is time for an attempt."""
        return now >= self._due

    def succeeded(self) -> None:
        """The port is open again."""
        self.successes += 1

    def settled(self) -> None:
        """Good data came: the next loss is a new one."""
        self._wait = self._first
