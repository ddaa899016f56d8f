"""The station's side of MAVLink's mission protocol: a list of waypoints goes up to the robot."""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.mission import item
from bluefoot_mpc.io.station.protocol import mission_result_name
from bluefoot_mpc.types import FloatArray

ACCEPTED = mission_result_name(int(mavlink.MAV_MISSION_ACCEPTED))
_LIST = int(mavlink.MAV_MISSION_TYPE_MISSION)


class MissionUpload:
    """One list on its way up, until the robot has said that it has it, or what is wrong with it.

    The robot asks for the items; the station only answers. What was said last is
    said again while the robot is silent, so no message that is lost stops the upload.

    Args:
        config: addresses, times and tries.
        points: (n, 2) m in the odometry frame; n = 0 empties the robot's list.
        now: s.

    Attributes:
        result: ``"accepted"``, or why not; empty while it is under way.
    """

    def __init__(self, config: StationConfig, points: FloatArray, now: float) -> None:
        self._config, self._points = config, points
        self._robot = (config.robot_system, config.robot_component)
        self._next = mavlink.MAVLink_mission_count_message(*self._robot, len(points), _LIST)
        self._again, self._tries = now, 0
        self._told_all = not len(points)
        self.result = ""

    def take(self, message: Any, now: float) -> None:
        """Take a message of the robot's; those of other protocols change nothing."""
        kind = message.get_type()
        if self.result or kind not in ("MISSION_REQUEST_INT", "MISSION_REQUEST", "MISSION_ACK"):
            return
        if message.mission_type != _LIST:
            return
        if kind == "MISSION_ACK":
            # An answer to the list before this one may still be under way.
            early = message.type == mavlink.MAV_MISSION_ACCEPTED and not self._told_all
            if self._tries and not early:
                self.result = mission_result_name(message.type)
        elif message.seq < len(self._points):
            self._next = item(self._robot, message.seq, self._points[message.seq])
            self._again, self._tries = now, 0
            self._told_all = self._told_all or message.seq == len(self._points) - 1

    def due(self, now: float) -> Any:
        """What has to be said now, or None."""
        if self.result or now < self._again:
            return None
        if self._tries >= self._config.mission_tries:
            self.result = "no answer"
            return None
        self._tries += 1
        # Twice the robot's patience: it is the robot that asks again, as long as it hears anything.
        self._again = now + 2.0 * self._config.mission_patience
        return self._next

    def wait(self, now: float) -> float:
        """Time (s) until something may have to be said."""
        return math.inf if self.result else max(0.0, self._again - now)
