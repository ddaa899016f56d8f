"""What an operator can ask for, and the messages that this takes until the robot has answered."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.protocol import ACCEPTED, FORCE, GAITS, IN_PROGRESS, MODES, TASKS, result_name
from bluefoot_mpc.io.station.upload import MissionUpload
from bluefoot_mpc.types import Guide, GuideTask, Mode

_PATIENCE = 0.4
"""s until a command without an answer is sent again."""
_TRIES = 8


class Order(enum.StrEnum):
    """What an operator can ask for with one word."""

    ARM = "arm"
    STOP = "stop"
    EMERGENCY = "emergency"
    STAND = "stand"
    WALK = "walk"
    SIT = "sit"
    OFF = "off"
    HALT = "halt"
    WANDER = "wander"
    APPROACH = "approach"
    FOLLOW = "follow"
    GOTO = "goto"
    CLEAR = "clear"


FINAL = (Order.STOP, Order.EMERGENCY)
"""Orders after which only arming asks for anything again."""
GUIDED = tuple(Order(task) for task in TASKS if task)
"""Orders for which the robot finds its own way."""
BY_MODE = {
    Mode.STAND: Order.STAND,
    Mode.WALK: Order.WALK,
    Mode.SIT: Order.SIT,
    Mode.OFF: Order.OFF,
}
AFTER = {order: mode for mode, order in BY_MODE.items()} | {
    Order.ARM: Mode.STAND,
    Order.STOP: Mode.OFF,
    Order.EMERGENCY: Mode.OFF,
    Order.HALT: Mode.STAND,
    **dict.fromkeys(GUIDED, Mode.STAND),
}
"""Mode that counts as asked for after an order; sticks that say another one ask for that."""
_ARM_DISARM = int(mavlink.MAV_CMD_COMPONENT_ARM_DISARM)
_SET_MODE = int(mavlink.MAV_CMD_DO_SET_MODE)
_PAUSE = int(mavlink.MAV_CMD_DO_PAUSE_CONTINUE)
_TASK = int(mavlink.MAV_CMD_USER_1)
_SPEED = int(mavlink.MAV_CMD_DO_CHANGE_SPEED)
_START = int(mavlink.MAV_CMD_MISSION_START)
_CUSTOM = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
_GROUND_SPEED = float(mavlink.SPEED_TYPE_GROUNDSPEED)
_ORDERS: dict[Order, tuple[int, list[float]]] = {
    Order.ARM: (_ARM_DISARM, [1.0]),
    Order.STOP: (_ARM_DISARM, [0.0]),
    Order.EMERGENCY: (_ARM_DISARM, [0.0, FORCE]),
    Order.HALT: (_PAUSE, [0.0]),
    Order.GOTO: (_START, []),
    **{order: (_SET_MODE, [_CUSTOM, float(MODES.index(mode))]) for mode, order in BY_MODE.items()},
    **{
        Order(task): (_TASK, [float(TASKS.index(task))]) for task in TASKS if task not in ("", GuideTask.GOTO)
    },
}
"""Command and leading parameters of each order; those not named are zero."""


@dataclass(slots=True)
class Pending:
    """An order without a final answer.

    Attributes:
        order: what was asked for.
        stages: COMMAND_LONG messages and uploads, one after the other; the first is under way.
        next_try: s.
        tries: so far, of the first stage.
        result: what came of it; empty while it is open.
    """

    order: Order
    stages: list[Any]
    next_try: float
    tries: int = 0
    result: str = ""

    def due(self, now: float) -> Any:
        """The message that has to leave now, or None."""
        stage = self.stages[0]
        if isinstance(stage, MissionUpload):
            message = stage.due(now)
            self.result = stage.result
            return message
        if now < self.next_try:
            return None
        if self.tries >= _TRIES:
            self.result = "no answer"
            return None
        stage.confirmation = min(self.tries, 255)
        self.tries += 1
        self.next_try = now + _PATIENCE
        return stage

    def wait(self, now: float) -> float:
        """Time (s) until there may be one."""
        stage = self.stages[0]
        return stage.wait(now) if isinstance(stage, MissionUpload) else max(0.0, self.next_try - now)

    def take(self, message: Any, now: float) -> bool:
        """Take an answer of the robot's; True where it belongs to this order."""
        stage = self.stages[0]
        if isinstance(stage, MissionUpload):
            stage.take(message, now)
            if stage.result:
                self._next(stage.result, now)
            return False
        if message.get_type() != "COMMAND_ACK" or message.command != stage.command or not self.tries:
            return False
        if message.result == IN_PROGRESS:
            # It is being done; the answer may take as long as arming does.
            self.next_try, self.tries = math.inf, 1
            return False
        self._next(result_name(message.result), now)
        return True

    def _next(self, result: str, now: float) -> None:
        if result == result_name(ACCEPTED) and len(self.stages) > 1:
            self.stages = self.stages[1:]
            self.next_try, self.tries = now, 0
        else:
            self.result = result


def stages_of(order: Order, gait: str, config: StationConfig, now: float) -> list[Any]:
    """What an order takes.

    Args:
        order: any; a task gets the robot's own speed and distance, and the list that it has.
        gait: to walk with from now on.
        config: addresses.
        now: s.
    """
    if order is Order.CLEAR:
        return [MissionUpload(config, np.zeros((0, 2)), now)]
    number, parameters = _ORDERS[order]
    if number == _SET_MODE:
        parameters = [*parameters, float(GAITS.index(gait))]
    return [_command(config, number, *parameters)]


def stages_of_task(guide: Guide, config: StationConfig, now: float) -> list[Any]:
    """What a task takes: one order, or for waypoints: stand, take the list, take the speed, go."""
    if guide.task is GuideTask.GOTO:
        return [
            _command(config, _PAUSE, 0.0),
            MissionUpload(config, guide.waypoints, now),
            _command(config, _SPEED, _GROUND_SPEED, guide.speed, -1.0),
            _command(config, _START),
        ]
    number = float(TASKS.index(guide.task))
    return [_command(config, _TASK, number, guide.speed, guide.distance)]


def _command(config: StationConfig, number: int, *parameters: float) -> Any:
    values = [*parameters, *([0.0] * (7 - len(parameters)))]
    return mavlink.MAVLink_command_long_message(
        config.robot_system, config.robot_component, number, 0, *values
    )
