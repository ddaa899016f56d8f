"""Position and speed limits of the joints as bounds of their accelerations that stay feasible.

A bound that only looks one tick ahead lets a joint approach its stop so fast that
no allowed acceleration can hold it any more. A position limit is therefore
taken as three bounds: not to pass it within the tick, to be able to stop
before it afterwards with the acceleration that is available (the viable set),
and not to pass the highest speed. Source: A. Del Prete, Joint position and velocity
bounds in discrete-time acceleration/torque control of robot manipulators, IEEE RA-L
2018; the closed forms here are for the upper limit, the lower one is its mirror image.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

_TINY = 1e-9


def acceleration_bounds(position: Any, speed: Any, limits: Any, dt: Any) -> tuple[Any, Any]:
    """Lowest and highest acceleration (rad/s²), each inside ± braking, the lower never above the upper.

    Args:
        position: nj, rad.
        speed: nj, rad/s.
        limits: namespace with ``lower``, ``upper`` (rad), ``speed`` (rad/s) and ``braking`` (rad/s²).
        dt: s over which the acceleration will hold.
    """
    brake = limits.braking
    highest = _highest(limits.upper - position, speed, limits.speed, brake, dt)
    lowest = -_highest(position - limits.lower, -speed, limits.speed, brake, dt)
    highest = ca.fmax(-brake, ca.fmin(brake, highest))
    lowest = ca.fmax(-brake, ca.fmin(brake, lowest))
    # Outside the viable set the two may contradict each other: then brake.
    wrong = lowest > highest
    only = ca.if_else(speed > 0.0, highest, lowest)
    return ca.if_else(wrong, only, lowest), ca.if_else(wrong, only, highest)


def _highest(room: Any, speed: Any, fastest: Any, brake: Any, dt: Any) -> Any:
    """Highest acceleration towards a limit that is `room` away (rad)."""
    return ca.fmin(
        ca.fmin(_within_tick(room, speed, dt), _viable(room, speed, brake, dt)), (fastest - speed) / dt
    )


def _within_tick(room: Any, speed: Any, dt: Any) -> Any:
    """Acceleration that brings the joint just to the limit, at the tick's end or where it stops before."""
    at_end = 2.0 * (room - dt * speed) / (dt * dt)
    halting = -speed / dt
    # Turning round within the tick, the extreme lies where the speed is zero.
    turning = -(speed * speed) / (2.0 * ca.fmax(room, _TINY))
    stops_inside = ca.logic_and(speed > 0.0, at_end <= halting)
    return ca.if_else(stops_inside, ca.fmin(halting, turning), at_end)


def _viable(room: Any, speed: Any, brake: Any, dt: Any) -> Any:
    """Acceleration after which full braking still stops the joint before the limit.

    With the speed ``w = speed + a dt`` at the tick's end, ``w² <= 2 brake (room - dt (speed + w) / 2)``.
    """
    ahead = room - 0.5 * dt * speed
    root = 0.25 * brake * brake * dt * dt + 2.0 * brake * ahead
    fastest = -0.5 * brake * dt + ca.sqrt(ca.fmax(root, 0.0))
    # No speed towards the limit is viable where the root is small: then stop.
    return (ca.fmax(fastest, 0.0) - speed) / dt
