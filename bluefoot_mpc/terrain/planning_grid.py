"""The grid on which a trunk's way is planned: laid from the start to the goal over a height map."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.terrain.cost import feet, tensor, yaw_index, yaw_of
from bluefoot_mpc.terrain.frame import cells_of, centres
from bluefoot_mpc.terrain.lattice import Start
from bluefoot_mpc.terrain.plan_config import PlanConfig
from bluefoot_mpc.terrain.treads import Treads, highest_within, treads
from bluefoot_mpc.types import LEGS, BoolArray, FloatArray, HeightMap


@dataclass(frozen=True, slots=True)
class PlanningGrid:
    """A planning grid and its cost tensor; its j axis runs from the start to the goal.

    Attributes:
        map: the heights of the treads near its cells; NaN where there are none.
        known: (n, m) True where the ground is known within a foot's reach.
        cost: (n, m, l) cost tensor; finite at the start.
        start: cell of the start, which stands at its centre.
        start_turn: broken yaw index of the start.
        goal_j: column of the goal, off the grid where it is beyond the horizon.
        last_j: last column to plan for: the goal's, or that at the horizon.
        spacing: m between neighbouring feet.
    """

    map: HeightMap
    known: BoolArray
    cost: FloatArray
    start: Start
    start_turn: float
    goal_j: int
    last_j: int
    spacing: float

    def unknown_feet(self, cell: Start) -> list[str]:
        """Legs whose foot would be out of reach of known ground at a cell."""
        i, j = self._foot_cells(cell)
        n, m = self.known.shape
        inside = (i >= 0) & (i < n) & (j >= 0) & (j < m)
        seen = inside & self.known[np.where(inside, i, 0), np.where(inside, j, 0)]
        return [leg for leg, sees in zip(LEGS, seen.tolist(), strict=True) if not sees]

    def what_ends(self, cell: Start) -> str:
        """What is in the way one column ahead of a cell."""
        if cell[1] >= self.last_j:
            return "further is not planned at once"
        blind = self.unknown_feet((cell[0], cell[1] + 1, cell[2]))
        if blind:
            return f"the ground under {', '.join(blind)} ahead of that is unknown"
        return "the ground ahead of that is too steep or too high to step on, or hardly known"

    def _foot_cells(self, cell: Start) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        yaw = yaw_of(cell[2], self.cost.shape[2])
        offsets = np.rint(feet(self.spacing, yaw) / self.map.cell).astype(np.intp)
        return cell[0] + offsets[:, 1], cell[1] + offsets[:, 0]


def planning_grid(
    ground: HeightMap,
    start: tuple[float, float, float],
    goal: tuple[float, float],
    config: PlanConfig,
    quality: FloatArray | None = None,
) -> PlanningGrid:
    """Lay a grid from a start to a goal.

    Its cells are as large as configured, or a little smaller, so that start and goal stand at centres.

    Args:
        ground: the map.
        start: x, y (m) and yaw (rad), odometry frame.
        goal: x, y (m), odometry frame; not at the start.
        config: sizes and limits.
        quality: (n, m) 0..1, how well a foot stands on the map's cells; None where that was not rated.
    """
    away, far = math.atan2(goal[1] - start[1], goal[0] - start[0]), math.dist(start[:2], goal)
    steps = max(math.ceil(far / config.cell - 1e-9), 1)
    frame, cell, last_j = _frame(ground, (start[0], start[1], away), far / steps, steps, config)
    near = treads(ground.height, ground.cell, config.treads, quality)
    found, under = _sampled(ground, near, frame, config)
    turn = wrap_angle(start[2] - away)
    weights = replace(config.cost, yaw_range=max(config.cost.yaw_range, _reach_of(turn, config.cost.yaws)))
    cost = tensor(found.height, found.slope, frame.cell, weights)
    aside = (np.arange(frame.height.shape[0]) - cell[0]) * frame.cell
    cost += config.k_side * (aside**2)[:, None, None]
    cost[np.abs(aside) > config.side + 1e-9] = np.inf
    cost[_blocked(found.height, under, frame.cell, config)] = np.inf
    u = yaw_index(turn, config.cost.yaws)
    first = (cell[0], cell[1], u)
    if not np.isfinite(cost[first]):
        # The robot stands here already, however bad the place is.
        cost[first] = config.k_side
    turned = (turn + math.pi) * config.cost.yaws / (2.0 * math.pi)
    turned -= config.cost.yaws * round((turned - u) / config.cost.yaws)
    return PlanningGrid(
        replace(frame, height=found.height), found.known, cost, first,
        turned, cell[1] + steps, last_j, config.cost.spacing,
    )  # fmt: skip


def _reach_of(turn: float, yaws: int) -> float:
    """rad, the yaw range that holds the yaw at the start."""
    return min(abs(turn) + 2.0 * math.pi / yaws, math.pi)


def _frame(
    ground: HeightMap, start: tuple[float, float, float], cell: float, steps: int, config: PlanConfig
) -> tuple[HeightMap, tuple[int, int], int]:
    """An empty map along start's yaw, the start's cell (i, j) in it and the last column to plan for."""
    x, y, yaw = start
    behind = math.ceil(config.cost.spacing / cell)
    side = math.ceil((config.side + config.cost.spacing) / cell)
    ahead = min(steps, math.floor(config.horizon / cell))
    i, j = side, behind
    c, s = math.cos(yaw), math.sin(yaw)
    left, back = (i + 0.5) * cell, (j + 0.5) * cell
    pose = np.array((x - c * back + s * left, y - s * back - c * left, ground.pose[2], yaw))
    height = np.full((2 * side + 1, 2 * behind + ahead + 1), np.nan)
    frame = HeightMap(
        time=ground.time, cell=cell, pose=pose, height=height, confidence=np.zeros(height.shape)
    )
    return frame, (i, j), behind + ahead


def _sampled(
    ground: HeightMap, near: Treads, frame: HeightMap, config: PlanConfig
) -> tuple[Treads, FloatArray]:
    """Treads at the cells of the planning grid, and the highest ground around; even where that is assumed."""
    at = centres(frame)
    i, j = cells_of(ground, at)
    inside = i >= 0
    known_height = np.where(np.isfinite(ground.height), ground.height, np.nan)
    peaks = highest_within(known_height, ground.cell, config.under_radius)
    height = np.where(inside, near.height[i, j], np.nan)
    slope = np.where(inside, near.slope[i, j], np.nan)
    known = inside & near.known[i, j]
    under = np.where(inside, peaks[i, j], np.nan)
    even = ~known & (np.hypot(at[..., 0], at[..., 1]) <= config.even_radius)
    height[even], slope[even] = -ground.pose[2], 0.0
    return Treads(height, slope, known | even), under


def _blocked(height: FloatArray, under: FloatArray, cell: float, config: PlanConfig) -> BoolArray:
    """(n, m) True where the trunk would be over ground that stands too high above its feet."""
    offsets = np.rint(feet(config.cost.spacing, np.zeros(())) / cell).astype(np.intp)
    margin = int(np.abs(offsets).max())
    wide = np.pad(height, margin, constant_values=np.nan)
    n, m = height.shape
    views = [wide[margin + y : margin + y + n, margin + x : margin + x + m] for x, y in offsets.tolist()]
    with np.errstate(invalid="ignore"):
        return np.asarray(under - sum(views) / 4.0 > config.max_under)
