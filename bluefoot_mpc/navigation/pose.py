"""Where the robot is on the floor, and points between its frame and the odometry's."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.types import BodyState, FloatArray


class Pose(NamedTuple):
    """The trunk's origin and heading in the odometry frame: m, m, rad."""

    x: float
    y: float
    yaw: float

    def to_odometry(self, points: FloatArray) -> FloatArray:
        """(n, 2) m in the odometry frame of (n, 2) points in the robot frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.asarray(points @ np.array(((cos, sin), (-sin, cos))) + (self.x, self.y))

    def to_robot(self, points: FloatArray) -> FloatArray:
        """(n, 2) m in the robot frame of (n, 2) points in the odometry frame."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return np.asarray((points - (self.x, self.y)) @ np.array(((cos, -sin), (sin, cos))))


def pose_of(estimate: BodyState) -> Pose:
    """The estimated pose on the floor."""
    x, y, _ = estimate.position.tolist()
    return Pose(x, y, float(estimate.rpy[2]))


class PoseHistory:
    """Where the robot was a moment ago: a sweep is older than the frame that brings it.

    Args:
        length: ticks that are kept.
    """

    def __init__(self, length: int = 16) -> None:
        self._states: deque[BodyState] = deque(maxlen=length)

    def reset(self) -> None:
        """Forget everything."""
        self._states.clear()

    def add(self, estimate: BodyState) -> None:
        """Keep the newest estimate."""
        self._states.append(estimate)

    def at(self, time: float) -> BodyState:
        """The kept estimate nearest to a time (s)."""
        best = self._states[-1]
        for state in reversed(self._states):
            if abs(state.time - time) > abs(best.time - time):
                break
            best = state
        return best
