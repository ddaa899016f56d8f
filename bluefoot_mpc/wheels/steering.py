"""Directions that wheels must take for a motion."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

_AT_REST = 1e-12
"""Share of the twist's speed under which a contact counts as standing still: any direction will do."""


def steering_for(robot: WheeledRobot, twist: FloatArray, near: FloatArray | None = None) -> FloatArray:
    """(n,) rad, the turn of each wheel with which it follows a motion.

    Args:
        robot: n wheels.
        twist: (3,) m/s, m/s, rad/s in the robot's frame.
        near: (n,) rad, turns to stay close to: a steered wheel may also point the other way and
            roll backwards. None: zeros. A wheel whose contact does not move keeps this turn.

    Returns:
        Turns of steered wheels, trailing angles of castors, 0 for others.
    """
    start = np.zeros(len(robot.wheels)) if near is None else near
    angles = [
        _angle(wheel, twist, angle, robot.size)
        for wheel, angle in zip(robot.wheels, start.tolist(), strict=True)
    ]
    return np.array(angles)


def turn_for(wheel: Wheel, twist: FloatArray, near: float, size: float) -> float:
    """Turn of a steered wheel nearest to `near` with which it does not slide (rad).

    Args:
        wheel: steered.
        twist: (3,) robot's frame.
        near: rad; comes back where the contact stands still.
        size: m, the robot's, to tell what standing still is.
    """
    vx, vy = _velocity(wheel, twist)
    if math.hypot(vx, vy) <= _AT_REST * math.hypot(twist[0], twist[1], size * twist[2]):
        return near
    turn = math.atan2(vx, -vy) - wheel.alpha - wheel.beta
    return near + math.remainder(turn - near, math.pi)


def trailing_angle(wheel: Wheel, twist: FloatArray, near: float) -> float:
    """Turn at which a castor comes to rest while the robot moves with `twist` (3,) (rad).

    Of the two angles at which it does not swing this is the stable one, in which the
    contact trails. `near` comes back where there is none: the pivot turns more than it moves.
    """
    vx, vy = _velocity(wheel, twist)
    speed, swing = math.hypot(vx, vy), wheel.offset * float(twist[2])
    if speed <= abs(swing):
        return near
    # |V| cos(a - direction of V) = -d yaw rate; v . V = |V| sin(a - direction of V) has the sign of -d.
    away = math.copysign(math.acos(-swing / speed), -wheel.offset)
    return wrap_angle(math.atan2(vy, vx) + away - wheel.alpha - wheel.beta)


def _angle(wheel: Wheel, twist: FloatArray, near: float, size: float) -> float:
    if wheel.kind == "steered":
        return turn_for(wheel, twist, near, size)
    if wheel.kind == "castor":
        return trailing_angle(wheel, twist, near)
    return 0.0


def _velocity(wheel: Wheel, twist: FloatArray) -> tuple[float, float]:
    """Velocity of contact or pivot in the robot's frame (m/s)."""
    vx, vy, rate = (float(value) for value in twist)
    x, y = wheel.length * math.cos(wheel.alpha), wheel.length * math.sin(wheel.alpha)
    return vx - rate * y, vy + rate * x
