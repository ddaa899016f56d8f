"""The robot's end of the link as a pure machine: bytes and times in, bytes out; no thread, no port."""

from __future__ import annotations

import re
from collections import deque
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station import telemetry as tell
from bluefoot_mpc.io.station.commands import CommandInbox
from bluefoot_mpc.io.station.config import BITS_PER_BYTE, StationConfig
from bluefoot_mpc.io.station.framing import FrameReader, Received
from bluefoot_mpc.io.station.mission import MissionServer
from bluefoot_mpc.io.station.protocol import ACCEPTED, DENIED, FAILED, IN_PROGRESS
from bluefoot_mpc.io.station.schedule import Schedule, Stream, TokenBucket
from bluefoot_mpc.io.station.sequence import SequenceGuard
from bluefoot_mpc.io.station.signing import Signer
from bluefoot_mpc.io.station.telemetry import Snapshot, UplinkHealth
from bluefoot_mpc.io.station.writer import FrameWriter
from bluefoot_mpc.types import FloatArray

STREAMS = (
    Stream(name="heartbeat", rate=1.0, urgent=True),
    Stream(name="text", rate=4.0, urgent=True),
    Stream(name="attitude", rate=25.0),
    Stream(name="joints", rate=10.0),
    Stream(name="position", rate=5.0),
    Stream(name="system", rate=2.0),
    Stream(name="battery", rate=2.0),
    Stream(name="temperatures", rate=1.0),
    Stream(name="mission", rate=1.0, urgent=True),
    Stream(name="navigation", rate=1.0, urgent=True),
)
"""What goes down to the station."""
_BUILD = {
    "attitude": tell.attitude,
    "joints": tell.joints,
    "position": tell.position,
    "battery": tell.battery,
    "temperatures": tell.temperatures,
    "navigation": tell.navigation,
}
_ALIVE = 0.3  # s, age of a command that still counts as a working uplink
_REPEAT = 5.0  # s in which the same text is told once
_STEADY = 0.3  # s for which something leads the robot until that is told
_NUMBER = re.compile(r"\d+(\.\d+)?")
_ARM = int(mavlink.MAV_CMD_COMPONENT_ARM_DISARM)


class RobotEnd:
    """Telemetry down, commands up.

    `offer` and `say` may be called from another thread than the rest.

    Args:
        config: addresses, rates and times.
        now: s, start.
        signer: checks and signs; None: frames are not signed.

    Attributes:
        inbox: what the station wants.
        mission: takes and gives lists of waypoints.
        reader: finds frames.
        refused: frames with a right sum and no valid signature.
    """

    def __init__(self, config: StationConfig, now: float, signer: Signer | None = None) -> None:
        self._config, self._signer = config, signer
        self.inbox = CommandInbox(config=config, start=now)
        self.reader = FrameReader()
        self.refused = 0
        rate = config.down_share * config.line_rate / BITS_PER_BYTE
        bucket = TokenBucket(rate, config.burst)
        self.writer = FrameWriter(config.robot_system, config.robot_component, bucket, signer)
        self._schedule = Schedule(STREAMS, now)
        self._snapshot: Snapshot | None = None
        self._sent: dict[str, Snapshot] = {}
        self._texts: deque[tuple[int, str]] = deque(maxlen=16)
        self._told: dict[str, float] = {}
        self._parts: deque[Any] = deque(maxlen=16)
        self._text_number = 0
        self._guards: dict[int, SequenceGuard] = {}
        self._shown = 0
        self._seen: Snapshot | None = None
        self._led = self._led_now = ""
        self._led_since = now
        self._has_list = False
        self._current = self.inbox.tasks.current()
        self.mission = MissionServer(
            config,
            lambda: self.inbox.tasks.points,
            self._take_list,
            lambda text: self.say(mavlink.MAV_SEVERITY_WARNING, text),
        )

    @property
    def guards(self) -> tuple[SequenceGuard, ...]:
        """The counters of the station's components."""
        return tuple(self._guards.values())

    def offer(self, snapshot: Snapshot) -> None:
        """The newest state; what was not sent before is forgotten."""
        self._snapshot = snapshot

    def say(self, severity: int, text: str) -> None:
        """Tell the operator something; when too much is told, the oldest is forgotten."""
        self._texts.append((severity, text))

    def armed(self, reason: str = "") -> None:
        """Answer the last wish to arm: done, or refused for a reason."""
        result = FAILED if reason else ACCEPTED
        self.writer.answer(mavlink.MAVLink_command_ack_message(_ARM, result))
        if reason:
            self.say(mavlink.MAV_SEVERITY_ERROR, f"not armed: {reason}")

    def farewell(self) -> None:
        """Say that nothing more will come, before everything else."""
        for message in tell.farewell():
            self.writer.answer(message)

    def receive(self, data: bytes, now: float) -> int:
        """Take bytes from the line; gives the number of messages that were the station's own."""
        count = 0
        for received in self.reader.feed(data):
            if self._trusted(received, now):
                count += 1
                self._take(received.message, now)
        return count

    def produce(self, now: float) -> bytes | None:
        """The next frame to send now; None while nothing is due or the line has no room."""
        self._follow(now)
        while self.writer.may_send(now):
            message = self.writer.take_answer() or self.mission.due(now) or self._due(now)
            if message is None:
                return None
            if message is not _NOTHING:
                return self.writer.frame(message)
        return None

    def wait(self, now: float) -> float:
        """Time (s) until `produce` may have something."""
        pause = 0.0 if self.writer.waiting else min(self._schedule.wait(now), self.mission.wait(now))
        return max(pause, self.writer.wait(now))

    def _trusted(self, received: Received, now: float) -> bool:
        config = self._config
        if received.system != config.station_system:
            return False
        if self._signer is not None and not self._signer.accepts(received):
            self.refused += 1
            return False
        guard = self._guards.get(received.component)
        if guard is None:
            guard = SequenceGuard(config.sequence_window, config.sequence_timeout)
            self._guards[received.component] = guard
        return guard.accepts(received.sequence, now)

    def _take(self, message: Any, now: float) -> None:
        kind, config = message.get_type(), self._config
        if kind == "HEARTBEAT":
            if remark := self.inbox.heartbeat(now):
                self.say(mavlink.MAV_SEVERITY_WARNING, remark)
        elif kind == "MANUAL_CONTROL" and message.target == config.robot_system:
            if remark := self.inbox.manual(message, now):
                self.say(mavlink.MAV_SEVERITY_WARNING, remark)
        elif kind == "COMMAND_LONG" and self._is_meant(message):
            result = self.inbox.execute(message)
            if result == DENIED and self.inbox.tasks.refusal:
                self.say(mavlink.MAV_SEVERITY_WARNING, self.inbox.tasks.refusal)
            answer = IN_PROGRESS if result is None else result
            self.writer.answer(mavlink.MAVLink_command_ack_message(message.command, answer))
        elif kind.startswith("MISSION_") and self._is_meant(message):
            for reply in self.mission.take(message, now):
                self.writer.answer(reply)

    def _take_list(self, points: FloatArray) -> None:
        self.inbox.load(points)
        self._has_list = True

    def _follow(self, now: float) -> None:
        """Notice what the robot has reached, and what leads it now."""
        snapshot = self._snapshot
        if snapshot is None or snapshot is self._seen:
            return
        self._seen = snapshot
        self._tell_progress(snapshot)
        led = tell.led(snapshot)
        # Another number in the same words is nothing new.
        words = _NUMBER.sub("#", led)
        if words != self._led_now:
            self._led_now, self._led_since = words, now
        if words != self._led and now - self._led_since >= _STEADY:
            self._led = words
            self._schedule.hurry("navigation", now)
            if led:
                self.say(mavlink.MAV_SEVERITY_INFO, f"{tell.NAVIGATION_TEXT}{led}")

    def _tell_progress(self, snapshot: Snapshot) -> None:
        tasks, report = self.inbox.tasks, snapshot.telemetry.navigation
        before = len(tasks.missed)
        for number in self.inbox.progress(snapshot.telemetry):
            self.writer.answer(mavlink.MAVLink_mission_item_reached_message(number))
        why = "" if report is None else report.reason.rpartition("given up")[2]
        for number in tasks.missed[before:]:
            self.say(mavlink.MAV_SEVERITY_WARNING, f"waypoint {number + 1} given up{why}")

    def _is_meant(self, message: Any) -> bool:
        component = message.target_component in (0, self._config.robot_component)
        return component and message.target_system == self._config.robot_system

    def _due(self, now: float) -> Any:
        """The message whose turn it is; `_NOTHING` where a stream has none; None: no stream is due."""
        self._hurry_changes(now)
        name = self._schedule.next(now)
        if name is None:
            return None
        self._schedule.done(name, now)
        if name == "heartbeat":
            return tell.heartbeat(self._snapshot)
        if name == "text":
            return self._text(now)
        if name == "mission":
            current = mavlink.MAVLink_mission_current_message(*self._current)
            return current if self._has_list else _NOTHING
        return self._state(name, now)

    def _state(self, name: str, now: float) -> Any:
        snapshot = self._snapshot
        # What has not changed since is not sent again: a station must see that a robot stands still.
        if snapshot is None or self._sent.get(name) is snapshot:
            return _NOTHING
        self._sent[name] = snapshot
        if name == "system":
            return tell.system(snapshot, self._health(now))
        return _BUILD[name](snapshot) or _NOTHING

    def _hurry_changes(self, now: float) -> None:
        """A change of mode, state or waypoint is told at once."""
        current = self.inbox.tasks.current()
        if current != self._current:
            self._current = current
            self._schedule.hurry("mission", now)
        if self._snapshot is not None:
            mode = tell.heartbeat(self._snapshot).custom_mode
            if mode != self._shown:
                self._shown = mode
                self._schedule.hurry("heartbeat", now)

    def _text(self, now: float) -> Any:
        while not self._parts and self._texts:
            severity, text = self._texts.popleft()
            if now - self._told.get(text, -_REPEAT) < _REPEAT:
                continue
            self._told = {known: when for known, when in self._told.items() if now - when < _REPEAT}
            self._told[text] = now
            self._text_number = self._text_number % 0xFFFF + 1
            self._parts.extend(tell.texts(severity, text, self._text_number))
        return self._parts.popleft() if self._parts else _NOTHING

    def _health(self, now: float) -> UplinkHealth:
        lost = sum(guard.lost for guard in self.guards)
        taken = sum(guard.taken for guard in self.guards)
        _, age = self.inbox.command(now)
        bad = self.reader.bad + self.refused
        return UplinkHealth(alive=age <= _ALIVE, loss=lost / max(1, lost + taken), bad=bad)


_NOTHING = object()
