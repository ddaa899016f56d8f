"""One wheel: where it sits, how it rolls and what it forbids.

The robot's frame has x forward, y left and its origin P anywhere on the chassis.
A wheel touches the floor at distance L from P in direction alpha; beta is the
angle of its axis A from that line, so that

    A = (cos(alpha + beta), sin(alpha + beta)),  v = (sin(alpha + beta), -cos(alpha + beta))

and v is the way the wheel rolls when its speed is positive. A row times the
robot's twist (forward speed, speed to the left, yaw rate) is the speed of the
contact along v (rolling) or along A (sliding).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray

Kind = Literal["fixed", "steered", "castor", "swedish"]

KINDS: tuple[str, ...] = get_args(Kind)

_LEAST_GRIP = 1e-6  # cos(gamma) under which a Swedish wheel's motor has no hold on the floor


@dataclass(frozen=True, kw_only=True, slots=True)
class Wheel:
    """A standard wheel (fixed or steered), a castor or a Swedish wheel.

    A castor's pivot is at (L, alpha) and its contact `offset` along v from there; it
    swings until it trails, which with a positive offset it does rolling backwards.
    """

    kind: Kind
    alpha: float  # rad, direction of the wheel from P, from x to the left
    beta: float = 0.0  # rad, from that direction to the wheel's axis; with steering 0 where it steers
    gamma: float = 0.0  # rad, Swedish: rollers' axis from the wheel's plane; 0 is the 90 degree omni wheel
    length: float = 0.0  # m, L, from P to the contact; castor: to the pivot
    offset: float = 0.0  # m, d, castor: from the pivot to the contact, along v
    radius: float = 0.03  # m
    roller_radius: float = 0.006  # m, Swedish
    driven: bool = True  # whether a motor turns it

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise UnknownNameError("kind of wheel", str(self.kind), KINDS)
        require_finite(alpha=self.alpha, beta=self.beta, gamma=self.gamma, offset=self.offset)
        require_nonnegative(length=self.length)
        require_positive(radius=self.radius, roller_radius=self.roller_radius)
        if self.kind == "castor" and self.offset == 0.0:
            raise ConfigurationError(
                "a castor with offset = 0 does not trail: give its offset, or use 'steered'"
            )
        if self.kind != "castor" and self.offset != 0.0:
            raise ConfigurationError(f"offset = {self.offset} is for castors; a {self.kind} wheel has none")
        if self.kind != "swedish" and self.gamma != 0.0:
            raise ConfigurationError(
                f"gamma = {self.gamma} is for Swedish wheels; a {self.kind} wheel has none"
            )
        if abs(math.cos(self.gamma)) < _LEAST_GRIP:
            raise ConfigurationError(
                f"gamma = {self.gamma} rad: rollers that turn about the wheel's own axis give its motor no "
                "hold on the floor; gamma must be away from ±pi/2 (omni wheels have 0, mecanum wheels ±pi/4)"
            )

    @property
    def turns(self) -> bool:
        """Whether its direction changes: steered wheels and castors."""
        return self.kind in ("steered", "castor")

    @property
    def position(self) -> FloatArray:
        """(2,) m, contact (castor: pivot) in the robot's frame."""
        return np.array([self.length * math.cos(self.alpha), self.length * math.sin(self.alpha)])

    @property
    def drive_radius(self) -> float:
        """Speed along the rolling row per wheel speed, r cos(gamma) (m)."""
        return self.radius * math.cos(self.gamma)


def contact(wheel: Wheel, steering: float = 0.0) -> FloatArray:
    """(2,) m, where the wheel touches the floor, in the robot's frame."""
    return wheel.position + wheel.offset * rolling_direction(wheel, steering)


def axis_direction(wheel: Wheel, steering: float = 0.0) -> FloatArray:
    """(2,) unit vector A along the wheel's axis, robot's frame."""
    angle = wheel.alpha + wheel.beta + steering
    return np.array([math.cos(angle), math.sin(angle)])


def rolling_direction(wheel: Wheel, steering: float = 0.0) -> FloatArray:
    """(2,) unit vector v in which the wheel rolls when its speed is positive, robot's frame."""
    angle = wheel.alpha + wheel.beta + steering
    return np.array([math.sin(angle), -math.cos(angle)])


def rolling_row(wheel: Wheel, steering: float = 0.0) -> FloatArray:
    """(3,) row whose product with the twist is r cos(gamma) times the wheel's speed: it does not slip.

    Args:
        wheel: any kind.
        steering: rad, turn of a steered wheel or castor to the left, on top of its beta.

    Returns:
        (sin(a), -cos(a), -L cos(b)) with a = alpha + beta + gamma and b = beta + gamma; 1, 1, m.
    """
    angle = wheel.beta + steering + wheel.gamma
    whole = wheel.alpha + angle
    return np.array([math.sin(whole), -math.cos(whole), -wheel.length * math.cos(angle)])


def sliding_row(wheel: Wheel, steering: float = 0.0) -> FloatArray:
    """(3,) row across the rolling one: sideways speed of the contact.

    Times the twist it is 0 for a fixed or steered wheel, which is a constraint; for a
    castor -d times its steering rate, and for a Swedish wheel the rollers' speed less
    the wheel's share (`roller_speed`), which are none: castor and rollers give way.

    Returns:
        (cos(a), sin(a), d + L sin(b)) with a and b as in `rolling_row`; 1, 1, m.
    """
    angle = wheel.beta + steering + wheel.gamma
    whole = wheel.alpha + angle
    return np.array([math.cos(whole), math.sin(whole), wheel.offset + wheel.length * math.sin(angle)])


def wheel_speed(wheel: Wheel, twist: FloatArray, steering: float = 0.0) -> float:
    """Speed at which the wheel turns when the robot moves with `twist` (3,) (rad/s)."""
    return float(rolling_row(wheel, steering) @ twist) / wheel.drive_radius


def castor_rate(wheel: Wheel, twist: FloatArray, steering: float) -> float:
    """Rate at which a castor swings when the robot moves with `twist` (3,) (rad/s, left positive).

    Raises:
        ConfigurationError: the wheel is no castor.
    """
    if wheel.kind != "castor":
        raise ConfigurationError(f"a {wheel.kind} wheel does not swing by itself: only a castor has a rate")
    return -float(sliding_row(wheel, steering) @ twist) / wheel.offset


def roller_speed(wheel: Wheel, twist: FloatArray) -> float:
    """Speed of the roller that touches the floor, of a Swedish wheel (rad/s).

    Across the rollers' axis the contact moves with -r sin(gamma) times the wheel's
    speed and with the rollers. (The second document prints the first term with
    a plus; then rollers would spin while a mecanum platform drives straight ahead.)

    Raises:
        ConfigurationError: the wheel is not Swedish.
    """
    if wheel.kind != "swedish":
        raise ConfigurationError(f"a {wheel.kind} wheel has no rollers: only a Swedish wheel has")
    own = -wheel.radius * math.sin(wheel.gamma) * wheel_speed(wheel, twist)
    return (float(sliding_row(wheel) @ twist) - own) / wheel.roller_radius
