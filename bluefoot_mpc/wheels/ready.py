"""Ready robots: the second document's, and a few relatives, small enough to lead BlueFoot.

With all steering at zero a positive wheel speed drives every one of them straight
ahead (a three-wheel omni robot turns instead: it has no front). Lengths in m.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Kind, Wheel


def forward_wheel(
    kind: Kind, x: float, y: float, *, gamma: float = 0.0, radius: float = 0.03, driven: bool = True
) -> Wheel:
    """A wheel at (x, y) m in the robot's frame that rolls forward along x when its speed is positive."""
    alpha = math.atan2(y, x)
    return Wheel(
        kind=kind, alpha=alpha, beta=math.pi / 2.0 - alpha, gamma=gamma, length=math.hypot(x, y),
        radius=radius, driven=driven,
    )  # fmt: skip


def castor(x: float, y: float, *, offset: float = -0.02, radius: float = 0.015) -> Wheel:
    """A castor with its pivot at (x, y) m that trails, rolling forward, when the robot drives ahead."""
    alpha = math.atan2(y, x)
    return Wheel(
        kind="castor", alpha=alpha, beta=math.pi / 2.0 - alpha, length=math.hypot(x, y),
        offset=offset, radius=radius, driven=False,
    )  # fmt: skip


def differential(half_track: float = 0.08, radius: float = 0.035) -> WheeledRobot:
    """Two driven wheels on one axle, left and right of P."""
    require_positive(half_track=half_track)
    return WheeledRobot(
        name="differential",
        wheels=(
            Wheel(kind="fixed", alpha=math.pi / 2.0, beta=0.0, length=half_track, radius=radius),
            Wheel(kind="fixed", alpha=-math.pi / 2.0, beta=math.pi, length=half_track, radius=radius),
        ),
    )


def balancing(half_track: float = 0.09, radius: float = 0.04) -> WheeledRobot:
    """The wheels of a differential drive, alone: it must balance (`bluefoot_mpc.wheels.balance`)."""
    pair = differential(half_track, radius)
    return WheeledRobot(name="balancing", wheels=pair.wheels)


def tricycle(wheelbase: float = 0.16, track: float = 0.14, radius: float = 0.03) -> WheeledRobot:
    """Two free rear wheels on one axle, P between them, and a driven, steered front wheel."""
    require_positive(wheelbase=wheelbase, track=track)
    return WheeledRobot(
        name="tricycle",
        wheels=(
            forward_wheel("fixed", 0.0, 0.5 * track, radius=radius, driven=False),
            forward_wheel("fixed", 0.0, -0.5 * track, radius=radius, driven=False),
            forward_wheel("steered", wheelbase, 0.0, radius=radius),
        ),
    )


def ackermann(
    wheelbase: float = 0.18, track: float = 0.14, radius: float = 0.03, steering_limit: float = 0.65
) -> WheeledRobot:
    """A car: two driven rear wheels, P between them, and two linked steered front wheels."""
    require_positive(wheelbase=wheelbase, track=track)
    return WheeledRobot(
        name="ackermann",
        wheels=(
            forward_wheel("fixed", 0.0, 0.5 * track, radius=radius),
            forward_wheel("fixed", 0.0, -0.5 * track, radius=radius),
            forward_wheel("steered", wheelbase, 0.5 * track, radius=radius, driven=False),
            forward_wheel("steered", wheelbase, -0.5 * track, radius=radius, driven=False),
        ),
        linked=((2, 3),),
        steering_limit=steering_limit,
    )


def bicycle(wheelbase: float = 0.18, radius: float = 0.05, steering_limit: float = 1.2) -> WheeledRobot:
    """A driven rear wheel at P and a steered front wheel; it is not said to balance."""
    require_positive(wheelbase=wheelbase)
    return WheeledRobot(
        name="bicycle",
        wheels=(
            forward_wheel("fixed", 0.0, 0.0, radius=radius),
            forward_wheel("steered", wheelbase, 0.0, radius=radius, driven=False),
        ),
        steering_limit=steering_limit,
    )


def omni(length: float = 0.09, radius: float = 0.03) -> WheeledRobot:
    """Three Swedish wheels of 90 degrees (rollers' axis in the wheel's plane) at pi/3, pi and -pi/3."""
    require_positive(length=length)
    wheels = tuple(
        Wheel(kind="swedish", alpha=alpha, length=length, radius=radius)
        for alpha in (math.pi / 3.0, math.pi, -math.pi / 3.0)
    )
    return WheeledRobot(name="omni", wheels=wheels)


def mecanum(track: float = 0.16, wheelbase: float = 0.16, radius: float = 0.03) -> WheeledRobot:
    """Four Swedish wheels of 45 degrees: front left, front right, back left, back right.

    `track` is the document's L1, left to right, and `wheelbase` its L2, front to rear.
    """
    require_positive(track=track, wheelbase=wheelbase)
    x, y, turn = 0.5 * wheelbase, 0.5 * track, math.pi / 4.0
    corners = ((x, y, -turn), (x, -y, turn), (-x, y, turn), (-x, -y, -turn))
    return WheeledRobot(
        name="mecanum",
        wheels=tuple(forward_wheel("swedish", a, b, gamma=gamma, radius=radius) for a, b, gamma in corners),
    )


def omni_steer(length: float = 0.09, radius: float = 0.03) -> WheeledRobot:
    """A steered wheel in front and two omni wheels behind, left and right; all driven."""
    require_positive(length=length)
    x, y = -0.5 * length, 0.5 * math.sqrt(3.0) * length
    return WheeledRobot(
        name="omni_steer",
        wheels=(
            forward_wheel("steered", length, 0.0, radius=radius),
            forward_wheel("swedish", x, y, radius=radius),
            forward_wheel("swedish", x, -y, radius=radius),
        ),
        steering_limit=math.pi,
    )


def two_steer(length: float = 0.09, radius: float = 0.03) -> WheeledRobot:
    """Two driven, steered wheels, front and rear, and two castors left and right."""
    require_positive(length=length)
    return WheeledRobot(
        name="two_steer",
        wheels=(
            forward_wheel("steered", length, 0.0, radius=radius),
            forward_wheel("steered", -length, 0.0, radius=radius),
            castor(0.0, 0.8 * length),
            castor(0.0, -0.8 * length),
        ),
        steering_limit=math.pi,
    )


READY: dict[str, Callable[[], WheeledRobot]] = {
    "differential": differential,
    "tricycle": tricycle,
    "ackermann": ackermann,
    "bicycle": bicycle,
    "omni": omni,
    "mecanum": mecanum,
    "omni_steer": omni_steer,
    "two_steer": two_steer,
    "balancing": balancing,
}
