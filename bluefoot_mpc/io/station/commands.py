"""What a ground station wants: MANUAL_CONTROL and COMMAND_LONG become a motion command with an age.

Sticks are executed as the median of the last three of each axis (zero for all
counts at once): a frame of noise that passes the 16-bit sum by luck, which one
in 65 536 does, is alone among true ones and moves nothing. Commands whose
unused parameters are not zero, or whose values mean nothing, are refused.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StationConfig, StickScale
from bluefoot_mpc.io.station.protocol import CAN_BE_ASKED, FORCE, GAITS, MODES, Axis
from bluefoot_mpc.types import Mode, MotionCommand, TrunkPose

FULL = 1000
"""Full travel of an axis of MANUAL_CONTROL."""
Sticks = tuple[float, float, float, float, float, float, float]
"""Forward, left, turn left, roll, pitch, yaw, height; each -1..1."""
_CENTRE: Sticks = (0.0,) * 7
_MEDIAN_OF = 3

ACCEPTED = int(mavlink.MAV_RESULT_ACCEPTED)
DENIED = int(mavlink.MAV_RESULT_DENIED)
UNSUPPORTED = int(mavlink.MAV_RESULT_UNSUPPORTED)
IN_PROGRESS = int(mavlink.MAV_RESULT_IN_PROGRESS)
FAILED = int(mavlink.MAV_RESULT_FAILED)


@dataclass(slots=True)
class Wishes:
    """What the operator wants besides motion; the owner of the robot takes note and clears.

    Attributes:
        arm: torque on, after all checks.
        stop: controlled stop, then torque off.
        emergency: torque off at once.
    """

    arm: bool = False
    stop: bool = False
    emergency: bool = False


@dataclass(slots=True)
class CommandInbox:
    """The newest wishes of one ground station.

    Args:
        config: scales and times.
        start: s, from when commands count as missing.
        on_emergency: called at once, with a reason.
    """

    config: StationConfig
    start: float
    on_emergency: Callable[[str], None] | None = None
    wishes: Wishes = field(default_factory=Wishes)
    mode: Mode = Mode.STAND
    gait: str = GAITS[1]
    _sticks: deque[Sticks] = field(default_factory=lambda: deque([_CENTRE] * _MEDIAN_OF, _MEDIAN_OF))
    _last_sticks: float = -math.inf
    _last_heartbeat: float = -math.inf
    _standing: tuple[MotionCommand, float, float] = (MotionCommand(), 0.0, 0.0)

    def __post_init__(self) -> None:
        self._last_sticks = self._last_heartbeat = self.start
        self._settle()

    def heartbeat(self, now: float) -> None:
        """A station is there."""
        self._last_heartbeat = now
        self._settle()

    def manual(self, message: Any, now: float) -> str:
        """Take a MANUAL_CONTROL; gives what a person should know of it, mostly nothing.

        Args:
            message: MANUAL_CONTROL, addressed to this robot.
            now: s.
        """
        sticks = read_sticks(message)
        if sticks is None:
            return ""
        silence = now - self._last_sticks
        self._last_sticks = now
        remark = ""
        if silence > self.config.recall_after:
            self._sticks.extend([_CENTRE] * _MEDIAN_OF)
            if self.mode is Mode.WALK:
                # Whoever comes back must not find the robot walking off.
                self.mode = Mode.STAND
                remark = f"no command for {silence:.1f} s: standing; ask to walk again"
        if any(sticks):
            self._sticks.append(sticks)
        else:
            self._sticks.extend([_CENTRE] * _MEDIAN_OF)
        self._settle()
        return remark

    def command(self, now: float) -> tuple[MotionCommand, float]:
        """The motion wanted and its age (s): that of the sticks, or of a station that fell silent.

        May be called from any thread.
        """
        motion, sticks, heartbeat = self._standing
        return motion, max(0.0, now - sticks, now - heartbeat - self.config.heartbeat_timeout)

    def execute(self, message: Any) -> int | None:
        """Carry out a COMMAND_LONG that is addressed to this robot; gives its MAV_RESULT.

        None: the answer comes later, from whoever owns the robot.
        """
        parameters = [getattr(message, f"param{i}") for i in range(1, 8)]
        for number, action in (
            (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, self._arm_disarm),
            (mavlink.MAV_CMD_DO_SET_MODE, self._set_mode),
            (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, self._pause),
            (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, self._terminate),
        ):
            if message.command == number:
                return action(parameters)
        return UNSUPPORTED

    def _arm_disarm(self, parameters: list[float]) -> int | None:
        arm, force, *unused = parameters
        if any(unused) or arm not in (0.0, 1.0) or force not in (0.0, FORCE):
            return DENIED
        if arm == 1.0:
            if force:
                return DENIED  # no check before torque can be forced away
            self.halt(Mode.STAND)
            self.wishes.arm, self.wishes.stop, self.wishes.emergency = True, False, False
            return None
        if force:
            return self._terminate([1.0])
        self.halt(Mode.OFF)
        self.wishes.arm, self.wishes.stop = False, True
        return ACCEPTED

    def _set_mode(self, parameters: list[float]) -> int:
        _, wanted, gait, *unused = parameters
        if any(unused) or wanted not in range(len(MODES)) or gait not in range(len(GAITS)):
            return DENIED
        mode = MODES[int(wanted)]
        if mode not in CAN_BE_ASKED:
            return DENIED
        if mode is not self.mode:
            self.halt(mode)
        self.gait = GAITS[int(gait)] or self.gait
        self._settle()
        return ACCEPTED

    def _pause(self, parameters: list[float]) -> int:
        go_on, *unused = parameters
        if any(unused) or go_on != 0.0:
            return DENIED
        self.halt(Mode.STAND if self.mode is Mode.WALK else self.mode)
        return ACCEPTED

    def _terminate(self, parameters: list[float]) -> int:
        terminate, *unused = parameters
        if any(unused) or terminate != 1.0:
            return DENIED
        self.halt(Mode.OFF)
        self.wishes.arm, self.wishes.emergency = False, True
        if self.on_emergency is not None:
            self.on_emergency("asked for by the ground station")
        return ACCEPTED

    def halt(self, mode: Mode) -> None:
        """Another mode, and no motion until sticks move again."""
        self.mode = mode
        self._sticks.extend([_CENTRE] * _MEDIAN_OF)
        self._settle()

    def _settle(self) -> None:
        """Put what holds now into one value, which other threads read."""
        scale = self.config.scale
        forward, left, turn, roll, pitch, yaw, height = (
            sorted(values)[_MEDIAN_OF // 2] for values in zip(*self._sticks, strict=True)
        )
        moving = self.mode is Mode.WALK
        motion = MotionCommand(
            mode=self.mode,
            velocity=np.array([forward * scale.forward, left * scale.left]) if moving else np.zeros(2),
            yaw_rate=turn * scale.turn if moving else 0.0,
            gait=self.gait,
            trunk=TrunkPose(
                position=np.array([0.0, 0.0, height * scale.height]),
                rpy=np.array([roll, pitch, yaw]) * scale.tilt,
            ),
        )
        self._standing = (motion, self._last_sticks, self._last_heartbeat)


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
