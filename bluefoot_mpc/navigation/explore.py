"""Where to go for something new.

To the edge of what has been seen, else to where the robot has not been for long.

The potential field alone tends to circle. So the coarse map is searched for the
edge between what is known to be free and what has never been seen, and the
cheapest worthwhile piece of that edge is the goal.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.navigation.grid import MapGrid
from bluefoot_mpc.navigation.plan import PlanConfig, Ways, way_to, ways
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class ExploreConfig:
    """How goals are chosen."""

    enabled: bool = True  # False: the potential field leads alone
    every: float = 1.0  # s between searches
    least_edge: int = 3  # squares of an edge that is worth a way
    edge_gain: float = 0.06  # m of way that a square of an edge is worth
    most_edge: int = 15  # squares that count
    turn_cost: float = 0.4  # m of way for each radian that the robot must turn first
    loyalty: float = 0.8  # m of way that the present goal is worth
    reached: float = 0.35  # m from a goal at which it counts as reached
    patience: float = 25.0  # s to come nearer to a goal
    avoid: float = 60.0  # s for which a goal is left alone that could not be reached
    avoid_radius: float = 0.5  # m around it
    room: float = 0.5  # m around a place that is visited again
    stale: float = 200.0  # s without a visit after which a place is as good as new

    def __post_init__(self) -> None:
        require_positive(
            every=self.every, least_edge=self.least_edge, most_edge=self.most_edge, reached=self.reached,
            patience=self.patience, avoid=self.avoid, avoid_radius=self.avoid_radius, stale=self.stale,
            room=self.room,
        )  # fmt: skip
        require_nonnegative(edge_gain=self.edge_gain, turn_cost=self.turn_cost, loyalty=self.loyalty)


class Explorer:
    """Chooses goals and the ways to them.

    Attributes:
        way: (k, 2) m in the odometry frame; empty where there is none.

    Args:
        config: how goals are chosen.
        plan: what ways cost.
    """

    def __init__(self, config: ExploreConfig, plan: PlanConfig) -> None:
        self._config = config
        self._plan = plan
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.way: FloatArray = np.zeros((0, 2))
        self._due = -math.inf
        self._goal: FloatArray | None = None
        self._least = math.inf
        self._nearer = 0.0
        self._avoided: list[tuple[float, float, float]] = []

    def step(self, grid: MapGrid, pose: Pose, time: float) -> None:
        """Search anew where that is due.

        Args:
            grid: the map.
            pose: of the robot.
            time: s.
        """
        if not self._config.enabled or time < self._due:
            return
        self._due = time + self._config.every
        found = ways(grid, pose, self._plan)
        goal = None if found is None else self._chosen(found, grid, pose, time)
        if found is None or goal is None:
            self.way, self._goal = np.zeros((0, 2)), None
            return
        self._pursue(grid.centres(np.add(goal, found.corner)), float(found.cost[goal]), time)
        self.way = way_to(found, goal, grid)

    def give_up(self, time: float) -> None:
        """Leave the present goal alone for a while."""
        if self._goal is not None:
            x, y = self._goal.tolist()
            self._avoided.append((x, y, time + self._config.avoid))
        self._goal, self._due = None, -math.inf
        self.way = np.zeros((0, 2))

    def _pursue(self, goal: FloatArray, cost: float, time: float) -> None:
        """Watch that the robot comes nearer to the goal."""
        config = self._config
        moved = self._goal is None or math.dist(self._goal, goal) > config.avoid_radius
        if moved or cost < self._least - 0.1:
            self._least, self._nearer = cost, time
        self._goal = goal
        if time - self._nearer > config.patience:
            self.give_up(time)

    def _chosen(self, found: Ways, grid: MapGrid, pose: Pose, time: float) -> tuple[int, int] | None:
        """The best goal, in the part that was searched."""
        self._avoided = [entry for entry in self._avoided if entry[2] > time]
        rows, columns = (
            slice(first, first + size) for first, size in zip(found.corner, found.cost.shape, strict=True)
        )
        goal = self._at_an_edge(found, ~np.isfinite(grid.seen[rows, columns]), grid, pose)
        if goal is None:
            goal = self._long_not_visited(found, time - grid.visited[rows, columns], grid)
        return goal

    def _at_an_edge(
        self, found: Ways, unseen: NDArray[np.bool_], grid: MapGrid, pose: Pose
    ) -> tuple[int, int] | None:
        import cv2  # noqa: PLC0415 - heavy, and only who finds a way needs it

        config = self._config
        touched = cv2.dilate(unseen.astype(np.uint8), np.ones((3, 3), dtype=np.uint8))
        edge = (touched > 0) & ~unseen & np.isfinite(found.cost)
        count, labels, stats, _ = cv2.connectedComponentsWithStats(edge.astype(np.uint8), connectivity=8)
        if count < 2:
            return None
        flat = np.flatnonzero(labels.ravel())
        which = labels.ravel()[flat]
        size = stats[:, cv2.CC_STAT_AREA][which]
        cells = np.column_stack(np.unravel_index(flat, edge.shape))
        centres = grid.centres(cells + found.corner)
        value = found.cost.ravel()[flat] - config.edge_gain * np.minimum(size, config.most_edge)
        rel = pose.to_robot(centres)
        value += config.turn_cost * np.abs(np.arctan2(rel[:, 1], rel[:, 0]))
        if self._goal is not None:
            value -= config.loyalty * (np.hypot(*(centres - self._goal).T) < config.avoid_radius)
        value[(size < config.least_edge) | self._is_avoided(centres)] = np.inf
        best = int(value.argmin())
        return (int(cells[best, 0]), int(cells[best, 1])) if np.isfinite(value[best]) else None

    def _long_not_visited(self, found: Ways, age: FloatArray, grid: MapGrid) -> tuple[int, int] | None:
        config = self._config
        flat = np.flatnonzero(np.isfinite(found.cost) & (found.room >= self._config.room))
        if not flat.size:
            return None
        cells = np.column_stack(np.unravel_index(flat, found.cost.shape))
        centres = grid.centres(cells + found.corner)
        worth = 8.0 * np.minimum(age.ravel()[flat], config.stale) / config.stale - found.cost.ravel()[flat]
        if self._goal is not None:
            worth += config.loyalty * (np.hypot(*(centres - self._goal).T) < config.avoid_radius)
        worth[self._is_avoided(centres) | (found.cost.ravel()[flat] < config.reached)] = -np.inf
        best = int(worth.argmax())
        return (int(cells[best, 0]), int(cells[best, 1])) if np.isfinite(worth[best]) else None

    def _is_avoided(self, centres: FloatArray) -> NDArray[np.bool_]:
        avoided = np.zeros(len(centres), dtype=np.bool_)
        for x, y, _ in self._avoided:
            avoided |= np.hypot(centres[:, 0] - x, centres[:, 1] - y) < self._config.avoid_radius
        return avoided
