"""Foot switches on their way from the board: stuck and chattering ones are found.

Only what the switches themselves tell is used, not what the gait wanted. A
switch that never changes while two others cycle many times is stuck: that holds
for every gait, and standing still flags nobody.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.messages import Switches
from bluefoot_mpc.types import LEGS, N_LEGS, BoolArray

_TRUSTED_EDGES = 15
"""Edges in the window of a switch that may be trusted again: a quick gait on a floor where feet bounce."""


class SwitchWatch:
    """State of the four switches and how far each may be trusted.

    Attributes:
        closed: (4,) newest states.
        time: s, host time at which they were read; NaN before the first time.
    """

    def __init__(self, config: BoardConfig) -> None:
        self._config = config
        self.closed = np.zeros(N_LEGS, dtype=np.bool_)
        self.time = math.nan
        self._arrival = -math.inf
        self._counts: tuple[int, ...] | None = None
        self._edges: list[deque[float]] = [deque() for _ in LEGS]
        self._others = np.zeros((N_LEGS, N_LEGS), dtype=np.int64)
        self._noisy = [-math.inf] * N_LEGS

    def restart(self) -> None:
        """The board has started anew: its counts of edges say nothing about the time before."""
        self._counts = None

    def add(self, switches: Switches, time: float, arrival: float) -> None:
        """Take a message.

        Args:
            switches: states and edge counts.
            time: s, host time at which the board read them.
            arrival: s, host time at which the message was read.
        """
        if self._counts is not None and switches.edges != self._counts:
            for leg, (count, before) in enumerate(zip(switches.edges, self._counts, strict=True)):
                if new := (count - before) & 0xFF:
                    self._count(leg, new, time)
        self._counts = switches.edges
        self.closed = np.array(switches.closed, dtype=np.bool_)
        self.time, self._arrival = time, arrival

    def _count(self, leg: int, new: int, time: float) -> None:
        self._others[:, leg] += new
        self._others[leg] = 0
        edges = self._edges[leg]
        edges.extend([time] * new)
        self._forget(leg, time)
        if len(edges) > self._config.chatter_edges:
            self._noisy[leg] = time

    def _forget(self, leg: int, time: float) -> None:
        edges = self._edges[leg]
        while edges and edges[0] < time - self._config.chatter_window:
            edges.popleft()
        if self._noisy[leg] > -math.inf and len(edges) > _TRUSTED_EDGES:
            self._noisy[leg] = time

    def judge(self, now: float) -> tuple[BoolArray, tuple[str, ...]]:
        """(4,) which switches may be trusted, and what is wrong with the others.

        Args:
            now: s, host time.
        """
        config = self._config
        age = now - self._arrival
        if age > config.switch_silence:
            since = f"for {age * 1e3:.0f} ms" if math.isfinite(age) else "yet"
            return np.zeros(N_LEGS, dtype=np.bool_), (f"foot switches: nothing heard {since}",)
        valid = np.ones(N_LEGS, dtype=np.bool_)
        faults: list[str] = []
        others = self._others
        for leg, name in enumerate(LEGS):
            if self._noisy[leg] > -math.inf:
                self._forget(leg, now)
                if now - self._noisy[leg] <= config.chatter_rest:
                    faults.append(f"foot switch {name}: chatters")
                    valid[leg] = False
                    continue
                self._noisy[leg] = -math.inf
            if others.item(leg, 0) + others.item(leg, 1) + others.item(leg, 2) + others.item(
                leg, 3
            ) >= config.stuck_edges and self._is_stuck(leg):
                state = "closed" if self.closed[leg] else "open"
                faults.append(f"foot switch {name}: stuck {state}, the others change")
                valid[leg] = False
        return valid, tuple(faults)

    def _is_stuck(self, leg: int) -> bool:
        """At least two others, none of them chattering, have cycled since this one changed."""
        moved = sorted(
            int(count) for other, count in enumerate(self._others[leg]) if self._noisy[other] == -math.inf
        )
        return len(moved) > 1 and moved[-2] >= self._config.stuck_edges
