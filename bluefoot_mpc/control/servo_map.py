"""From planned motion and torque to goal positions: what makes a position servo do both.

An AX-12A turns a position error into a duty cycle. A goal that runs ahead of
the wanted angle by the planned torque over the servo's stiffness, and by what
back-EMF takes at the planned speed, makes the joint follow without droop or lag.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import goal_for_torque
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class ServoMapConfig:
    """How much of the planned torque and speed goes into the goals."""

    mixing: float = 0.0  # share of the planned torque, 0..1; 0 switches the feed-forward off
    back_emf: float = 0.0  # share of the torque that back-EMF takes at the planned speed, 0..1
    max_shift: float = 0.25  # rad, furthest that a goal runs ahead of its angle
    derate_from: float = 55.0  # °C, above it the feed-forward torque fades
    derate_to: float = 65.0  # °C, nothing is left

    def __post_init__(self) -> None:
        require_range(0.0, 1.0, mixing=self.mixing, back_emf=self.back_emf)
        require_positive(max_shift=self.max_shift)
        require_nonnegative(derate_from=self.derate_from)
        if not self.derate_from < self.derate_to:
            raise ConfigurationError(
                f"derate_from = {self.derate_from:g} must be below derate_to = {self.derate_to:g} (°C)"
            )


def derating(temperature: FloatArray, config: ServoMapConfig) -> FloatArray:
    """(16,) share of their torque that servos may still be asked for, 1 when cool; NaN counts as cool."""
    left = (config.derate_to - temperature) / (config.derate_to - config.derate_from)
    return np.where(np.isfinite(left), np.minimum(np.maximum(left, 0.0), 1.0), 1.0)


def least_derating(temperature: FloatArray, config: ServoMapConfig) -> float:
    """The smallest of `derating`; mostly all servos are cool, which one look tells."""
    if float(temperature.max()) <= config.derate_from:
        return 1.0
    return float(derating(temperature, config).min())


@dataclass(frozen=True, kw_only=True, slots=True)
class Feed:
    """What is fed forward.

    Attributes:
        torque: (16,) N·m at the output shafts.
        speed: (16,) rad/s, whose back-EMF is made up for.
    """

    torque: FloatArray
    speed: FloatArray


def goals(
    servo: ServoParameters, joints: FloatArray, feed: Feed, voltage: float, config: ServoMapConfig
) -> FloatArray:
    """(16,) rad, goal positions at which servos make the fed torque at `joints`.

    Args:
        servo: parameters.
        joints: (16,) rad, planned angles.
        feed: torque and speed.
        voltage: V at the servos; their stiffness is in proportion to it.
        config: bounds.
    """
    wanted = goal_for_torque(servo, joints, feed.torque, feed.speed) - joints
    shift = wanted * (servo.nominal_voltage / voltage)
    return joints + np.minimum(np.maximum(shift, -config.max_shift), config.max_shift)
