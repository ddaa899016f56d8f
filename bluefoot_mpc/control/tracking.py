"""Closing the loop on speed and heading: the commanded twist, corrected by odometry.

Servo lag and soft contacts make a gait walk a little slower and turn a little
otherwise than its virtual robot. A bounded integral on velocity and a
proportional pull on heading correct the command; both stay small, so that a
wrong estimate can never run away with the gait.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.settings import require_nonnegative
from bluefoot_mpc.types import FloatArray

_REACHED = 1e-3
"""m/s, within which the gait goes at the speed that it was told."""


@dataclass(frozen=True, kw_only=True, slots=True)
class TrackingConfig:
    """Gains and bounds of the corrections."""

    velocity_gain: float = 0.4  # 1/s
    velocity_bound: float = 0.04  # m/s, largest correction
    heading_gain: float = 0.8  # 1/s
    heading_bound: float = 0.15  # rad/s, largest correction
    yaw_integral_gain: float = 0.3  # 1/s², slow part of the heading correction
    wait_for_ramp: bool = False  # integrate only once the gait has reached the speed it was told

    def __post_init__(self) -> None:
        require_nonnegative(
            velocity_gain=self.velocity_gain, velocity_bound=self.velocity_bound,
            heading_gain=self.heading_gain, heading_bound=self.heading_bound,
            yaw_integral_gain=self.yaw_integral_gain,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class TrackingState:
    """Memory of the corrections.

    Attributes:
        velocity: (2,) m/s, integral correction in the heading frame.
        heading: rad, commanded heading in the odometry frame; NaN before the first walk.
        yaw_rate: rad/s, integral part of the heading correction.
        on_its_way: True while the gait has not reached the speed that it was
            told: what it lacks then is no error, and is not integrated.
    """

    velocity: FloatArray = field(default_factory=lambda: np.zeros(2))
    heading: float = float("nan")
    yaw_rate: float = 0.0
    on_its_way: bool = False


@dataclass(frozen=True, kw_only=True, slots=True)
class Twist:
    """Planar command: (2,) m/s forward and left in the heading frame, rad/s left."""

    velocity: FloatArray
    yaw_rate: float


def advance(
    state: TrackingState, wanted: Twist, measured: FloatArray, yaw: float, dt: float, config: TrackingConfig
) -> tuple[TrackingState, Twist]:
    """The new memory and the corrected twist.

    Args:
        state: memory of the corrections.
        wanted: commanded twist.
        measured: (2,) m/s, estimated velocity, forward and left in the heading frame.
        yaw: rad, estimated heading in the odometry frame.
        dt: s.
        config: gains and bounds.
    """
    heading = yaw if math.isnan(state.heading) else wrap_angle(state.heading + wanted.yaw_rate * dt)
    error = wrap_angle(heading - yaw)
    waits = config.wait_for_ramp and state.on_its_way
    gain, bound = 0.0 if waits else config.velocity_gain * dt, config.velocity_bound
    axes = zip(state.velocity.tolist(), wanted.velocity.tolist(), measured.tolist(), strict=True)
    velocity = np.array([min(max(slow + gain * (goal - seen), -bound), bound) for slow, goal, seen in axes])
    limit = config.heading_bound
    slow = min(limit, max(-limit, state.yaw_rate + config.yaw_integral_gain * error * dt))
    turn = min(limit, max(-limit, config.heading_gain * error + slow))
    corrected = Twist(velocity=wanted.velocity + velocity, yaw_rate=wanted.yaw_rate + turn)
    state = TrackingState(
        velocity=velocity, heading=heading, yaw_rate=slow, on_its_way=state.on_its_way
    )  # named one by one: `replace` takes three times as long
    return state, corrected


def followed(state: TrackingState, told: Twist, gait_velocity: FloatArray) -> TrackingState:
    """The memory, knowing how far the gait has come on its ramp.

    Args:
        state: memory of the corrections.
        told: twist that the gait was given.
        gait_velocity: (2,) m/s, the gait's velocity after its ramp.
    """
    (x, y), (told_x, told_y) = gait_velocity.tolist(), told.velocity.tolist()
    on_its_way = max(abs(told_x - x), abs(told_y - y)) > _REACHED
    return state if on_its_way == state.on_its_way else replace(state, on_its_way=on_its_way)


def rest(state: TrackingState) -> TrackingState:
    """Memory while the robot stands: the heading is forgotten, the speed correction kept."""
    return replace(state, heading=float("nan"))
