"""A coarse map around the robot: what stands where, what has been seen, where the robot has been.

Squares of a decimetre in the odometry frame. The map moves with the robot in
large steps, so that it stays bounded. It serves to choose a way; what keeps the
robot off things is the guard, on the points themselves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.navigation.scan import LevelScan
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import BoolArray, FloatArray

_TURN = 1024
"""Directions in a turn that the map tells apart."""

OCCUPIED, MOST = 2, 8
"""Evidence from which a square counts as occupied, and the most that is gathered."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GridConfig:
    """Size of the map, and how far a sweep is believed."""

    cell: float = 0.10  # m
    cells: int = 200  # a side
    edge: int = 50  # squares to the edge at which the map moves on
    sight: float = 4.0  # m that a sweep fills in
    visited: float = 0.35  # m around the robot that count as visited

    def __post_init__(self) -> None:
        require_positive(
            cell=self.cell, cells=self.cells, edge=self.edge, sight=self.sight, visited=self.visited
        )


class MapGrid:
    """The map; x is the first index.

    Attributes:
        evidence: (n, n) for a thing in the square; from `OCCUPIED` on there is one.
        seen: (n, n) s, when it was last looked into; negative infinity before.
        visited: (n, n) s, when the robot was last there; negative infinity before.
        cell: m, side of a square.

    Args:
        config: size and sight.
    """

    def __init__(self, config: GridConfig) -> None:
        self._config = config
        self.cell = config.cell
        reach = round(config.sight / config.cell)
        steps = np.arange(-reach, reach + 1) * config.cell
        self._reach = reach
        far = np.hypot(steps[:, None], steps[None, :])
        angle = np.arctan2(steps[None, :], steps[:, None])
        self._edge = far + 0.5 * config.cell
        self._here = far < config.cell
        self._near = far <= config.visited
        self._direction = np.rint((angle + math.pi) * (_TURN / (2.0 * math.pi))).astype(np.intp) % _TURN
        self._bearing = np.zeros(0)
        self.reset()

    def reset(self) -> None:
        """Forget everything; the middle is the origin of the odometry."""
        n = self._config.cells
        self.evidence: NDArray[np.int8] = np.zeros((n, n), dtype=np.int8)
        self.seen = np.full((n, n), -np.inf)
        self.visited = np.full((n, n), -np.inf)
        self._corner = (-(n // 2), -(n // 2))

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """Indices of the square that holds a point (m, odometry frame); they may lie outside the map."""
        cell = self._config.cell
        return math.floor(x / cell) - self._corner[0], math.floor(y / cell) - self._corner[1]

    def nearest_cell(self, x: float, y: float) -> tuple[int, int]:
        """Indices of the square on the map that is nearest to a point (m, odometry frame)."""
        row, column = self.cell_of(x, y)
        last = self._config.cells - 1
        return min(max(row, 0), last), min(max(column, 0), last)

    def centres(self, cells: NDArray[np.signedinteger[Any]]) -> FloatArray:
        """(k, 2) m, middles of (k, 2) squares in the odometry frame."""
        return np.asarray((cells + self._corner + 0.5) * self._config.cell)

    def inside(self, cell: tuple[int, int], margin: int = 0) -> bool:
        """True where a square lies on the map, `margin` squares off its edge."""
        low, high = margin, self._config.cells - margin
        return low <= cell[0] < high and low <= cell[1] < high

    def step(self, scan: LevelScan, pose: Pose) -> None:
        """Take in a sweep.

        Args:
            scan: the newest sweep.
            pose: of the robot at the time of the sweep.
        """
        self._move_on(pose)
        lidar = pose.to_odometry(scan.origin[None])[0]
        row, column = self.cell_of(*lidar.tolist())
        window = self._window(row, column)
        free = self._looked_into(scan, pose.yaw)[window[1]]
        self.seen[window[0]][free] = scan.time
        self.visited[window[0]][self._near[window[1]]] = scan.time
        patch = self.evidence[window[0]]
        patch[free & (patch > 0)] -= 1
        self._mark(scan, pose)

    def occupied(self) -> BoolArray:
        """(n, n) True where a thing stands."""
        return np.asarray(self.evidence >= OCCUPIED)

    def _looked_into(self, scan: LevelScan, yaw: float) -> BoolArray:
        """(m, m) True for the squares around the LIDAR that end before their ray does."""
        if scan.bearing is not self._bearing:
            self._take_bearings(scan.bearing)
        # The nearest of three rays: one that found no echo is no proof.
        distance = scan.distance.copy()
        np.minimum(distance[1:], scan.distance[:-1], out=distance[1:])
        np.minimum(distance[:-1], scan.distance[1:], out=distance[:-1])
        around = np.zeros(2 * _TURN)
        around[self._ahead] = np.minimum(distance[self._ray], self._config.sight)
        around[_TURN:] = around[:_TURN]
        shift = round(-yaw * _TURN / (2.0 * math.pi)) % _TURN
        return np.asarray((self._edge < around[self._direction + shift]) | self._here)

    def _take_bearings(self, bearing: FloatArray) -> None:
        """Which ray looks into each direction, and which directions none does."""
        self._bearing = bearing
        directions = np.arange(_TURN) * (2.0 * math.pi / _TURN) - math.pi
        self._ahead = np.flatnonzero((directions >= bearing[0]) & (directions <= bearing[-1]))
        self._ray = np.searchsorted(0.5 * (bearing[1:] + bearing[:-1]), directions[self._ahead])

    def _mark(self, scan: LevelScan, pose: Pose) -> None:
        hits = pose.to_odometry(scan.points[scan.hit & (scan.distance < self._config.sight)])
        cells = np.floor(hits / self._config.cell).astype(np.intp) - self._corner
        good = ((cells >= 0) & (cells < self._config.cells)).all(axis=1)
        rows, columns = cells[good].T
        self.evidence[rows, columns] = np.minimum(self.evidence[rows, columns] + 3, MOST)
        self.seen[rows, columns] = scan.time

    def _window(self, row: int, column: int) -> tuple[tuple[slice, slice], tuple[slice, slice]]:
        """The part of the map around a square, and the same part of the tables around the LIDAR."""
        here, there = [], []
        for middle in (row, column):
            low, high = max(middle - self._reach, 0), min(middle + self._reach + 1, self._config.cells)
            here.append(slice(low, high))
            there.append(slice(low - middle + self._reach, high - middle + self._reach))
        return (here[0], here[1]), (there[0], there[1])

    def _move_on(self, pose: Pose) -> None:
        """Shift the map where the robot comes near its edge."""
        cell = self.cell_of(pose.x, pose.y)
        if self.inside(cell, self._config.edge):
            return
        middle = self._config.cells // 2
        shift = (cell[0] - middle, cell[1] - middle)
        self.evidence = _shifted(self.evidence, shift, 0)
        self.seen = _shifted(self.seen, shift, -np.inf)
        self.visited = _shifted(self.visited, shift, -np.inf)
        self._corner = (self._corner[0] + shift[0], self._corner[1] + shift[1])


def _shifted(array: NDArray[Any], shift: tuple[int, int], fill: float) -> NDArray[Any]:
    """The array moved against `shift`; what comes in is `fill`."""
    moved = np.full_like(array, fill)
    sources, targets = [], []
    for step, size in zip(shift, array.shape, strict=True):
        low, high = max(step, 0), min(size + step, size)
        sources.append(slice(low, max(low, high)))
        targets.append(slice(low - step, max(low, high) - step))
    moved[tuple(targets)] = array[tuple(sources)]
    return moved
