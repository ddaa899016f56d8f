"""Sticks as MANUAL_CONTROL says them: shares of full travel."""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StickScale
from bluefoot_mpc.io.station.protocol import Axis
from bluefoot_mpc.types import MotionCommand

FULL = 1000
"""Full travel of an axis of MANUAL_CONTROL."""
Sticks = tuple[float, float, float, float, float, float, float]
"""Forward, left, turn left, roll, pitch, yaw, height; each -1..1."""


def read_sticks(message: Any) -> Sticks | None:
    """The axes of a MANUAL_CONTROL; None where one lies outside of what an axis can have.

    x is forward; y is to the right and r counter-clockwise positive (MAVLink);
    z (thrust) means nothing to a robot on legs. s is pitch, nose up positive,
    t is roll, right side down positive; aux1 is the trunk's height, aux2 its
    heading, left positive.
    """
    used = Axis(message.enabled_extensions & sum(Axis))
    roll = message.t if Axis.ROLL in used else 0
    pitch = -message.s if Axis.PITCH in used else 0
    height = message.aux1 if Axis.HEIGHT in used else 0
    yaw = message.aux2 if Axis.YAW in used else 0
    values = (message.x, -message.y, message.r, roll, pitch, yaw, height)
    if any(abs(value) > FULL for value in values):
        return None
    forward, left, turn, roll, pitch, yaw, height = (value / FULL + 0.0 for value in values)
    return forward, left, turn, roll, pitch, yaw, height


def write_sticks(command: MotionCommand, scale: StickScale, robot_system: int) -> Any:
    """MANUAL_CONTROL of a motion command; what is beyond full travel is cut off."""
    forward, left = command.velocity.tolist()
    roll, pitch, yaw = command.trunk.rpy.tolist()
    height = float(command.trunk.position[2])
    axes = Axis(0)
    for axis, value in ((Axis.PITCH, pitch), (Axis.ROLL, roll), (Axis.HEIGHT, height), (Axis.YAW, yaw)):
        axes |= axis if value else Axis(0)
    return mavlink.MAVLink_manual_control_message(
        robot_system,
        _travel(forward, scale.forward),
        -_travel(left, scale.left),
        0,
        _travel(command.yaw_rate, scale.turn),
        0,
        0,
        int(axes),
        -_travel(pitch, scale.tilt),
        _travel(roll, scale.tilt),
        _travel(height, scale.height),
        _travel(yaw, scale.tilt),
    )


def _travel(value: float, full: float) -> int:
    return max(-FULL, min(FULL, round(FULL * value / full))) if math.isfinite(value) else 0
