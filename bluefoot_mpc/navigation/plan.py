"""Ways over the coarse map: the cheapest, from the robot to all squares it can reach."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.navigation.grid import MapGrid
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import BoolArray, FloatArray

_NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))


@dataclass(frozen=True, kw_only=True, slots=True)
class PlanConfig:
    """What a way keeps to, and what it costs."""

    room: float = 0.40  # m from the robot's middle to a thing, at least
    comfortable: float = 0.60  # m; nearer costs
    near_cost: float = 6.0  # times the length, added at `room`
    unseen_cost: float = 1.5  # times the length, added where nothing has been seen yet
    start: float = 0.35  # m around the robot that it may always leave

    def __post_init__(self) -> None:
        require_positive(room=self.room, start=self.start)
        require_nonnegative(
            comfortable=self.comfortable, near_cost=self.near_cost, unseen_cost=self.unseen_cost
        )


class Ways(NamedTuple):
    """Ways from the robot over a part of the map.

    Attributes:
        corner: first row and column of the part.
        cost: (r, c) m, of the cheapest way to each square; infinite where none leads.
        before: (r, c) flat index of the square before it on that way; negative at the start.
        room: (r, c) m, from each square to the nearest thing.
    """

    corner: tuple[int, int]
    cost: FloatArray
    before: NDArray[np.int32]
    room: FloatArray


def prepare() -> None:
    """Load what searches need: at the start, for it takes a third of a second the first time."""
    import cv2  # noqa: F401, PLC0415 - heavy: not for who only reads a configuration
    import scipy.sparse.csgraph  # noqa: F401, PLC0415


def ways(grid: MapGrid, pose: Pose, config: PlanConfig, goal: FloatArray | None = None) -> Ways | None:
    """The cheapest ways from the robot; None where it is off the map.

    Args:
        grid: the map.
        pose: of the robot.
        config: what ways cost.
        goal: (2,) m in the odometry frame: ways may lead over what has not been seen, and the part that is
            searched holds it; None: over what is known to be free alone.
    """
    import cv2  # noqa: PLC0415 - heavy, and only who finds a way needs it

    start = grid.cell_of(pose.x, pose.y)
    if not grid.inside(start):
        return None
    cell = grid.cell
    seen = np.isfinite(grid.seen)
    through_unseen = goal is not None
    ends = [start] if goal is None else [start, grid.nearest_cell(*goal.tolist())]
    part = _part(seen, ends, margin=20 if through_unseen else 2)
    seen, occupied = seen[part], grid.occupied()[part]
    room = (
        cv2.distanceTransform(np.where(occupied, 0, 1).astype(np.uint8), cv2.DIST_L2, 5).astype(np.float64)
        * cell
    )
    row, column = start[0] - part[0].start, start[1] - part[1].start
    passable = (room >= config.room) & (seen | through_unseen)
    _free_start(passable, room, (row, column), config.start / cell)
    near = np.clip((config.comfortable - room) / max(config.comfortable - config.room, 1e-6), 0.0, 1.5)
    price = cell * (1.0 + config.near_cost * near * near + config.unseen_cost * ~seen)
    cost, before = _searched(passable, price, (row, column))
    return Ways((part[0].start, part[1].start), cost, before, room)


def way_to(found: Ways, cell: tuple[int, int], grid: MapGrid) -> FloatArray:
    """(k, 2) m in the odometry frame, the way from the robot to a square of the part; empty where none leads.

    Args:
        found: ways over the part.
        cell: row and column in the part.
        grid: the map.
    """
    if not np.isfinite(found.cost[cell]):
        return np.zeros((0, 2))
    columns = found.cost.shape[1]
    before = found.before.ravel()
    index, steps = cell[0] * columns + cell[1], []
    while index >= 0:
        steps.append(index)
        index = int(before[index])
    flat = np.array(steps[::-1], dtype=np.intp)
    return grid.centres(np.stack(np.divmod(flat, columns), axis=1) + np.array(found.corner))


class GoalWay:
    """The way to one goal, looked for again every now and then.

    Attributes:
        way: (k, 2) m in the odometry frame; empty where there is none.
        length: m, its cost; infinite where there is none.
        found: s, when there was one last; negative infinity before.

    Args:
        config: what ways cost.
        every: s between searches.
        tolerance: m from the goal within which a way may end.
    """

    def __init__(self, config: PlanConfig, every: float, tolerance: float) -> None:
        self._config = config
        self._every = every
        self._tolerance = tolerance
        self.reset()

    def reset(self) -> None:
        """Forget the goal."""
        self.way: FloatArray = np.zeros((0, 2))
        self.length = math.inf
        self.found = -math.inf
        self._due = -math.inf

    def step(self, goal: FloatArray, grid: MapGrid, pose: Pose, time: float) -> None:
        """Search anew where that is due.

        Args:
            goal: (2,) m in the odometry frame.
            grid: the map.
            pose: of the robot.
            time: s.
        """
        if time < self._due:
            return
        self._due = time + self._every
        found = ways(grid, pose, self._config, goal)
        cell = None if found is None else self._cell_near(goal, found, grid)
        if found is None or cell is None:
            self.way, self.length = np.zeros((0, 2)), math.inf
            return
        way = way_to(found, cell, grid)
        off_the_map = not grid.inside(grid.cell_of(*goal.tolist()))
        self.way = way if off_the_map or len(way) < 1 else np.vstack((way[:-1], goal))
        self.length, self.found = float(found.cost[cell]), time

    def _cell_near(self, goal: FloatArray, found: Ways, grid: MapGrid) -> tuple[int, int] | None:
        """The square nearest to the goal that can be got to, if it is within the tolerance."""
        row, column = grid.nearest_cell(*goal.tolist())
        row, column = row - found.corner[0], column - found.corner[1]
        n = math.ceil(self._tolerance / grid.cell)
        rows, columns = slice(max(row - n, 0), row + n + 1), slice(max(column - n, 0), column + n + 1)
        cells = np.argwhere(np.isfinite(found.cost[rows, columns])) + np.array((rows.start, columns.start))
        if not len(cells):
            return None
        away = np.hypot(cells[:, 0] - row, cells[:, 1] - column)
        best = int(away.argmin())
        if away[best] * grid.cell > self._tolerance:
            return None
        return int(cells[best, 0]), int(cells[best, 1])


def _part(seen: BoolArray, ends: list[tuple[int, int]], margin: int) -> tuple[slice, slice]:
    """The part of the map that holds some squares and all that has been seen."""
    sides = []
    for axis in (0, 1):
        used = np.flatnonzero(seen.any(axis=1 - axis)).tolist()
        marks = [end[axis] for end in ends] + used[:1] + used[-1:]
        sides.append(slice(max(min(marks) - margin, 0), min(max(marks) + margin + 1, seen.shape[axis])))
    return sides[0], sides[1]


def _free_start(passable: BoolArray, room: FloatArray, start: tuple[int, int], reach: float) -> None:
    """Let the robot leave where it stands, even if it is nearer to a thing than ways may lead."""
    n = math.ceil(reach)
    rows = slice(max(start[0] - n, 0), start[0] + n + 1)
    columns = slice(max(start[1] - n, 0), start[1] + n + 1)
    r, c = np.ogrid[rows.start : rows.stop, columns.start : columns.stop]
    patch = passable[rows, columns]
    r, c = r[: patch.shape[0]], c[:, : patch.shape[1]]
    around = (r - start[0]) ** 2 + (c - start[1]) ** 2 <= reach * reach
    patch |= around & (room[rows, columns] >= min(0.2, float(room[start])))
    passable[start] = True


def _searched(
    passable: BoolArray, price: FloatArray, start: tuple[int, int]
) -> tuple[FloatArray, NDArray[np.int32]]:
    """Costs and predecessors of all squares of the part, by Dijkstra's search among eight neighbours."""
    from scipy.sparse import csr_array  # noqa: PLC0415 - heavy, and only who finds a way needs it
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    number = np.full(passable.shape, -1, dtype=np.int32)
    nodes = np.flatnonzero(passable)
    number.ravel()[nodes] = np.arange(nodes.size, dtype=np.int32)
    one, other, length = [], [], []
    for dr, dc in _NEIGHBOURS:
        a, b = _pairs(passable.shape, dr, dc)
        both = passable[a] & passable[b]
        one.append(number[a][both])
        other.append(number[b][both])
        length.append(0.5 * math.hypot(dr, dc) * (price[a][both] + price[b][both]))
    rows, columns, weight = np.concatenate(one), np.concatenate(other), np.concatenate(length)
    graph = csr_array((weight, (rows, columns)), shape=(nodes.size, nodes.size))
    far, last = dijkstra(graph, directed=False, indices=int(number[start]), return_predecessors=True)
    cost = np.full(passable.shape, np.inf)
    cost.ravel()[nodes] = far
    before = np.full(passable.shape, -1, dtype=np.int32)
    before.ravel()[nodes] = np.where(last >= 0, nodes[np.maximum(last, 0)], -1)
    return cost, before


def _pairs(shape: tuple[int, ...], dr: int, dc: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
    """Two views of a part, shifted against each other by a neighbour's step."""
    rows, columns = shape[0], shape[1]
    a = (slice(0, rows - dr), slice(max(-dc, 0), columns - max(dc, 0)))
    b = (slice(dr, rows), slice(max(dc, 0), columns - max(-dc, 0)))
    return a, b
