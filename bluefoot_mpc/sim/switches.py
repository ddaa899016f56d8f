"""Foot switches of the simulated robot."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.sim.config import SensorConfig
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.types import N_LEGS, BoolArray

BITS = np.array([1, 2, 4, 8])
"""What each leg's switch counts in the number of a state."""
_STATES = (np.arange(16)[:, None] & BITS) != 0
"""(16, 4) states of four switches by number, shared and read-only."""
_STATES.flags.writeable = False


class FootSwitches:
    """Four switches that close above a force, arrive late, and now and then chatter."""

    def __init__(self, config: SensorConfig, seed: int) -> None:
        self._config, self._seed = config, seed
        self.reset()

    def reset(self) -> None:
        """All open, no history."""
        self._rng = stream(self._seed, "switches")
        self._closed = 0
        self._chatter: tuple[float, int, int] | None = None
        self._history: deque[tuple[float, int]] = deque([(-math.inf, 0)])

    def measure(self, time: Sequence[float], closed: Sequence[float], now: float) -> tuple[BoolArray, float]:
        """Switch states as they arrive at `now`.

        Args:
            time: n sampling times since the last frame, s, rising.
            closed: which of the switches a force closes at those times: the sum
                of 1, 2, 4, 8 over the legs.
            now: s, time of the frame.

        Returns:
            (4,) states, and the time (s) at which they were sampled.
        """
        history = self._history
        for when, state in zip(time, closed, strict=True):
            if state == self._closed and self._chatter is None:
                history.append((when, self._closed))
            else:
                self._change(when, int(state))
        limit = now - self._config.switch_delay + 1e-9
        while len(history) > 1 and history[1][0] <= limit:
            history.popleft()
        when, known = history[0]
        return _STATES[known], when

    def _change(self, when: float, state: int) -> None:
        if state != self._closed:
            edges, before = state ^ self._closed, self._closed
            self._closed = state
            falling_back = edges & int((self._rng.random(N_LEGS) < self._config.switch_chatter) @ BITS)
            if falling_back:
                # The edge itself is seen; the samples after it are the old state for a while.
                self._chatter = (when + self._config.switch_chatter_time, falling_back, before)
        elif self._chatter is not None:
            until, feet, before = self._chatter
            if when <= until:
                state = (state & ~feet) | (before & feet)
            else:
                self._chatter = None
        self._history.append((when, state))
