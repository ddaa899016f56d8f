"""One table out of searches at single speeds: the path of points that is good and smooth.

The robot ramps through all speeds, so neighbouring knots must be compatible.
Each search leaves several points that are nearly as good as its best one; of
these the path with the smallest sum of costs and squared steps between
neighbours is taken (dynamic programming, exact).
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.table import BOUNDS
from bluefoot_mpc.tuning.space import Space, Values

DIGITS = 4
"""Digits after the point of a table's entries: 0.1 mm and 0.1 ms."""


class Candidate(NamedTuple):
    """A point that a search found, and its cost."""

    values: Values
    cost: float


def roughness(a: Mapping[str, float], b: Mapping[str, float], space: Space) -> float:
    """Sum of squared differences of two points, each over the width of its range."""
    return sum(((a[p.name] - b[p.name]) / (p.high - p.low)) ** 2 for p in space.parameters)


def smooth_path(
    candidates: Mapping[float, Sequence[Candidate]], space: Space, weight: float
) -> dict[float, Candidate]:
    """The cheapest path through one candidate per speed.

    Args:
        candidates: by speed (m/s), each with one point at least.
        space: ranges of the parameters.
        weight: cost of one unit of roughness between knots that are 0.1 m/s apart.

    Raises:
        ConfigurationError: a speed has no candidate.
    """
    speeds = sorted(candidates)
    if not speeds or not all(candidates[speed] for speed in speeds):
        raise ConfigurationError("every speed of a path needs one candidate at least")
    reached = [(candidate.cost, [candidate]) for candidate in candidates[speeds[0]]]
    for before, speed in itertools.pairwise(speeds):
        stiffness = weight * 0.1 / (speed - before)
        reached = [_cheapest(reached, candidate, space, stiffness) for candidate in candidates[speed]]
    _, path = min(reached, key=lambda entry: entry[0])
    return dict(zip(speeds, path, strict=True))


def gait_table(knots: Mapping[float, Mapping[str, float]]) -> dict[str, Any]:
    """Columns of a `GaitTable` from points by speed (m/s), ready for TOML.

    Parameters that the table does not know stay out.
    """
    speeds = sorted(knots)
    names = [name for name in BOUNDS if all(name in knots[speed] for speed in speeds)]
    columns = {name: [round(float(knots[speed][name]), DIGITS) for speed in speeds] for name in names}
    return {"speed": speeds, **columns}


def _cheapest(
    reached: Sequence[tuple[float, list[Candidate]]], candidate: Candidate, space: Space, stiffness: float
) -> tuple[float, list[Candidate]]:
    """The best way to a candidate from the paths up to the knot before."""
    ways = [
        (total + stiffness * roughness(path[-1].values, candidate.values, space), path)
        for total, path in reached
    ]
    total, path = min(ways, key=lambda entry: entry[0])
    return total + candidate.cost, [*path, candidate]
