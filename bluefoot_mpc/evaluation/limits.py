"""What the figures of a case must keep, over its seeds."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from bluefoot_mpc.exceptions import ConfigurationError


@dataclass(frozen=True, kw_only=True, slots=True)
class Limit:
    """A bound on one figure of a case.

    Attributes:
        figure: key of the figures (see `bluefoot_mpc.evaluation.measure`).
        bound: the value that may just be reached.
        side: whether the figure must stay at or below, or at or above it.
        unit: for tables.
        over: what of the seeds must keep it: the ``worst``, the ``median``, or a ``share`` of them.
        share: least part of the seeds that must keep it, where `over` is ``share``.
    """

    figure: str
    bound: float
    side: Literal["max", "min"] = "max"
    unit: str = ""
    over: Literal["worst", "median", "share"] = "worst"
    share: float = 0.95

    def __post_init__(self) -> None:
        if not 0.0 < self.share <= 1.0:
            raise ConfigurationError(f"share = {self.share!r} must lie in 0..1, 0 excluded")

    def keeps(self, value: float | None) -> bool:
        """True when one value is within the bound; an unknown one is not."""
        if value is None:
            return False
        return value <= self.bound if self.side == "max" else value >= self.bound

    def value(self, values: Sequence[float | None]) -> float | None:
        """What is compared: the worst or the median seed, or the share of seeds within the bound.

        None where a worst or a median cannot be named, because a seed's figure is unknown.
        """
        if not values:
            return None
        if self.over == "share":
            return sum(self.keeps(value) for value in values) / len(values)
        known = [value for value in values if value is not None]
        if len(known) < len(values):
            return None
        if self.over == "median":
            return statistics.median(known)
        return max(known) if self.side == "max" else min(known)

    def holds(self, values: Sequence[float | None]) -> bool:
        """True when the seeds' values keep the limit."""
        value = self.value(values)
        if self.over == "share":
            return value is not None and value >= self.share
        return self.keeps(value)

    def describe(self) -> str:
        """The limit as a table shows it."""
        sign = "≤" if self.side == "max" else "≥"
        bound = f"{sign} {self.bound:g} {self.unit}".rstrip()
        if self.over == "median":
            return f"median {bound}"
        return f"{bound} in ≥ {100.0 * self.share:g} % of the runs" if self.over == "share" else bound
