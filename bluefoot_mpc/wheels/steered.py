"""Steered wheels on their way to new angles, so that the robot can go on moving meanwhile.

Wheels that turn independently (their rows and those of the fixed wheels keep rank 2
or less) go straight to their angles; linked wheels are led by one wheel in their
middle and point across the line to the centre of rotation. Where there are more
steered wheels than that, the motion changes gradually and all follow it.
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.constraints import free_twists, rank_of, sliding_matrix
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.steering import turn_for
from bluefoot_mpc.wheels.wheel import Wheel, sliding_row

_HALVINGS = 12
"""How often a change is halved until no wheel turns too fast."""
_SLACK = 1e-9
"""rad, for angles at the limit."""


class SteeredSet:
    """The steered wheels of a robot.

    Attributes:
        robot: whose they are.
        wheels: indices of all of them.
    """

    def __init__(self, robot: WheeledRobot) -> None:
        self.robot = robot
        self.wheels = robot.indices("steered")
        self._scale = np.array([1.0, 1.0, robot.size])
        self._fixed = sliding_matrix(robot, kinds=("fixed",))
        free = free_twists(self._fixed, robot.size)
        self._permitted = free @ free.T * self._scale**2
        self._linked = [index for group in robot.linked for index in group]
        self._leaders = [_middle(robot, group) for group in robot.linked]
        self._own = [index for index in self.wheels if index not in self._linked]
        self._leaders += [robot.wheels[index] for index in self._own]
        self._independent = len(self._leaders) <= 2 - rank_of(self._fixed, robot.size)
        self._angles = np.zeros(len(self._leaders))
        start = free_twists(sliding_matrix(robot), robot.size)
        self._motion = start[:, 0] if start.shape[1] == 1 else None

    def advance(self, wanted: FloatArray, steering: FloatArray, most: float) -> tuple[FloatArray, FloatArray]:
        """Turn towards what a motion needs, by `most` (rad) at the most; linked wheels by twice that.

        Args:
            wanted: (3,) twist; of zero the wheels stay as they are.
            steering: (n,) rad, now.
            most: rad.

        Returns:
            (n,) rad the new angles, and (3, k) the twists that they permit, as `free_twists` gives
            them: none while wheels are turned standing, because no motion leads to the wanted one.
        """
        permitted = self._permitted @ wanted
        if self._independent:
            return self._lead(permitted, steering, most)
        return self._change(permitted, steering, most)

    def _lead(self, twist: FloatArray, steering: FloatArray, most: float) -> tuple[FloatArray, FloatArray]:
        """Leaders straight to their angles, all in the same time; linked wheels after them."""
        turn = self._targets(twist) - self._angles
        furthest = float(np.abs(turn).max(initial=0.0))
        share = 1.0 if furthest <= most else most / furthest
        for _ in range(_HALVINGS):
            angles = self._angles + share * turn
            placed, free = self._placed(angles, steering, twist)
            if np.abs(placed - steering)[self._linked].max(initial=0.0) <= 2.0 * most:
                self._angles = angles
                return placed, free
            share *= 0.5
        return steering, free_twists(sliding_matrix(self.robot, steering), self.robot.size)

    def _targets(self, twist: FloatArray) -> FloatArray:
        """Angles of the leaders for a permitted twist, inside the limit where one of both ways is."""
        if not twist.any():
            return self._angles
        size = self.robot.size
        pairs = zip(self._leaders, self._angles.tolist(), strict=True)
        return np.array([self._within(turn_for(wheel, twist, now, size), now) for wheel, now in pairs])

    def _within(self, angle: float, now: float) -> float:
        """The way round that lies nearest to the limits, then to `now`; cut at the limits (rad)."""
        limit = self.robot.steering_limit
        ways = (angle, angle - math.pi, angle + math.pi)
        # Rounded, so that two ways equally far outside do not take turns.
        best = min(ways, key=lambda way: (round(max(0.0, abs(way) - limit), 6), abs(way - now)))
        return max(-limit, min(limit, best))

    def _placed(
        self, angles: FloatArray, steering: FloatArray, twist: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Angles of all wheels when the leaders have these, and the twists that they permit."""
        rows = [sliding_row(w, a) for w, a in zip(self._leaders, angles.tolist(), strict=True)]
        free = free_twists(np.vstack([self._fixed, *rows]), self.robot.size)
        placed = steering.copy()
        placed[self._own] = angles[len(angles) - len(self._own) :]
        if self._linked and free.shape[1] > 1:  # linked wheels alone do not decide where the centre lies
            along = free @ (free.T @ (self._scale**2 * twist))
            length = float(np.linalg.norm(self._scale * along))
            free = along[:, None] / length if length > 0.0 else free[:, :0]
        for index in self._linked if free.shape[1] else ():
            near = float(steering[index])
            placed[index] = turn_for(self.robot.wheels[index], free[:, 0], near, self.robot.size)
        return placed, free

    def _change(self, twist: FloatArray, steering: FloatArray, most: float) -> tuple[FloatArray, FloatArray]:
        """The motion some way towards another, and all wheels as it needs them."""
        here = np.zeros((3, 0)) if self._motion is None else self._motion[:, None]
        if not twist.any():
            return steering, here
        aim = twist / np.linalg.norm(self._scale * twist)
        target, reachable = self._followed(aim, steering)
        if self._motion is not None and float(self._scale**2 * self._motion @ aim) < 0.0:
            aim = -aim  # the same wheels, rolling the other way
        share = 1.0
        for _ in range(_HALVINGS):
            motion = aim if self._motion is None else (1.0 - share) * self._motion + share * aim
            placed, within = self._followed(motion, steering)
            if within and np.abs(placed - steering).max() <= most:
                self._motion = motion / np.linalg.norm(self._scale * motion)
                return placed, self._motion[:, None]
            share *= 0.5
        if not reachable:
            return steering, here
        self._motion = None
        return steering + np.clip(target - steering, -most, most), np.zeros((3, 0))

    def _followed(self, twist: FloatArray, steering: FloatArray) -> tuple[FloatArray, bool]:
        """Angles with which all wheels follow a twist, and whether all lie within the limit."""
        placed, within = steering.copy(), True
        for index in self.wheels:
            now = float(steering[index])
            angle = turn_for(self.robot.wheels[index], twist, now, self.robot.size)
            placed[index] = angle if index in self._linked else self._within(angle, now)
            within &= abs(math.remainder(placed[index] - angle, math.pi)) <= _SLACK
        return placed, within


def _middle(robot: WheeledRobot, group: tuple[int, ...]) -> Wheel:
    """The wheel for which a linked group stands: in the middle of its wheels, straight like the first."""
    first = robot.wheels[group[0]]
    x, y = np.mean([robot.wheels[index].position for index in group], axis=0)
    alpha = math.atan2(y, x)
    return Wheel(kind="steered", alpha=alpha, beta=first.alpha + first.beta - alpha, length=math.hypot(x, y))
