"""How freely wheels let a robot move: degrees, instantaneous centre of rotation, holonomy."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bluefoot_mpc.model.linear import subspaces
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.constraints import free_twists, rank_of, scaled, sliding_matrix
from bluefoot_mpc.wheels.robot import WheeledRobot, checked
from bluefoot_mpc.wheels.wheel import axis_direction, sliding_row

_STRAIGHT = 1e-9
"""Yaw rate times size, as a share of the twist, under which the centre counts as infinitely far."""

IcrKind = Literal["point", "infinity", "line", "plane", "none"]


@dataclass(frozen=True, slots=True, eq=False)
class Icr:
    """Where the instantaneous centre of rotation can lie.

    Attributes:
        kind: ``point``: there alone; ``infinity``: the robot can only go straight; ``line``: anywhere on
            one line; ``plane``: anywhere at all; ``none``: no motion has one, the robot stands still.
        point: (2,) m in the robot's frame, for ``point``, and some point of a ``line``; else NaN.
        direction: (2,) unit vector: for ``infinity`` towards the centre (across the motion), for
            ``line`` along it; else NaN.
    """

    kind: IcrKind
    point: FloatArray
    direction: FloatArray


def delta_m(robot: WheeledRobot, steering: FloatArray | None = None) -> int:
    """Degree of mobility 3 - rank(C1): motions open at once, without steering; 0: it cannot move.

    Args:
        robot: any.
        steering: (n,) rad, turn of each wheel that turns; None: all straight.
    """
    return 3 - rank_of(sliding_matrix(robot, steering), robot.size)


def delta_s(robot: WheeledRobot, steering: FloatArray | None = None) -> int:
    """Degree of steerability rank(C1s), with linked wheels counted as one (the first of each group)."""
    angles = robot.checked_steering(steering)
    followers = {index for group in robot.linked for index in group[1:]}
    leaders = [index for index in robot.indices("steered") if index not in followers]
    rows = np.array([sliding_row(robot.wheels[i], float(angles[i])) for i in leaders])
    return rank_of(rows.reshape(-1, 3), robot.size)


def delta_M(robot: WheeledRobot, steering: FloatArray | None = None) -> int:
    """Degree of manoeuvrability, mobility and steerability together: what the motors can decide."""
    return delta_m(robot, steering) + delta_s(robot, steering)


def workspace_dof(robot: WheeledRobot) -> int:
    """Dimension of the set of poses that the robot can reach, 0 to 3.

    With all ways to steer, the robot can follow every twist that its fixed wheels permit;
    what it reaches by following one after the other is spanned by these and their Lie
    brackets. Three for all but robots that cannot leave one circle or line.
    """
    basis = free_twists(sliding_matrix(robot, kinds=("fixed",)), robot.size).T
    while True:
        brackets = [_bracket(a, b) for a in basis for b in basis]
        spanned = np.vstack([basis, *brackets]) if len(basis) else basis
        # Twists scale the other way round than rows.
        span = subspaces(scaled(spanned, 1.0 / robot.size)) if len(spanned) else None
        if span is None or span.rank == len(basis):
            return len(basis)
        basis = scaled(span.row.T, robot.size)


def holonomic(robot: WheeledRobot, steering: FloatArray | None = None) -> bool:
    """Whether no constraint is left but on positions: mobility equals the dimension of the workspace.

    A robot that cannot leave one circle, as a bicycle with fixed wheels, is holonomic too.
    """
    return delta_m(robot, steering) == workspace_dof(robot)


def omnidirectional(robot: WheeledRobot, steering: FloatArray | None = None) -> bool:
    """Whether the robot is holonomic with three degrees of mobility: any motion, from where it stands."""
    return holonomic(robot, steering) and delta_m(robot, steering) == 3


def icr(robot: WheeledRobot, steering: FloatArray | None = None) -> Icr:
    """Instantaneous centre of rotation: where the zero-motion lines of all wheels that may not slide meet.

    Args:
        robot: any.
        steering: (n,) rad, turn of each wheel that turns; None: all straight.
    """
    free = free_twists(sliding_matrix(robot, steering), robot.size)
    if free.shape[1] == 3:
        return _icr("plane")
    if free.shape[1] == 2:
        return _line_of(free, robot.size)
    if free.shape[1] == 1:
        return icr_of(free[:, 0], robot.size)
    return _icr("none")


def icr_of(twist: FloatArray, size: float = 1.0) -> Icr:
    """Instantaneous centre of rotation of a motion.

    Args:
        twist: (3,) m/s, m/s, rad/s, robot's frame.
        size: m, the robot's; turns small against it count as none.

    Raises:
        ConfigurationError: a number is not finite, or there are not three.
    """
    vx, vy, rate = checked(twist, 3, "twist", "m/s, m/s, rad/s").tolist()
    speed = math.hypot(vx, vy)
    if speed == 0.0 and rate == 0.0:
        return _icr("none")
    if abs(rate) * size <= _STRAIGHT * speed:
        left = math.copysign(1.0, rate)
        return _icr("infinity", direction=np.array([-left * vy, left * vx]) / speed)
    return _icr("point", point=np.array([-vy / rate, vx / rate]))


def zero_motion_lines(
    robot: WheeledRobot, steering: FloatArray | None = None
) -> list[tuple[FloatArray, FloatArray]]:
    """Point (2,) m and direction (2,) of each line that the centre must lie on, robot's frame.

    One per fixed or steered wheel, in the order of the wheels: through its contact, along its axis.
    """
    angles = robot.checked_steering(steering).tolist()
    return [
        (robot.wheels[i].position, axis_direction(robot.wheels[i], angles[i]))
        for i in robot.indices("fixed", "steered")
    ]


def _bracket(a: FloatArray, b: FloatArray) -> FloatArray:
    """Lie bracket of two twists of the plane."""
    return np.array([b[2] * a[1] - a[2] * b[1], a[2] * b[0] - b[2] * a[0], 0.0])


def _line_of(free: FloatArray, size: float) -> Icr:
    """The centres of all twists of a plane of twists."""
    rates = free[2] * size
    turning = free @ rates / float(np.linalg.norm(rates))
    straight = free @ np.array([-rates[1], rates[0]])
    point = np.array([-turning[1], turning[0]]) / turning[2]
    across = np.array([-straight[1], straight[0]])
    return _icr("line", point=point, direction=across / float(np.linalg.norm(across)))


def _icr(kind: IcrKind, point: FloatArray | None = None, direction: FloatArray | None = None) -> Icr:
    nowhere = np.full(2, np.nan)
    return Icr(kind, nowhere if point is None else point, nowhere if direction is None else direction)
