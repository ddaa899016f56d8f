"""A list of places to go to, one after the other, in the odometry frame."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.navigation.grid import MapGrid
from bluefoot_mpc.navigation.plan import GoalWay, PlanConfig
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class WaypointConfig:
    """When a waypoint counts as reached, and when it is given up."""

    reached: float = 0.08  # m
    every: float = 1.0  # s between searches for the way
    blocked: float = 10.0  # s without a way until a waypoint is given up
    grace: float = 20.0  # s, besides the time that the way should take ...
    slowness: float = 3.0  # ... times this

    def __post_init__(self) -> None:
        require_positive(reached=self.reached, every=self.every, blocked=self.blocked, slowness=self.slowness)
        require_nonnegative(grace=self.grace)


class Waypoints:
    """Keeps the list, where the robot is on it, and the way to the next one.

    Attributes:
        reason: what a person should know of waypoints that were left out.

    Args:
        config: when waypoints count as reached.
        plan: what ways cost.
    """

    def __init__(self, config: WaypointConfig, plan: PlanConfig) -> None:
        self._config = config
        self._way = GoalWay(plan, config.every, config.reached)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.reason = ""
        self._list: FloatArray = np.zeros((0, 2))
        self._next = 0
        self._allowed = math.inf
        self._begin(0.0)

    @property
    def left(self) -> int:
        """Waypoints that are still to be reached."""
        return len(self._list) - self._next

    @property
    def goal(self) -> FloatArray | None:
        """(2,) m in the odometry frame; None where none is left."""
        return self._list[self._next] if self.left else None

    def take(self, waypoints: FloatArray, time: float) -> None:
        """Follow this list; what begins like the list so far is gone on with.

        Args:
            waypoints: (n, 2) m in the odometry frame; what is not in pairs counts as none.
            time: s.
        """
        points = np.asarray(waypoints, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 2:
            points = np.zeros((0, 2))
        if np.array_equal(points, self._list, equal_nan=True):
            return
        done = self._list[: self._next]
        goes_on = len(points) >= len(done) and np.array_equal(points[: len(done)], done, equal_nan=True)
        same = goes_on and self.left and len(points) > self._next and _same(points[self._next], self.goal)
        self._list = points.copy()
        if not goes_on:
            self._next, self.reason = 0, ""
        if not same:
            self._begin(time)

    def step(self, grid: MapGrid, pose: Pose, time: float, speed: float) -> None:
        """Go on to the next waypoint where one is reached or given up, and look for the way to it.

        Args:
            grid: the map.
            pose: of the robot.
            time: s.
            speed: m/s, at which the robot walks.
        """
        config = self._config
        while (goal := self.goal) is not None:
            number = self._next + 1
            if not np.isfinite(goal).all():
                self._go_on(time, f"waypoint {number} is not a number")
            elif math.dist(goal, pose[:2]) <= config.reached:
                self._go_on(time)
            elif time - max(self._way.found, self._since) > config.blocked:
                self._go_on(time, f"waypoint {number} given up: no way to it")
            elif time - self._since > self._allowed:
                self._go_on(time, f"waypoint {number} given up after {time - self._since:.0f} s")
            else:
                break
        if goal is None:
            return
        self._way.step(goal, grid, pose, time)
        if math.isinf(self._allowed) and math.isfinite(self._way.length):
            self._allowed = config.grace + config.slowness * self._way.length / max(speed, 0.02)

    def resume(self, pause: float) -> None:
        """Leave a pause (s) out of the time that the present waypoint has taken."""
        self._since += pause
        self._way.found += pause

    @property
    def way(self) -> FloatArray:
        """(k, 2) m in the odometry frame, to the next waypoint; empty where there is none."""
        return self._way.way

    def _go_on(self, time: float, reason: str = "") -> None:
        if reason:
            self.reason = f"{self.reason}; {reason}" if self.reason else reason
        self._next += 1
        self._begin(time)

    def _begin(self, time: float) -> None:
        self._way.reset()
        self._since = time
        self._allowed = math.inf


def _same(one: FloatArray, other: FloatArray | None) -> bool:
    return other is not None and np.array_equal(one, other, equal_nan=True)
