"""The trunk's way over a height map, from where it stands towards a goal: as far as known ground allows."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.terrain.graph import optimal, reachable
from bluefoot_mpc.terrain.lattice import Goal, Path, Start
from bluefoot_mpc.terrain.plan_config import PlanConfig
from bluefoot_mpc.terrain.planning_grid import PlanningGrid, planning_grid
from bluefoot_mpc.terrain.smoothing import poses, smooth
from bluefoot_mpc.terrain.windows import search
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap

__all__ = ["PlanConfig", "Route", "plan_route"]


@dataclass(frozen=True, kw_only=True, slots=True)
class Route:
    """The way planned for the trunk.

    Attributes:
        poses: (k, 3) x, y (m) and yaw (rad), odometry frame, the start first; empty where it is not feasible.
        cost: of its cells; infinite where it is not feasible.
        planner: who planned it.
        feasible: True where there is a way to walk.
        reason: why there is none, or why it ends short of the goal or beside it; empty where it does not.
        reaches_goal: True where it ends at the goal, or beside it on its column.
    """

    poses: FloatArray
    cost: float
    planner: str
    feasible: bool
    reason: str = ""
    reaches_goal: bool = False


def plan_route(
    ground: HeightMap,
    start: tuple[float, float, float],
    goal: tuple[float, float],
    config: PlanConfig,
    quality: FloatArray | None = None,
) -> Route:
    """The way from where the robot stands towards a goal.

    All four feet find a tread on known ground everywhere on it (or on the even ground of the start). It
    leads to the goal's column, as near to the goal as can be; where known, passable ground ends before, as
    far as it goes.

    Args:
        ground: the map.
        start: x, y (m) and yaw (rad) of the trunk, odometry frame.
        goal: x, y (m), odometry frame.
        config: limits and weights.
        quality: (n, m) 0..1, how well a foot stands on the map's cells; None where that was not rated.

    Returns:
        The way, or why there is none.
    """
    if not np.isfinite((*start, *goal)).all():
        return _none(config, "start or goal is no number: estimate and goal must be finite")
    if math.dist(start[:2], goal) < 0.5 * config.cell:
        standing = np.array([start], dtype=np.float64)
        return Route(poses=standing, cost=0.0, planner=config.planner, feasible=True, reason="at the goal",
                     reaches_goal=True)  # fmt: skip
    if ground.height.size == 0:
        return _none(config, "the map is empty: sweep first")
    return _planned_route(planning_grid(ground, start, goal, config, quality), start, config)


def _planned_route(grid: PlanningGrid, start: tuple[float, float, float], config: PlanConfig) -> Route:
    blind = grid.unknown_feet(grid.start)
    if blind:
        return _none(config, f"the ground under {', '.join(blind)} at the start is unknown: sweep again")
    ahead = reachable(grid.cost[:, : grid.last_j + 1], grid.start)
    columns = np.flatnonzero(ahead.any(axis=(0, 2)))
    last = int(columns[-1]) if columns.size else grid.start[1]
    if last < grid.goal_j and (last - grid.start[1]) * grid.map.cell < config.least_advance:
        return _none(config, f"no way ahead: {grid.what_ends(grid.start)}")
    aim = _aim(np.asarray(ahead[:, last].any(axis=1)), grid, last)
    path = _planned(grid.cost, grid.start, aim, config)
    if not path.reached:
        return _none(config, path.reason)
    return _route(path, grid, last, start, config)


def _aim(free: BoolArray, grid: PlanningGrid, last: int) -> Goal:
    """Where a way should end: anywhere in a column short of the goal's, else as near the goal as can be."""
    if last < grid.goal_j:
        return Goal(last)
    places = np.flatnonzero(free)
    return Goal(last, int(places[np.argmin(np.abs(places - grid.start[0]))]))


def _planned(cost: FloatArray, start: Start, goal: Goal, config: PlanConfig) -> Path:
    if config.planner == "window":
        return search(cost, start, goal, config.window)
    return optimal(cost, start, goal)


def _route(
    path: Path, grid: PlanningGrid, last: int, start: tuple[float, float, float], config: PlanConfig
) -> Route:
    places = smooth(path, grid.cost, config.smoothing, grid.start_turn)
    way = poses(places, grid.map, config.cost.yaws)
    # Yaw without a jump of a turn, and exactly where the robot stands.
    way[:, 2] += start[2] - way[0, 2]
    way[0] = start
    reason = ""
    reaches = last == grid.goal_j
    end = path.cells[-1]
    if not reaches:
        left = (grid.goal_j - last) * grid.map.cell
        reason = f"ends {left:.2f} m before the goal: {grid.what_ends((int(end[0]), last, int(end[2])))}"
    elif (aside := abs(int(end[0]) - grid.start[0]) * grid.map.cell) > config.goal_width:
        reason = f"ends {aside:.2f} m beside the goal, which cannot be stood on"
    return Route(poses=way, cost=path.cost, planner=config.planner, feasible=True, reason=reason,
                 reaches_goal=reaches)  # fmt: skip


def _none(config: PlanConfig, reason: str) -> Route:
    return Route(poses=np.zeros((0, 3)), cost=math.inf, planner=config.planner, feasible=False, reason=reason)
