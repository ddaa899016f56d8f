"""The supply switch of an emulated board: two steps to on, and off by itself when heartbeats stay away."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from bluefoot_mpc.io.board.messages import POWER_MAGIC, CutReason, Refusal

_COUNT_MASK = 0xFFFFFFFF


class SupplySwitch:
    """State machine of the firmware around the servos' supply.

    Args:
        switch: turns the supply on or off.
        heartbeat: s after the last heartbeat the supply is cut.
        code_life: s that a code for switching on holds.
        seed: of the codes.

    Attributes:
        on: the switch is told to be on.
        live: there is voltage behind it.
        cut: why the supply is off, or was the last time.
        is_stuck: fault: the supply stays as it is, whatever the switch is told.
    """

    def __init__(self, switch: Callable[[bool], None], heartbeat: float, code_life: float, seed: int) -> None:
        self._switch, self._heartbeat, self._code_life = switch, heartbeat, code_life
        self._random = np.random.default_rng(seed)
        self._code: tuple[int, float] | None = None
        self._beat = -math.inf
        self.on = self.live = self.is_stuck = False
        self.cut = CutReason.NEVER_ON

    @property
    def deadline(self) -> float:
        """Time (s) of the cut if no heartbeat comes; infinity while the supply is off."""
        return self._beat + self._heartbeat if self.on else math.inf

    def beat(self, now: float) -> None:
        """A heartbeat has come in."""
        self._beat = now

    def code(self, magic: int, now: float) -> int | Refusal:
        """First step: a new code, which holds for a while and works once."""
        if magic != POWER_MAGIC:
            return Refusal.MAGIC
        self._code = (int(self._random.integers(1, 1 << 32)), now + self._code_life)
        return self._code[0]

    def enable(self, answer: int, now: float, is_low: bool) -> Refusal | None:
        """Second step: on, if the complement of the code comes in time and somebody's heart beats.

        Args:
            answer: what the host sent.
            now: s.
            is_low: the battery is too low.
        """
        # A code works once, whatever comes of it: nothing that is sent twice switches anything on.
        code, self._code = self._code, None
        if code is None:
            return Refusal.NO_CODE
        if now > code[1]:
            return Refusal.LATE
        if answer != ~code[0] & _COUNT_MASK:
            return Refusal.CODE
        if now - self._beat > self._heartbeat:
            return Refusal.HEARTBEAT
        if is_low:
            return Refusal.VOLTAGE
        self._set(True)
        return None

    def off(self, reason: CutReason) -> None:
        """Cut the supply."""
        if self.on:
            self.cut = reason
        self._code = None
        self._set(False)

    def _set(self, on: bool) -> None:
        self.on = on
        if not self.is_stuck and on != self.live:
            self.live = on
            self._switch(on)
