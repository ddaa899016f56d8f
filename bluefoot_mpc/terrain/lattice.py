"""Ways over the cells of a cost tensor: what a planner is asked, and what it answers.

All planners move on one graph (thesis, chapter 6, terrain; system of moves as corrected): from cell (i, j, u)
to (i + {-1, 0, 1}, j + 1, u + {-1, 0, 1}). So j grows by one with every step, and all ways to a column have
as many steps. The yaw index is bounded, it does not wrap: its ends are both "backwards", where no way turns.
A way costs the sum of the tensor over all of its cells, the first one included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.types import FloatArray

Start = tuple[int, int, int]
"""i (sideways), j (forward) and u (yaw) of the first cell."""


class Goal(NamedTuple):
    """Where a way ends: a column of cells, or less of it.

    Attributes:
        j: the column; None: the last one.
        i: the cell of it; None: any.
        u: the yaw index there; None: any.
    """

    j: int | None = None
    i: int | None = None
    u: int | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class Path:
    """A way over the cells of a cost tensor.

    Attributes:
        cells: (k, 3) i, j, u of its cells; where the goal was not reached, as far as the planner came.
        cost: sum over all cells; infinite where the goal was not reached.
        reached: True where the last cell lies in the goal.
        reason: why it ends short of the goal; empty where it does not.
    """

    cells: NDArray[np.intp]
    cost: float
    reached: bool
    reason: str = ""


def whole_goal(cost: FloatArray, start: Start, goal: Goal) -> Goal:
    """The goal with its column named, after a look at whether start and goal stand on the tensor.

    Raises:
        ConfigurationError: the tensor has not three dimensions, or start or goal is none of its cells, or the
            goal does not lie ahead of the start.
    """
    if cost.ndim != 3 or cost.size == 0:
        raise ConfigurationError(f"a cost tensor has three dimensions and some cells, not shape {cost.shape}")
    n, m, turns = cost.shape
    if any(not 0 <= k < size for k, size in zip(start, cost.shape, strict=True)):
        raise ConfigurationError(f"start {start} is no cell of a cost tensor of {cost.shape} cells")
    j = m - 1 if goal.j is None else goal.j
    if not start[1] <= j < m:
        raise ConfigurationError(f"goal column {j} must lie in {start[1]}..{m - 1}, ahead of the start")
    if not 0 <= (goal.i or 0) < n or not 0 <= (goal.u or 0) < turns:
        raise ConfigurationError(f"goal {goal} is no cell of a cost tensor of {cost.shape} cells")
    return Goal(j, goal.i, goal.u)


def in_goal(goal: Goal, cell: Start) -> bool:
    """True where a cell lies in the goal."""
    return cell[1] == goal.j and goal.i in (None, cell[0]) and goal.u in (None, cell[2])


def path_cost(cost: FloatArray, cells: NDArray[np.intp]) -> float:
    """Sum of the tensor over (k, 3) cells, correctly rounded, so that equal ways cost the same."""
    return math.fsum(cost[tuple(cells.T)].tolist())


def reached_path(cost: FloatArray, cells: NDArray[np.intp]) -> Path:
    """The way over (k, 3) cells that end in the goal."""
    return Path(cells=cells, cost=path_cost(cost, cells), reached=True)


def short_path(cells: NDArray[np.intp], reason: str) -> Path:
    """The way over (k, 3) cells that end short of the goal."""
    return Path(cells=cells, cost=math.inf, reached=False, reason=reason)
