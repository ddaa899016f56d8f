"""What a ground station wants: MANUAL_CONTROL and COMMAND_LONG become a motion command with an age.

Sticks are executed as the median of the last three of each axis (zero for all
counts at once): a frame of noise that passes the 16-bit sum by luck, which one
in 65 536 does, is alone among true ones and moves nothing. Commands whose
unused parameters are not zero, or whose values mean nothing, are refused.

A task for which the robot finds its own way (see `tasks`) holds like a mode.
Whatever a person does by hand ends it: sticks moved, another mode, a stop.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station import tasks
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.protocol import (
    ACCEPTED,
    CAN_BE_ASKED,
    DENIED,
    FORCE,
    GAITS,
    MODES,
    UNSUPPORTED,
)
from bluefoot_mpc.io.station.sticks import Sticks, read_sticks
from bluefoot_mpc.io.station.tasks import TaskBoard
from bluefoot_mpc.types import FloatArray, Mode, MotionCommand, Telemetry, TrunkPose

_CENTRE: Sticks = (0.0,) * 7
_MEDIAN_OF = 3
_STUTTER = 0.25
"""s; after a longer silence the robot may have let go of its task, and begins it anew."""


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

    Attributes:
        wishes: besides motion.
        mode: asked for.
        gait: asked for.
        tasks: waypoints, and what the robot is to find its own way for.
    """

    config: StationConfig
    start: float
    on_emergency: Callable[[str], None] | None = None
    wishes: Wishes = field(default_factory=Wishes)
    mode: Mode = Mode.STAND
    gait: str = GAITS[1]
    tasks: TaskBoard = field(default_factory=TaskBoard)
    _sticks: deque[Sticks] = field(default_factory=lambda: deque([_CENTRE] * _MEDIAN_OF, _MEDIAN_OF))
    _last_sticks: float = -math.inf
    _last_heartbeat: float = -math.inf
    _standing: tuple[MotionCommand, float, float] = (MotionCommand(), 0.0, 0.0)

    def __post_init__(self) -> None:
        self._last_sticks = self._last_heartbeat = self.start
        self._settle()

    def heartbeat(self, now: float) -> str:
        """A station is there; gives what a person should know of it, mostly nothing."""
        silence = now - self._last_heartbeat - self.config.heartbeat_timeout
        self._last_heartbeat = now
        remark = self._return_after(silence)
        self._settle()
        return remark

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
        remark = self._return_after(silence)
        if any(sticks):
            self._sticks.append(sticks)
        else:
            self._sticks.extend([_CENTRE] * _MEDIAN_OF)
        if any(abs(share) > self.config.hand for share in self._held()[:3]) and self.tasks.pause():
            remark = "moved by hand: the robot does not find its own way any more"
        self._settle()
        return remark

    def _return_after(self, silence: float) -> str:
        """Words are back after the robot had to do without for so long (s); gives what to tell of it."""
        if silence > self.config.recall_after:
            self._sticks.extend([_CENTRE] * _MEDIAN_OF)
            if self.mode is Mode.WALK:
                # Whoever comes back must not find the robot walking off.
                self.tasks.pause()
                self.mode = Mode.STAND
                return f"no command for {silence:.1f} s: standing; ask to walk again"
        elif silence > _STUTTER:
            self.tasks.shorten()
        return ""

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
        self.tasks.refusal = ""
        parameters = [getattr(message, f"param{i}") for i in range(1, 8)]
        for number, action in (
            (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, self._arm_disarm),
            (mavlink.MAV_CMD_DO_SET_MODE, self._set_mode),
            (mavlink.MAV_CMD_DO_PAUSE_CONTINUE, self._pause),
            (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, self._terminate),
        ):
            if message.command == number:
                return action(parameters)
        return self._lead(message.command, parameters) if message.command in tasks.ORDERS else UNSUPPORTED

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
        if mode is not self.mode or self.tasks.guide is not None:
            self.halt(mode)
        self.gait = GAITS[int(gait)] or self.gait
        self._settle()
        return ACCEPTED

    def _pause(self, parameters: list[float]) -> int:
        go_on, *unused = parameters
        if any(unused) or go_on not in (0.0, 1.0):
            return DENIED
        if go_on:
            return self._lead(int(mavlink.MAV_CMD_DO_PAUSE_CONTINUE), parameters)
        self.halt(Mode.STAND if self.mode is Mode.WALK else self.mode)
        return ACCEPTED

    def _lead(self, number: int, parameters: list[float]) -> int:
        """An order about tasks; the robot walks as soon as it has one."""
        if self.wishes.stop or self.wishes.emergency:
            return DENIED
        before, board = self.tasks.guide, self.tasks
        result = board.execute(number, parameters) if number in tasks.ORDERS else board.resume()
        if board.guide is not None and before is None:
            self.mode = Mode.WALK
            self._sticks.extend([_CENTRE] * _MEDIAN_OF)
        self._settle()
        return result

    def load(self, points: FloatArray) -> None:
        """Another list of waypoints, (n, 2) m; a robot on its way to the old ones stands."""
        before = self.tasks.guide
        self.tasks.load(points)
        if before is not None and self.tasks.guide is None:
            self.mode = Mode.STAND
        self._settle()

    def progress(self, telemetry: Telemetry) -> list[int]:
        """Numbers of the waypoints that the robot has reached since; at the last one it stands."""
        before = self.tasks.guide
        reached = self.tasks.progress(telemetry)
        if before is not None and self.tasks.guide is None:
            self.halt(Mode.STAND)
        return reached

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
        self.tasks.pause()
        self.mode = mode
        self._sticks.extend([_CENTRE] * _MEDIAN_OF)
        self._settle()

    def _held(self) -> Sticks:
        """Where the sticks are: the median of the last three of each."""
        forward, left, turn, roll, pitch, yaw, height = (
            sorted(values)[_MEDIAN_OF // 2] for values in zip(*self._sticks, strict=True)
        )
        return forward, left, turn, roll, pitch, yaw, height

    def _settle(self) -> None:
        """Put what holds now into one value, which other threads read."""
        scale = self.config.scale
        forward, left, turn, roll, pitch, yaw, height = self._held()
        guide = self.tasks.guide if self.mode is Mode.WALK else None
        moving = self.mode is Mode.WALK and guide is None
        motion = MotionCommand(
            mode=self.mode,
            velocity=np.array([forward * scale.forward, left * scale.left]) if moving else np.zeros(2),
            yaw_rate=turn * scale.turn if moving else 0.0,
            gait=self.gait,
            trunk=TrunkPose(
                position=np.array([0.0, 0.0, height * scale.height]),
                rpy=np.array([roll, pitch, yaw]) * scale.tilt,
            ),
            guide=guide,
        )
        self._standing = (motion, self._last_sticks, self._last_heartbeat)
