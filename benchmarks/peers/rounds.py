"""Timing side by side: contestants take turns in one process, block by block."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

Contestant = Callable[[int], object]
"""Does its work on instance k (counted up without end; take it modulo)."""
BLOCK = 20
"""Calls in a row: enough to have warm caches, few enough to meet the same load of the machine."""
WARM_UP = 3
"""Blocks before anything counts."""


@dataclass(slots=True)
class Times:
    """Times of one contestant.

    Attributes:
        calls: s, every call.
        blocks: s, the median of every block.
    """

    calls: list[float] = field(default_factory=list)
    blocks: list[float] = field(default_factory=list)

    def as_plain(self) -> dict[str, float]:
        """µs."""
        p50, p99 = 1e6 * np.percentile(self.calls, [50.0, 99.0])
        return {"p50": float(p50), "p99": float(p99)}


def ratio(ours: Times, theirs: Times) -> float:
    """Median over the blocks of ours over theirs: both met the same load of the machine."""
    return float(np.median(np.array(ours.blocks) / np.array(theirs.blocks)))


def race(contestants: Mapping[str, Contestant], rounds: int) -> dict[str, Times]:
    """Time every contestant on the same instances.

    Args:
        contestants: name to work.
        rounds: blocks of each that count.
    """
    found = {name: Times() for name in contestants}
    gc.collect()
    gc.disable()
    try:
        for turn in range(WARM_UP + rounds):
            for name, work in contestants.items():
                block = [_timed(work, turn * BLOCK + k) for k in range(BLOCK)]
                if turn >= WARM_UP:
                    found[name].calls += block
                    found[name].blocks.append(float(np.median(block)))
    finally:
        gc.enable()
    return found


def _timed(work: Contestant, k: int) -> float:
    start = time.perf_counter()
    work(k)
    return time.perf_counter() - start
