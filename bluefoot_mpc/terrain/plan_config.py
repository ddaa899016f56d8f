"""Limits and weights of the trunk's way over rough ground."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.cost import CostConfig
from bluefoot_mpc.terrain.smoothing import SmoothingConfig
from bluefoot_mpc.terrain.treads import TreadConfig

PLANNERS = ("optimal", "window")


@dataclass(frozen=True, kw_only=True, slots=True)
class PlanConfig:
    """What a way is planned on, and by whom."""

    planner: str = "optimal"  # or window: the thesis' greedy search
    window: int = 15  # cells, of the greedy search
    cell: float = 0.04  # m, side of a cell of the planning grid, at most
    side: float = 0.40  # m from the straight line to the goal that the trunk's centre may leave it
    horizon: float = 3.0  # m ahead that a way is planned at once
    even_radius: float = 0.45  # m around the odometry's origin: unknown ground there counts as even
    k_side: float = 0.2  # 1/m^2, cost of the squared distance from the straight line
    max_under: float = 0.06  # m that ground below the trunk may stand above its feet
    under_radius: float = 0.11  # m around the trunk's centre that count as below it
    least_advance: float = 0.06  # m; a way that leads less far ahead is none
    goal_width: float = 0.10  # m beside the goal that count as at it
    cost: CostConfig = field(default_factory=lambda: CostConfig(spacing=0.316, yaw_range=math.radians(40.0)))
    treads: TreadConfig = field(default_factory=TreadConfig)
    smoothing: SmoothingConfig = field(default_factory=SmoothingConfig)

    def __post_init__(self) -> None:
        if self.planner not in PLANNERS:
            raise UnknownNameError("planner", self.planner, PLANNERS)
        require_range(1, 200, window=self.window)
        require_positive(max_under=self.max_under)
        require_nonnegative(
            even_radius=self.even_radius, k_side=self.k_side, goal_width=self.goal_width,
            least_advance=self.least_advance,
        )  # fmt: skip
        require_range(0.01, 0.5, cell=self.cell)
        require_range(self.cell, 10.0, horizon=self.horizon)
        require_range(0.0, 2.0, side=self.side)
        require_range(0.0, 0.5, under_radius=self.under_radius)
