"""The thesis' planner: greedy search in a window that slides over a cost tensor.

Thesis, chapter 6, terrain, with the moves as corrected: a cell in i +- d_w, j+1..j+d_w, u +- d_u is aimed at,
and one step is made towards it: i += sign(i* - i), j += 1, u += sign(u* - u), with sign(0) = 0. Two rules say
which cell:

- `CELL`, the thesis': the cheapest one. What lies on the way to it is not asked.
- `MEAN`: the one to which the moves towards it (both indices change until they fit, then straight on) cost
  least in the mean over their cells.

With a window of one cell both are the same. `MEAN` is the default: with it larger windows find cheaper ways,
as in the thesis; docs/terrain-planning.md has the figures.

Among equals the one that is least aside is aimed at, so that even ground is crossed straight. The thesis'
tensor has no infinite cells; here a cell is not aimed at where the first step towards it would go to an
infinite one, which changes nothing on a finite tensor.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.settings import require_range
from bluefoot_mpc.terrain.lattice import Goal, Path, Start, in_goal, reached_path, short_path, whole_goal
from bluefoot_mpc.types import FloatArray

WINDOWS = (1, 5, 15, 30)
"""Cells, the windows that the thesis compares."""

_SIGNS = tuple((di, du) for di in (-1, 0, 1) for du in (-1, 0, 1))


class Aim(enum.StrEnum):
    """Which cell of a window is aimed at."""

    CELL = "cell"
    MEAN = "mean"


@dataclass(frozen=True, slots=True)
class _Window:
    """Offsets of a window's cells, and of the cells on the way to each.

    Attributes:
        aside: (a,) in i.
        ahead: (w,) in j.
        turned: (b,) in u.
        way: the (a, w, b) cells that moves towards (i, last, u) pass, as indices into a tensor in a border.
    """

    aside: NDArray[np.intp]
    ahead: NDArray[np.intp]
    turned: NDArray[np.intp]
    way: tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]


def search(
    cost: FloatArray,
    start: Start,
    goal: Goal | None = None,
    window: int = 15,
    yaw_window: int = 1,
    aim: Aim = Aim.MEAN,
) -> Path:
    """The greedy way from a cell to a column.

    Args:
        cost: (n, m, l) costs; infinite where nobody can stand.
        start: the first cell.
        goal: where to end; as default anywhere in the last column. Only cells count from which it can still
            be reached in the steps that are left.
        window: d_w, cells that the window reaches to the sides and ahead.
        yaw_window: d_u, yaw indices that it reaches to either side.
        aim: which cell is aimed at.

    Returns:
        The way. Where all cells of a window are infinite, it ends there, is not `reached`, and says so.

    Raises:
        ConfigurationError: start or goal is no cell of the tensor, or a window is not positive.
    """
    require_range(1, 10_000, window=window, yaw_window=yaw_window)
    goal = whole_goal(cost, start, goal or Goal())
    cell, cells = start, [start]
    if not np.isfinite(cost[start]):
        return short_path(np.array(cells), f"nobody can stand on the first cell {start}")
    shape = _window(window, yaw_window)
    border = ((window, window), (0, window), (yaw_window, yaw_window))
    wide = np.pad(cost, border, constant_values=np.inf)
    while cell[1] != goal.j:
        step = _step(wide, cell, goal, shape, aim)
        if step is None:
            return short_path(np.array(cells), f"no cell of the window at {cell} can be stepped towards")
        cell = (cell[0] + step[0], cell[1] + 1, cell[2] + step[1])
        cells.append(cell)
    if not in_goal(goal, cell):
        return short_path(np.array(cells), f"the goal is too far aside of {start}")
    return reached_path(cost, np.array(cells))


def _window(window: int, yaw_window: int) -> _Window:
    aside, turned = np.arange(-window, window + 1), np.arange(-yaw_window, yaw_window + 1)
    ahead = np.arange(1, window + 1)
    at_i, at_j, at_u = aside[:, None, None], ahead[None, :, None], turned[None, None, :]
    way = (np.clip(at_i, -at_j, at_j), at_j, np.clip(at_u, -at_j, at_j))
    return _Window(aside, ahead, turned, (way[0] + window, way[1], way[2] + yaw_window))


def _step(wide: FloatArray, cell: Start, goal: Goal, window: _Window, aim: Aim) -> tuple[int, int] | None:
    """Signs of the step in i and u towards the cell that is aimed at; None where there is none.

    Args:
        wide: the tensor in a border of infinite cells as wide as the window, but for the side it came from.
        cell: where the way is, in the tensor without its border.
        goal: with a column.
        window: offsets.
        aim: the rule.
    """
    view = _prices(wide, cell, window) if aim is Aim.CELL else _means(wide, cell, window)
    _strike_outside(view, cell, goal, window)
    best = view.min()
    if not np.isfinite(best):
        return None
    ties = np.argwhere(view == best)
    away = np.abs(window.aside[ties[:, 0]]) + np.abs(window.turned[ties[:, 2]])
    aimed = ties[int(np.argmin(away))]
    return int(np.sign(window.aside[aimed[0]])), int(np.sign(window.turned[aimed[2]]))


def _prices(wide: FloatArray, cell: Start, window: _Window) -> FloatArray:
    """(a, w, b) costs of a window's cells; infinite where the first step towards them is."""
    i, j, u = cell
    rows, turns = slice(i, i + window.aside.size), slice(u, u + window.turned.size)
    view = wide[rows, j + 1 : j + 1 + window.ahead.size, turns].copy()
    middle_i, middle_u = window.aside.size // 2, window.turned.size // 2
    for di, du in _SIGNS:
        if not np.isfinite(view[middle_i + di, 0, middle_u + du]):
            behind = (np.sign(window.aside) == di)[:, None] & (np.sign(window.turned) == du)[None, :]
            view[np.broadcast_to(behind[:, None, :], view.shape)] = np.inf
    return view


def _means(wide: FloatArray, cell: Start, window: _Window) -> FloatArray:
    """(a, w, b) mean costs of the moves towards a window's cells; infinite where one of them is."""
    i, j, u = cell
    view = np.cumsum(wide[window.way[0] + i, window.way[1] + j, window.way[2] + u], axis=1)
    view /= window.ahead[None, :, None]
    return view


def _strike_outside(view: FloatArray, cell: Start, goal: Goal, window: _Window) -> None:
    """Make cells infinite from which the goal is out of reach: i and u change by at most one a column."""
    left = (goal.j if goal.j is not None else cell[1]) - cell[1] - window.ahead
    view[:, left < 0] = np.inf
    if goal.i is not None:
        view[np.abs(window.aside[:, None] + cell[0] - goal.i) > left[None, :]] = np.inf
    if goal.u is not None:
        aside = np.abs(window.turned[None, :] + cell[2] - goal.u) > left[:, None]
        view[np.broadcast_to(aside, view.shape)] = np.inf
