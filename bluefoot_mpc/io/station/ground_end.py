"""The station's end of the link as a pure machine: bytes and times in, bytes out; no thread, no port."""

from __future__ import annotations

import enum
import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.commands import IN_PROGRESS, write_sticks
from bluefoot_mpc.io.station.config import BITS_PER_BYTE, StationConfig
from bluefoot_mpc.io.station.framing import FrameReader
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.io.station.protocol import FORCE, GAITS, MODES, result_name
from bluefoot_mpc.io.station.schedule import Schedule, Stream, TokenBucket
from bluefoot_mpc.io.station.sequence import SequenceGuard
from bluefoot_mpc.io.station.signing import Signer
from bluefoot_mpc.io.station.writer import FrameWriter
from bluefoot_mpc.types import Mode, MotionCommand

STREAMS = (
    Stream(name="heartbeat", rate=1.0, urgent=True),
    Stream(name="sticks", rate=25.0),
)
"""What goes up to the robot."""
_PATIENCE = 0.4
"""s until a command without an answer is sent again."""
_TRIES = 8
_GCS_MODE = 0


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


@dataclass(slots=True)
class Pending:
    """An order without a final answer.

    Attributes:
        order: what was asked for.
        message: COMMAND_LONG.
        next_try: s.
        tries: so far.
        result: what came of it; empty while it is open.
    """

    order: Order
    message: Any
    next_try: float
    tries: int = 0
    result: str = ""


class GroundEnd:
    """Commands up, telemetry down.

    Args:
        config: addresses, rates and times.
        now: s, start.
        signer: checks and signs; None: frames are not signed.

    Attributes:
        picture: what is known of the robot.
        reader: finds frames.
        refused: frames with a right sum and no valid signature.
        motion: what the sticks say; sent 25 times a second.
        watch: told of every message: direction (``"in"``, ``"out"``), message, time (s).
        orders: the newest orders and what came of them.
    """

    def __init__(self, config: StationConfig, now: float, signer: Signer | None = None) -> None:
        self._config, self._signer = config, signer
        self.picture = RobotPicture()
        self.reader = FrameReader()
        self.refused = 0
        self.motion = MotionCommand()
        self.orders: deque[Pending] = deque(maxlen=20)
        rate = config.up_share * config.line_rate / BITS_PER_BYTE
        bucket = TokenBucket(rate, config.burst)
        self.writer = FrameWriter(config.station_system, config.station_component, bucket, signer)
        self.guard = SequenceGuard(config.sequence_window, config.sequence_timeout)
        self.watch: Callable[[str, Any, float], None] | None = None
        self._schedule = Schedule(STREAMS, now)
        self._asked = (Mode.STAND, GAITS[1])
        self._ended = False
        self._steered = now

    def steer(self, motion: MotionCommand, now: float) -> None:
        """What the sticks say from now on; another mode or gait than before is asked for.

        After a stop nothing but arming asks for a mode again.
        """
        self.motion, self._steered = motion, now
        wanted = (motion.mode, motion.gait)
        if wanted != self._asked and not self._ended and motion.mode in _BY_MODE:
            self.ask(_BY_MODE[motion.mode], now)

    def ask(self, order: Order, now: float) -> None:
        """Give an order; it is repeated until the robot answers."""
        # The last word counts: what has no answer yet is given up, a stop only for arming.
        for pending in self.orders:
            if not pending.result and (order in _FINAL or order is Order.ARM or pending.order not in _FINAL):
                pending.result = "replaced"
        self._ended = order in _FINAL or (self._ended and order is not Order.ARM)
        mode = _AFTER.get(order, self._asked[0])
        self._asked = (mode, self.motion.gait)
        self.orders.append(Pending(order=order, message=self._command(order), next_try=now))

    def receive(self, data: bytes, now: float) -> int:
        """Take bytes from the line; gives the number of messages that were the robot's own."""
        count = 0
        for received in self.reader.feed(data):
            if received.system != self._config.robot_system:
                continue
            if self._signer is not None and not self._signer.accepts(received):
                self.refused += 1
                continue
            if not self.guard.accepts(received.sequence, now):
                continue
            count += 1
            if self.watch is not None:
                self.watch("in", received.message, now)
            self.picture.take(received.message, now)
            if received.message.get_type() == "COMMAND_ACK":
                self._answered(received.message)
        return count

    def produce(self, now: float) -> bytes | None:
        """The next frame; None while nothing is due or the line has no room."""
        if not self.writer.may_send(now):
            return None
        message = self._order_due(now)
        if message is None:
            name = self._schedule.next(now)
            if name is None:
                return None
            self._schedule.done(name, now)
            message = _heartbeat() if name == "heartbeat" else self._sticks(now)
        if self.watch is not None:
            self.watch("out", message, now)
        return self.writer.frame(message)

    def wait(self, now: float) -> float:
        """Time (s) until `produce` may have something."""
        due = min((p.next_try for p in self.orders if not p.result), default=math.inf)
        return max(min(self._schedule.wait(now), max(0.0, due - now)), self.writer.wait(now))

    def _sticks(self, now: float) -> Any:
        motion = self.motion
        if now - self._steered > self._config.steer_timeout:
            # Whoever holds the sticks has hung: heartbeats go on, motion does not.
            motion = replace(motion, velocity=np.zeros(2), yaw_rate=0.0)
        return write_sticks(motion, self._config.scale, self._config.robot_system)

    def _order_due(self, now: float) -> Any:
        for pending in self.orders:
            if pending.result or now < pending.next_try:
                continue
            if pending.tries >= _TRIES:
                pending.result = "no answer"
                continue
            pending.message.confirmation = min(pending.tries, 255)
            pending.tries += 1
            pending.next_try = now + _PATIENCE
            return pending.message
        return None

    def _answered(self, ack: Any) -> None:
        for pending in self.orders:
            if pending.result or pending.message.command != ack.command or not pending.tries:
                continue
            if ack.result == IN_PROGRESS:
                # It is being done; the answer may take as long as arming does.
                pending.next_try, pending.tries = math.inf, 1
            else:
                pending.result = result_name(ack.result)
                return

    def _command(self, order: Order) -> Any:
        number, parameters = _ORDERS[order]
        if number == _SET_MODE:
            parameters = [*parameters, float(GAITS.index(self.motion.gait))]
        values = [*parameters, *([0.0] * (7 - len(parameters)))]
        return mavlink.MAVLink_command_long_message(
            self._config.robot_system, self._config.robot_component, number, 0, *values
        )


def _heartbeat() -> Any:
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, _GCS_MODE, mavlink.MAV_STATE_ACTIVE, 3
    )


_ARM_DISARM = int(mavlink.MAV_CMD_COMPONENT_ARM_DISARM)
_SET_MODE = int(mavlink.MAV_CMD_DO_SET_MODE)
_CUSTOM = float(mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)
_FINAL = (Order.STOP, Order.EMERGENCY)
_BY_MODE = {
    Mode.STAND: Order.STAND,
    Mode.WALK: Order.WALK,
    Mode.SIT: Order.SIT,
    Mode.OFF: Order.OFF,
}
_AFTER = {order: mode for mode, order in _BY_MODE.items()} | {
    Order.ARM: Mode.STAND,
    Order.STOP: Mode.OFF,
    Order.EMERGENCY: Mode.OFF,
    Order.HALT: Mode.STAND,
}
_ORDERS: dict[Order, tuple[int, list[float]]] = {
    Order.ARM: (_ARM_DISARM, [1.0]),
    Order.STOP: (_ARM_DISARM, [0.0]),
    Order.EMERGENCY: (_ARM_DISARM, [0.0, FORCE]),
    Order.HALT: (int(mavlink.MAV_CMD_DO_PAUSE_CONTINUE), [0.0]),
    **{order: (_SET_MODE, [_CUSTOM, float(MODES.index(mode))]) for mode, order in _BY_MODE.items()},
}
"""Command and leading parameters of each order; those not named are zero."""
