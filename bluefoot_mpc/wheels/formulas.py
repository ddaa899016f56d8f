"""Closed forms of common robots: what the general solution must give, and quick to use by hand.

Wheel speeds are in rad/s. The second document counts those of its mecanum and
Ackermann pages in turns per second, and so writes 2 pi r where r stands here.
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray

MECANUM_WHEELS: tuple[str, ...] = ("front left", "front right", "back left", "back right")
"""The document's wheels 1 to 4."""

MECANUM_DIRECTIONS: dict[str, tuple[int, int, int, int]] = {
    "forward": (1, 1, 1, 1),
    "backward": (-1, -1, -1, -1),
    "left": (-1, 1, 1, -1),
    "right": (1, -1, -1, 1),
    "clockwise": (1, -1, 1, -1),
    "counter-clockwise": (-1, 1, -1, 1),
}
"""Which way wheels 1 to 4 turn, +1 forward, for each motion."""


def radians_per_second(turns_per_second: float) -> float:
    """Wheel speed in rad/s of one in turns per second."""
    return 2.0 * math.pi * turns_per_second


def differential_twist(
    radius: float, half_track: float, speeds: tuple[float, float], theta: float
) -> FloatArray:
    """(3,) twist in the world of a differential drive.

    Args:
        radius: m.
        half_track: m, L, from the middle to a wheel.
        speeds: rad/s of the left and the right wheel (the document's wheels 2 and 1).
        theta: rad, heading.
    """
    left, right = speeds
    ahead = 0.5 * radius * (right + left)
    return np.array(
        [ahead * math.cos(theta), ahead * math.sin(theta), 0.5 * radius / half_track * (right - left)]
    )


def mecanum_forward(radius: float, track: float, wheelbase: float) -> FloatArray:
    """(3, 4) matrix from the speeds of wheels 1 to 4 (`MECANUM_WHEELS`, rad/s) to the twist."""
    require_positive(radius=radius, track=track, wheelbase=wheelbase)
    turn = 0.5 / (track + wheelbase)
    quarter = 0.25
    return radius * np.array(
        [
            [quarter, quarter, quarter, quarter],
            [-quarter, quarter, quarter, -quarter],
            [-turn, turn, -turn, turn],
        ]
    )


def mecanum_inverse(radius: float, track: float, wheelbase: float) -> FloatArray:
    """(4, 3) matrix from the twist to the speeds of wheels 1 to 4 (`MECANUM_WHEELS`, rad/s)."""
    require_positive(radius=radius, track=track, wheelbase=wheelbase)
    arm = 0.5 * (track + wheelbase)
    return np.array([[1.0, -1.0, -arm], [1.0, 1.0, arm], [1.0, 1.0, -arm], [1.0, -1.0, arm]]) / radius


def front_way(way: float, steering: float) -> tuple[float, float]:
    """Parts of a short way of a steered front wheel along and across the chassis (m), as it begins."""
    return way * math.cos(steering), way * math.sin(steering)


def front_wheel_motion(
    radius: float, wheelbase: float, wheel_speed: float, steering: float
) -> tuple[float, float]:
    """Speed of a steered front wheel along its path (m/s), and the yaw rate of the vehicle (rad/s).

    This is what the document calls Ackermann kinematics: v is the speed of the front wheel, not
    of the rear axle, and the yaw rate is v sin(steering) / wheelbase.
    """
    speed = radius * wheel_speed
    return speed, speed * math.sin(steering) / wheelbase


def rear_axle_motion(
    radius: float, wheelbase: float, wheel_speed: float, steering: float
) -> tuple[float, float]:
    """Speed of the rear axle's middle (m/s) that turns its wheels at `wheel_speed`, and the yaw rate (rad/s).

    The same vehicle seen from the rear: the yaw rate is v tan(steering) / wheelbase.
    """
    speed = radius * wheel_speed
    return speed, speed * math.tan(steering) / wheelbase


def turning_radius(wheelbase: float, steering: float) -> float:
    """Radius of the rear axle's middle about the centre of the turn, left positive (m); or infinite."""
    require_positive(wheelbase=wheelbase)
    return math.inf if steering == 0.0 else wheelbase / math.tan(steering)


def ackermann_angles(wheelbase: float, track: float, steering: float) -> tuple[float, float]:
    """Turns of the left and the right front wheel of a car (rad).

    Args:
        wheelbase: m.
        track: m, between the front wheels' contacts.
        steering: rad, of the one wheel in the middle for which both stand, left positive.

    Raises:
        ConfigurationError: the centre of the turn would lie between the front wheels' tracks, where
            the inner wheel would have to turn by a right angle or more.
    """
    require_positive(wheelbase=wheelbase, track=track)
    if not abs(steering) < math.pi / 2.0:
        raise ConfigurationError(f"steering = {steering} rad must lie between -pi/2 and pi/2")
    slope = math.tan(steering)
    inner = wheelbase - 0.5 * track * abs(slope)
    if inner <= 0.0:
        most = math.degrees(math.atan2(wheelbase, 0.5 * track))
        raise ConfigurationError(
            f"steering = {math.degrees(steering):.1f} degrees puts the centre of the turn inside the track; "
            f"for this wheelbase and track it must stay below {most:.1f} degrees"
        )
    left = math.atan2(wheelbase * slope, wheelbase - 0.5 * track * slope)
    right = math.atan2(wheelbase * slope, wheelbase + 0.5 * track * slope)
    return left, right
