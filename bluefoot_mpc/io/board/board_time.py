"""The board's clock on the host's: exchanged stamps, and jumps found."""

from __future__ import annotations

from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.messages import BOARD_TIME_BITS, BOARD_TIME_UNIT
from bluefoot_mpc.io.device_time import ClockOffset, Counter

_OPEN_REQUESTS = 10
"""Answers that are waited for at once; more have been lost."""


class BoardTime:
    """Turns board times into host times.

    The host asks, and the board answers with its time when the request came in. The
    way there has a known length, however late the answer is read: so a host that looks
    only once per command period still knows the offset to a fraction of a millisecond.

    Attributes:
        jumps: jumps of the board's clock so far.
    """

    def __init__(self, config: BoardConfig) -> None:
        self._config = config
        self._counter = Counter(BOARD_TIME_BITS, BOARD_TIME_UNIT)
        self._offset = ClockOffset(config.time_window)
        self._asked: dict[int, float] = {}
        self._token = 0
        self._due = 0.0
        self._last = -float("inf")
        self.jumps = 0

    @property
    def known(self) -> bool:
        """True once the clocks have been compared."""
        return self._offset.known

    def reset(self) -> None:
        """Forget the comparison, as after a restart of the board."""
        self._counter.reset()
        self._offset.reset()
        self._asked.clear()
        self._due = 0.0
        self._last = -float("inf")

    def request(self, now: float, transit: float) -> int | None:
        """Token of a request to be sent now; None where none is due.

        Args:
            now: s.
            transit: s that the request's bytes take on the line.
        """
        if now < self._due:
            return None
        self._due = now + self._config.time_request
        self._token = (self._token + 1) & 0xFFFFFFFF
        if len(self._asked) > _OPEN_REQUESTS:
            self._asked.clear()
        self._asked[self._token] = now + transit
        return self._token

    def answer(self, token: int, count: int) -> None:
        """Take the answer to a request; one to nothing that was asked is ignored."""
        sent = self._asked.pop(token, None)
        if sent is not None:
            self._offset.observe(self._counter.seconds(count) - sent, sent)

    def stamp(self, count: int, arrival: float) -> float:
        """Host time (s) of an inertial sample; NaN while the clocks are not compared or after a jump.

        Args:
            count: board time.
            arrival: s, host time at which it was read.
        """
        board = self._counter.seconds(count)
        jumped = board <= self._last
        self._last = board
        if self.known and not jumped:
            time = board - self._offset.least
            if time <= arrival + self._config.time_ahead:
                return time
            jumped = True
        if jumped:
            self.jumps += 1
            self.reset()
        return float("nan")

    def host_time(self, count: int, arrival: float) -> float:
        """Host time (s) of another message: its arrival where the stamp says nothing."""
        if not self.known:
            return arrival
        return min(arrival, self._counter.seconds(count) - self._offset.least)
