"""What gait and stability allow: speeds, and how fast they may change."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from bluefoot_mpc.settings import require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class LimitConfig:
    """Limits of what navigation asks for; the gait's own ramps come behind them."""

    forward: float = 0.20  # m/s
    backward: float = 0.08  # m/s
    sideways: float = 0.06  # m/s
    yaw_rate: float = 0.5  # rad/s
    edge_speed: float = 0.30  # m/s that a foot at the corner may be asked for: speed and turn together
    lever: float = 0.23  # m from the trunk's middle to such a foot
    acceleration: float = 0.3  # m/s²
    yaw_acceleration: float = 1.5  # rad/s²

    def __post_init__(self) -> None:
        require_positive(
            forward=self.forward, backward=self.backward, sideways=self.sideways, yaw_rate=self.yaw_rate,
            edge_speed=self.edge_speed, lever=self.lever, acceleration=self.acceleration,
            yaw_acceleration=self.yaw_acceleration,
        )  # fmt: skip


class Motion(NamedTuple):
    """A planar motion: m/s forward and left in the heading frame, rad/s left."""

    x: float = 0.0
    y: float = 0.0
    yaw_rate: float = 0.0


def allowed(motion: Motion, speed: float, config: LimitConfig) -> Motion:
    """The motion within the limits; what is too fast in sum is scaled as a whole.

    Args:
        motion: wanted.
        speed: m/s, that the task allows.
        config: what the gait allows.
    """
    x = min(max(motion.x, -config.backward, -speed), config.forward, speed)
    y = min(max(motion.y, -config.sideways), config.sideways)
    turn = min(max(motion.yaw_rate, -config.yaw_rate), config.yaw_rate)
    edge = math.hypot(x, y) + config.lever * abs(turn)
    share = min(1.0, config.edge_speed / edge) if edge > 0.0 else 1.0
    return Motion(share * x, share * y, share * turn)


def slowed(motion: Motion, speed: float) -> Motion:
    """The same arc, no faster forward than `speed` (m/s)."""
    share = speed / motion.x if motion.x > speed else 1.0
    return Motion(share * motion.x, share * motion.y, share * motion.yaw_rate)


def ramped(now: Motion, wanted: Motion, dt: float, config: LimitConfig) -> Motion:
    """`now`, moved towards `wanted` at limited rates during `dt` seconds; towards rest it may jump."""
    step, turn = config.acceleration * dt, config.yaw_acceleration * dt
    return Motion(
        _towards(now.x, wanted.x, step),
        _towards(now.y, wanted.y, step),
        _towards(now.yaw_rate, wanted.yaw_rate, turn),
    )


def _towards(now: float, wanted: float, step: float) -> float:
    """A step from `now` to `wanted`; what slows down does so at once, the gait's ramp smooths it."""
    if now * wanted >= 0.0 and abs(wanted) <= abs(now):
        return wanted
    start = now if now * wanted >= 0.0 else 0.0
    return min(max(wanted, start - step), start + step)
