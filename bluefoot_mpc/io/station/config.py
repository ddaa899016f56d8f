"""What both ends of the radio link must agree on, and how much of the line each may use."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive, require_range

BITS_PER_BYTE = 10
"""Eight data bits, one start and one stop bit."""


@dataclass(frozen=True, kw_only=True, slots=True)
class StickScale:
    """What full travel of an axis of MANUAL_CONTROL (1000) stands for; the same at both ends."""

    forward: float = 0.10  # m/s
    left: float = 0.04  # m/s
    turn: float = 0.30  # rad/s
    tilt: float = math.radians(10.0)  # rad, roll, pitch and yaw of the trunk
    height: float = 0.02  # m, of the trunk

    def __post_init__(self) -> None:
        for name in self.__dataclass_fields__:
            require_positive(**{name: getattr(self, name)})


@dataclass(frozen=True, kw_only=True, slots=True)
class StationConfig:
    """Addresses, rates and times of the link; the same record serves robot and station."""

    robot_system: int = 1  # MAVLink system of the robot
    robot_component: int = 1  # MAV_COMP_ID_AUTOPILOT1
    station_system: int = 255  # MAVLink system of ground stations, as all of them have it
    station_component: int = 190  # MAV_COMP_ID_MISSIONPLANNER, the usual one of ground stations
    line_rate: int = 57600  # bit/s of the radio; a serial port's own baud rate outranks it
    down_share: float = 0.43  # of the line that telemetry may use
    up_share: float = 0.16  # of the line that the station may use
    burst: int = 240  # bytes that may leave at once
    heartbeat_timeout: float = 2.5  # s without a heartbeat until commands begin to age whatever else comes
    steer_timeout: float = 0.5  # s without a word from whoever holds the sticks until they are centred
    recall_after: float = 1.0  # s of silence after which a walking command has to be given anew
    sequence_window: int = 32  # messages that may be lost in a row before a number counts as an old one
    sequence_timeout: float = 1.0  # s of silence after which any number is taken
    hand: float = 0.05  # share of a stick's travel from which it counts as moved by hand
    waypoints_max: int = 50  # that the robot takes
    mission_patience: float = 0.5  # s until a word of the mission protocol is said again
    mission_tries: int = 6  # before an upload is given up
    scale: StickScale = StickScale()

    def __post_init__(self) -> None:
        require_range(1, 255, robot_system=self.robot_system, robot_component=self.robot_component)
        require_range(1, 255, station_system=self.station_system, station_component=self.station_component)
        require_range(1, 127, sequence_window=self.sequence_window)
        require_range(1, 1000, waypoints_max=self.waypoints_max)
        require_range(1, 100, mission_tries=self.mission_tries)
        require_positive(
            line_rate=self.line_rate, down_share=self.down_share, up_share=self.up_share, burst=self.burst,
            heartbeat_timeout=self.heartbeat_timeout, steer_timeout=self.steer_timeout,
            recall_after=self.recall_after, sequence_timeout=self.sequence_timeout,
            hand=self.hand, mission_patience=self.mission_patience,
        )  # fmt: skip
        if self.down_share + self.up_share > 0.6 + 1e-9:
            raise ConfigurationError(
                f"down_share + up_share = {self.down_share + self.up_share:g} must be at most 0.6: "
                "a radio needs the rest for its own traffic and for repeats"
            )
