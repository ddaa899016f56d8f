"""The thesis' planner: greedy search in a window that slides over a cost tensor.

Thesis, chapter 6, terrain, with the moves as corrected: the best cell in i +- d_w, j+1..j+d_w, u +- d_u is
aimed at, and one step is made towards it: i += sign(i* - i), j += 1, u += sign(u* - u), with sign(0) = 0.
Among equal cells the nearest is aimed at, so that level ground is crossed straight.

The thesis' tensor has no infinite cells. Here a cell is not aimed at where the first step towards it would go
to an infinite one; on a finite tensor that changes nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.terrain.lattice import Goal, Path, Start, in_goal, reached_path, short_path, whole_goal
from bluefoot_mpc.types import FloatArray

WINDOWS = (1, 5, 15, 30)
"""Cells, the windows that the thesis compares."""

_SIGNS = tuple((di, du) for di in (-1, 0, 1) for du in (-1, 0, 1))
_Sides = tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]


def search(
    cost: FloatArray, start: Start, goal: Goal | None = None, window: int = 15, yaw_window: int = 1
) -> Path:
    """The greedy way from a cell to a column.

    Args:
        cost: (n, m, l) costs; infinite where nobody can stand.
        start: the first cell.
        goal: where to end; as default anywhere in the last column. The window holds only cells from which the
            goal can still be reached in the steps that are left.
        window: d_w, cells that the window reaches to the sides and ahead.
        yaw_window: d_u, yaw indices that it reaches to either side.

    Returns:
        The way. Where all cells of a window are infinite, it ends there, is not `reached`, and says so.

    Raises:
        ConfigurationError: start or goal is no cell of the tensor, or a window is not positive.
    """
    require_positive(window=window, yaw_window=yaw_window)
    goal = whole_goal(cost, start, goal or Goal())
    cell, cells = start, [start]
    if not np.isfinite(cost[start]):
        return short_path(np.array(cells), f"nobody can stand on the first cell {start}")
    while cell[1] != goal.j:
        step = _step(cost, cell, goal, (window, yaw_window))
        if step is None:
            return short_path(np.array(cells), f"no cell of the window at {cell} can be stepped towards")
        cell = (cell[0] + step[0], cell[1] + 1, cell[2] + step[1])
        cells.append(cell)
    if not in_goal(goal, cell):
        return short_path(np.array(cells), f"the goal is too far aside of {start}")
    return reached_path(cost, np.array(cells))


def _step(cost: FloatArray, cell: Start, goal: Goal, reach: tuple[int, int]) -> tuple[int, int] | None:
    """Signs of the step in i and u towards the best cell of the window; None where there is none."""
    i, j, u = cell
    n, _, turns = cost.shape
    last = goal.j if goal.j is not None else j
    low_i, high_i = max(i - reach[0], 0), min(i + reach[0], n - 1) + 1
    low_u, high_u = max(u - reach[1], 0), min(u + reach[1], turns - 1) + 1
    ahead = min(j + reach[0], last)
    # A copy, out of which cells are struck: those beside the goal's cone, and those behind an infinite step.
    view = cost[low_i:high_i, j + 1 : ahead + 1, low_u:high_u].copy()
    at_i, at_j, at_u = np.arange(low_i, high_i), np.arange(j + 1, ahead + 1), np.arange(low_u, high_u)
    _strike_outside(view, (at_i, at_j, at_u), goal)
    side_i, side_u = np.sign(at_i - i), np.sign(at_u - u)
    for di, du in _SIGNS:
        if not (0 <= i + di < n and 0 <= u + du < turns and np.isfinite(cost[i + di, j + 1, u + du])):
            behind = (side_i == di)[:, None, None] & (side_u == du)[None, None, :]
            np.copyto(view, np.inf, where=behind)
    best = view.min(initial=np.inf)
    if not np.isfinite(best):
        return None
    ties = np.argwhere(view == best)
    away = np.abs(at_i[ties[:, 0]] - i) + np.abs(at_u[ties[:, 2]] - u) + at_j[ties[:, 1]] - j
    aim = ties[int(np.argmin(away))]
    return int(np.sign(at_i[aim[0]] - i)), int(np.sign(at_u[aim[2]] - u))


def _strike_outside(view: FloatArray, sides: _Sides, goal: Goal) -> None:
    """Make cells infinite from which the goal is out of reach: i and u change by at most one a column."""
    at_i, at_j, at_u = sides
    left = (goal.j if goal.j is not None else 0) - at_j
    if goal.i is not None:
        view[np.abs(at_i[:, None] - goal.i) > left[None, :]] = np.inf
    if goal.u is not None:
        aside = np.abs(at_u[None, :] - goal.u) > left[:, None]
        view[np.broadcast_to(aside, view.shape)] = np.inf
