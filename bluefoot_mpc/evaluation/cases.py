"""What is measured: a case is a scenario with options, seeds and the limits its figures must keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from bluefoot_mpc.evaluation.limits import Limit


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """One row of a table of figures: a scenario under fixed options, over seeds.

    Attributes:
        name: row title, unique in its battery.
        scenario: scenario to run.
        options: fields of `RunOptions` beside the seed.
        seeds: runs; each has its own seed of everything random.
        directions: of a push, so many and evenly spaced; run n is then robot n // directions,
            pushed to direction n % directions. 0: as the options say.
        limits: what the figures must keep.
    """

    name: str
    scenario: str
    options: Mapping[str, Any] = field(default_factory=dict)
    seeds: tuple[int, ...] = tuple(range(10))
    directions: int = 0
    limits: tuple[Limit, ...] = ()
