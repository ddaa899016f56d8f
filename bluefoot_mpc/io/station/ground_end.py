"""The station's end of the link as a pure machine: bytes and times in, bytes out; no thread, no port."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import BITS_PER_BYTE, StationConfig
from bluefoot_mpc.io.station.framing import FrameReader
from bluefoot_mpc.io.station.orders import (
    AFTER,
    BY_MODE,
    FINAL,
    GUIDED,
    Order,
    Pending,
    stages_of,
    stages_of_task,
)
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.io.station.protocol import GAITS
from bluefoot_mpc.io.station.schedule import Schedule, Stream, TokenBucket
from bluefoot_mpc.io.station.sequence import SequenceGuard
from bluefoot_mpc.io.station.signing import Signer
from bluefoot_mpc.io.station.sticks import write_sticks
from bluefoot_mpc.io.station.writer import FrameWriter
from bluefoot_mpc.types import Guide, Mode, MotionCommand

STREAMS = (
    Stream(name="heartbeat", rate=1.0, urgent=True),
    Stream(name="sticks", rate=25.0),
)
"""What goes up to the robot."""
_GCS_MODE = 0


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
        self._ended = self._guided = False
        self._led: Guide | None = None
        self._steered = now

    def steer(self, motion: MotionCommand, now: float) -> None:
        """What the sticks say from now on; another mode, gait or task than before is asked for.

        A task is asked for when its `Guide` is another object than the one before. After a stop
        nothing but arming asks for anything again.
        """
        self.motion, self._steered = motion, now
        if self._ended:
            return
        guide = motion.guide
        if guide is not None:
            if guide is not self._led:
                self._give(Order(guide.task), stages_of_task(guide, self._config, now), now)
                self._led = guide
        elif motion.mode in BY_MODE and (self._led is not None or (motion.mode, motion.gait) != self._asked):
            self.ask(BY_MODE[motion.mode], now)

    def ask(self, order: Order, now: float) -> None:
        """Give an order; it is repeated until the robot answers."""
        self._give(order, stages_of(order, self.motion.gait, self._config, now), now)

    def _give(self, order: Order, stages: list[Any], now: float) -> None:
        # The last word counts: what has no answer yet is given up, a stop only for arming.
        for pending in self.orders:
            if not pending.result and _replaces(order, pending.order):
                pending.result = "replaced"
        self._ended = order in FINAL or (self._ended and order is not Order.ARM)
        if order is not Order.CLEAR:
            self._asked = (AFTER.get(order, self._asked[0]), self.motion.gait)
            self._led, self._guided = None, order in GUIDED
        self.orders.append(Pending(order=order, stages=stages, next_try=now))

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
            self._answered(received.message, now)
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
            if message is None:
                return None
        if self.watch is not None:
            self.watch("out", message, now)
        return self.writer.frame(message)

    def wait(self, now: float) -> float:
        """Time (s) until `produce` may have something."""
        due = min((pending.wait(now) for pending in self.orders if not pending.result), default=math.inf)
        return max(min(self._schedule.wait(now), due), self.writer.wait(now))

    def _sticks(self, now: float) -> Any:
        motion = self.motion
        if now - self._steered > self._config.steer_timeout:
            # Whoever holds the sticks has hung: heartbeats go on, motion does not.
            if self._guided:
                return None  # nor does a task that needs no sticks: without any word the robot ends it
            motion = replace(motion, velocity=np.zeros(2), yaw_rate=0.0)
        return write_sticks(motion, self._config.scale, self._config.robot_system)

    def _order_due(self, now: float) -> Any:
        for pending in self.orders:
            message = None if pending.result else pending.due(now)
            if message is not None:
                return message
        return None

    def _answered(self, message: Any, now: float) -> None:
        if message.get_type() == "COMMAND_ACK" or message.get_type().startswith("MISSION_"):
            for pending in self.orders:
                if not pending.result and pending.take(message, now):
                    return


def _replaces(order: Order, older: Order) -> bool:
    """True where an order makes an older one without an answer pointless."""
    lists = (Order.GOTO, Order.CLEAR)
    if order in FINAL or order is Order.ARM:
        return True
    if order is Order.CLEAR or older is Order.CLEAR:  # which says nothing about motion
        return order in lists and older in lists
    return older not in FINAL


def _heartbeat() -> Any:
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, _GCS_MODE, mavlink.MAV_STATE_ACTIVE, 3
    )
