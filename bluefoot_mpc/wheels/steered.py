"""Steered wheels on their way to new angles, so that the robot can go on moving meanwhile.

At most as many wheels lead as can turn independently (their rows and those of the
fixed wheels keep rank 2 or less); linked wheels are led by one wheel in their
middle. All others follow: they point across the line to the centre of rotation.
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
"""How often a step is halved until no following wheel turns too fast; then the robot stops to steer."""


class SteeredSet:
    """The steered wheels of a robot.

    Attributes:
        robot: whose they are.
        wheels: indices of all of them.
    """

    def __init__(self, robot: WheeledRobot) -> None:
        self.robot = robot
        self.wheels = robot.indices("steered")
        self._fixed = sliding_matrix(robot, kinds=("fixed",))
        free = free_twists(self._fixed, robot.size) * np.array([[1.0], [1.0], [robot.size]])
        scale = np.array([1.0, 1.0, robot.size])
        self._permitted = (free @ free.T) * scale / scale[:, None]
        self._leaders, self._own = self._choose()
        self._angles = np.zeros(len(self._leaders))
        self._followers = [i for i in self.wheels if i not in self._own]

    def advance(self, wanted: FloatArray, steering: FloatArray, most: float) -> tuple[FloatArray, FloatArray]:
        """Turn towards what a motion needs, by `most` (rad) at the most.

        Args:
            wanted: (3,) twist; of zero the wheels stay as they are.
            steering: (n,) rad, now.
            most: rad.

        Returns:
            (n,) rad the new angles, and (3, k) the twists that they permit, as `free_twists` gives
            them: none while following wheels are turned to where they must be, standing.
        """
        target = self._targets(self._permitted @ wanted)
        turn = target - self._angles
        furthest = float(np.abs(turn).max(initial=0.0))
        share = 1.0 if furthest <= most else most / furthest
        for _ in range(_HALVINGS):
            angles = self._angles + share * turn
            placed, free = self._placed(angles, wanted, steering)
            if np.abs(placed - steering)[self._followers].max(initial=0.0) <= 2.0 * most:
                self._angles = angles
                return placed, free
            share *= 0.5
        placed, _ = self._placed(self._angles + min(1.0, most / (furthest or 1.0)) * turn, wanted, steering)
        return self._standing(placed, steering, most)

    def _choose(self) -> tuple[list[Wheel], list[int]]:
        """Wheels that lead, and their indices among the robot's, -1 for the middle of a linked group."""
        linked = {index for group in self.robot.linked for index in group}
        candidates = [(_middle(self.robot, group), -1) for group in self.robot.linked]
        candidates += [(self.robot.wheels[i], i) for i in self.wheels if i not in linked]
        spare = 2 - rank_of(self._fixed, self.robot.size)
        kept = candidates[: max(spare, 0)]
        return [wheel for wheel, _ in kept], [index for _, index in kept]

    def _targets(self, twist: FloatArray) -> FloatArray:
        """Angles of the leaders for a permitted twist, inside the limit where one of both ways is."""
        limit = self.robot.steering_limit
        targets = []
        for wheel, now in zip(self._leaders, self._angles.tolist(), strict=True):
            angle = turn_for(wheel, twist, now, self.robot.size) if twist.any() else now
            ways = (angle, angle - math.pi, angle + math.pi)
            # Rounded, so that two ways equally far outside do not take turns.
            best = min(ways, key=lambda way: (round(max(0.0, abs(way) - limit), 6), abs(way - now)))
            targets.append(max(-limit, min(limit, best)))
        return np.array(targets)

    def _placed(
        self, angles: FloatArray, wanted: FloatArray, steering: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Angles of all wheels when the leaders have these, and the twists that they permit."""
        rows = [sliding_row(w, a) for w, a in zip(self._leaders, angles.tolist(), strict=True)]
        free = free_twists(np.vstack([self._fixed, *rows]), self.robot.size)
        placed = steering.copy()
        for index, angle in zip(self._own, angles.tolist(), strict=True):
            if index >= 0:
                placed[index] = angle
        if self._followers:
            scale = np.array([1.0, 1.0, self.robot.size])
            along = free @ (free.T @ (scale * scale * wanted)) if free.shape[1] > 1 else free[:, 0]
            for index in self._followers:
                near = float(steering[index])
                placed[index] = turn_for(self.robot.wheels[index], along, near, self.robot.size)
            free = free if free.shape[1] == 1 else along[:, None] / (np.linalg.norm(scale * along) or 1.0)
        return placed, free

    def _standing(
        self, target: FloatArray, steering: FloatArray, most: float
    ) -> tuple[FloatArray, FloatArray]:
        """Followers turned towards their place while the leaders and the robot stand."""
        placed = steering.copy()
        for index in self._followers:
            turn = float(target[index] - steering[index])
            placed[index] += max(-most, min(most, turn))
        return placed, np.zeros((3, 0))


def _middle(robot: WheeledRobot, group: tuple[int, ...]) -> Wheel:
    """The wheel for which a linked group stands: in the middle of its wheels, straight like the first."""
    first = robot.wheels[group[0]]
    x, y = np.mean([robot.wheels[index].position for index in group], axis=0)
    alpha = math.atan2(y, x)
    return Wheel(kind="steered", alpha=alpha, beta=first.alpha + first.beta - alpha, length=math.hypot(x, y))
