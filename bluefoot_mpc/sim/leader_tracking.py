"""How a leader keeps to its way: pure pursuit where it must steer, or sideways where it can."""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.sim.leader_path import Point, Way

Manner = Literal["steering", "swinging", "turning"]
"""How a leader holds its heading: along its way by steering, swinging about the way's direction, or
turning round and round whatever the way does."""

_AHEAD = 0.20
"""m ahead of itself on the way that a steering leader drives to."""
_TIGHTEST = 2.5
"""1/m, greatest curvature that it steers; every kind of leader can turn like this."""
_PULL = 1.0
"""1/s, how fast a leader that can move sideways comes back to its way, and turns to its heading."""
_SWING = math.radians(35.0)
_SWING_LENGTH = 3.0
"""m of way for one swing there and back."""
_TURN = 0.6
"""rad per m of way: at 0.10 m/s a full turn takes 105 s."""
_GREATEST_STEP = 0.02
"""m along the way that one look at where the leader is may bring."""


class Twist(NamedTuple):
    """Velocity in the leader's frame.

    Attributes:
        forward: m/s.
        left: m/s.
        turn: rad/s, left positive.
    """

    forward: float
    left: float
    turn: float


class Tracker:
    """Where on its way a leader is, and how it should move to stay on it.

    Attributes:
        distance: m along the way, of the place nearest to the leader.

    Args:
        way: to follow.
        manner: how it holds its heading.
    """

    def __init__(self, way: Way, manner: Manner) -> None:
        self._way, self._manner = way, manner
        self.distance = 0.0

    def reset(self) -> None:
        """Be at the beginning again."""
        self.distance = 0.0

    @property
    def course(self) -> float:
        """Direction of the way where the leader is, rad in the way's frame."""
        return self._way.at(self.distance).heading

    @property
    def left_to_go(self) -> float:
        """What is left of the way, m; infinite on one that goes round and round."""
        return math.inf if self._way.closed else self._way.length - self.distance

    def find(self, x: float, y: float) -> float:
        """Move on to the place nearest to a point; returns how far left of it the point is, m.

        Args:
            x: m, in the way's frame.
            y: m, in the way's frame.
        """
        near = self._way.at(self.distance)
        cosine, sine = math.cos(near.heading), math.sin(near.heading)
        dx, dy = x - near.x, y - near.y
        left = dy * cosine - dx * sine
        # One Newton step: on a bend the nearest place moves by less or more than the leader.
        step = (dx * cosine + dy * sine) / max(1.0 - near.curvature * left, 0.2)
        self.distance += max(-_GREATEST_STEP, min(_GREATEST_STEP, step))
        return left

    def twist(self, x: float, y: float, yaw: float, speed: float) -> Twist:
        """The wanted motion.

        Args:
            x: m, in the way's frame.
            y: m, in the way's frame.
            yaw: rad, in the way's frame, left positive.
            speed: m/s, along the way.
        """
        left = self.find(x, y)
        if self._manner == "steering":
            return self._pursue(x, y, yaw, speed)
        return self._glide(self._way.at(self.distance), left, yaw, speed)

    def _pursue(self, x: float, y: float, yaw: float, speed: float) -> Twist:
        """Drive the arc through a point ahead on the way (pure pursuit)."""
        goal = self._way.at(self.distance + _AHEAD)
        dx, dy = goal.x - x, goal.y - y
        cosine, sine = math.cos(yaw), math.sin(yaw)
        ahead, left = dx * cosine + dy * sine, dy * cosine - dx * sine
        curvature = 2.0 * left / max(dx * dx + dy * dy, 1e-4)
        if ahead < 0.0:
            curvature = math.copysign(_TIGHTEST, left)  # somebody turned it round
        return Twist(speed, 0.0, speed * max(-_TIGHTEST, min(_TIGHTEST, curvature)))

    def _glide(self, near: Point, left: float, yaw: float, speed: float) -> Twist:
        """Move along the way whatever the heading is, and hold the heading of the manner."""
        if self._manner == "turning":
            heading, rate = _TURN * self.distance, _TURN
        else:
            phase = 2.0 * math.pi * self.distance / _SWING_LENGTH
            heading = near.heading + _SWING * math.sin(phase)
            rate = near.curvature + _SWING * math.cos(phase) * 2.0 * math.pi / _SWING_LENGTH
        # Standing still it neither comes back nor turns.
        moves = min(1.0, abs(speed) / 0.02)
        aside = -_PULL * left * moves
        turn = speed * rate + _PULL * moves * wrap_angle(heading - yaw)
        angle = near.heading - yaw
        cosine, sine = math.cos(angle), math.sin(angle)
        return Twist(speed * cosine - aside * sine, speed * sine + aside * cosine, turn)
