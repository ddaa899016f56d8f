"""Following a route of trunk poses with velocity and yaw rate."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class FollowerConfig:
    """How a route is followed."""

    lookahead: float = 0.12  # m ahead on the route, the place that is steered for
    yaw_gain: float = 0.5  # 1/s, on the error to the route's yaw
    max_yaw_rate: float = 0.10  # rad/s
    max_aside: float = 0.012  # m/s, sideways
    tolerance: float = 0.02  # m from the route's end that counts as there
    smoothing: float = 0.6  # s, with which the place of the robot follows that of its feet

    def __post_init__(self) -> None:
        require_positive(
            lookahead=self.lookahead, max_yaw_rate=self.max_yaw_rate, max_aside=self.max_aside,
            tolerance=self.tolerance, smoothing=self.smoothing,
        )  # fmt: skip
        require_range(0.0, 5.0, yaw_gain=self.yaw_gain)


class Steering(NamedTuple):
    """What the follower wants.

    Attributes:
        velocity: (2,) m/s, forward and left in the heading frame.
        yaw_rate: rad/s, left positive.
        left: m, of the route still to go.
    """

    velocity: FloatArray
    yaw_rate: float
    left: float


def steer(route: FloatArray, place: FloatArray, yaw: float, speed: float, config: FollowerConfig) -> Steering:
    """Towards a point some way ahead on the route, turning to the route's yaw there.

    Args:
        route: (k, 3) x, y (m) and yaw (rad), odometry frame.
        place: (2,) m, the robot's.
        yaw: rad, the robot's heading.
        speed: m/s, at most.
        config: gains and limits.
    """
    away = np.hypot(*(route[:, :2] - place).T)
    along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(route[:, :2], axis=0).T))))
    # The last of equally near points: a route that touches itself is followed forward.
    nearest = len(away) - 1 - int(np.argmin(away[::-1]))
    aim = min(int(np.searchsorted(along, along[nearest] + config.lookahead)), len(route) - 1)
    left = float(along[-1] - along[nearest])
    ahead = route[aim, :2] - place
    distance = float(np.hypot(*ahead))
    if nearest == len(route) - 1 and (distance <= config.tolerance or _is_past(route, place)):
        return Steering(np.zeros(2), 0.0, 0.0)
    c, s = math.cos(yaw), math.sin(yaw)
    way = np.array((c * ahead[0] + s * ahead[1], c * ahead[1] - s * ahead[0])) * (speed / distance)
    aside = abs(float(way[1]))
    if aside > config.max_aside:
        way *= config.max_aside / aside
    turn = config.yaw_gain * wrap_angle(float(route[aim, 2]) - yaw)
    return Steering(way, min(max(turn, -config.max_yaw_rate), config.max_yaw_rate), max(left, distance))


def _is_past(route: FloatArray, place: FloatArray) -> bool:
    """True where a place lies beyond the route's end, seen along its last part; a single pose has none."""
    if len(route) < 2:
        return True
    last = route[-1, :2] - route[-2, :2]
    return bool((place - route[-1, :2]) @ last >= 0.0)


class FeetCentre:
    """Where the robot is over the ground: the middle of its feet, smoothed; the trunk sways over them.

    Args:
        time_constant: s.
    """

    def __init__(self, time_constant: float) -> None:
        self._time_constant = time_constant
        self.reset()

    def reset(self) -> None:
        """Forget where it was."""
        self._place: FloatArray | None = None

    def step(self, feet: FloatArray, dt: float) -> FloatArray:
        """(2,) m, the middle in the odometry frame.

        Args:
            feet: (4, 3) m in the odometry frame.
            dt: s.
        """
        middle = feet[:, :2].mean(axis=0)
        if self._place is None:
            self._place = middle
        else:
            self._place = self._place + min(1.0, dt / self._time_constant) * (middle - self._place)
        return self._place
