"""What a ground station knows of its robot, put together from telemetry; back in our own frames."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station.protocol import LEADS, unpack_mode, unpack_task
from bluefoot_mpc.io.station.telemetry import (
    CONTACT_BIT,
    CONTACT_VALID_BIT,
    NAVIGATION,
    NAVIGATION_TEXT,
    TEMPERATURES,
)
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray

_UNKNOWN_U16 = 0xFFFF


def _unknown(size: int) -> FloatArray:
    return np.full(size, np.nan)


@dataclass(frozen=True, kw_only=True, slots=True)
class Way:
    """How the robot finds its way, as it last said.

    Attributes:
        lead: what leads it, one of `types.Guided`.
        waypoints_left: still to be reached.
        clearance: m to the nearest thing that it knows of; infinite in the open.
        marker_age: s since it saw the marker; infinite before.
        marker: (2,) m, where that was, in the odometry frame; NaN before.
    """

    lead: str
    waypoints_left: int
    clearance: float
    marker_age: float
    marker: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class Mission:
    """The robot's list of waypoints, as it last said.

    Attributes:
        next: number of the waypoint that is next, from 0.
        total: number of waypoints.
        state: MISSION_STATE.
    """

    next: int = 0
    total: int = 0
    state: int = int(mavlink.MISSION_STATE_NO_MISSION)

    @property
    def complete(self) -> bool:
        """True once the last waypoint has been reached."""
        return self.state == int(mavlink.MISSION_STATE_COMPLETE)

    @property
    def reached(self) -> int:
        """Number of waypoints that have been reached."""
        return self.total if self.complete else self.next


@dataclass(frozen=True, kw_only=True, slots=True)
class Text:
    """A line for the operator.

    Attributes:
        number: counts all lines, from 1.
        time: s, when it arrived.
        severity: MAV_SEVERITY, 0 worst .. 7.
        text: as told.
    """

    number: int
    time: float
    severity: int
    text: str


@dataclass(slots=True)
class RobotPicture:
    """The newest of everything that the robot told; NaN or empty where it has not yet.

    Attributes:
        time: s, the robot's own clock.
        rpy: (3,) rad, roll, pitch and yaw of the trunk (REP-103).
        rates: (3,) rad/s in the base frame.
        position: (3,) m, trunk in the odometry frame.
        velocity: (3,) m/s, axes of the odometry frame.
        joints: (16,) rad.
        joint_valid: (16,) False where no reading came.
        contact: (4,) True where a foot touches.
        contact_valid: (4,) False where a switch cannot be trusted.
        temperatures: (16,) °C.
        voltage: V at the servos.
        load: share of the command period that the controller computes.
        mode: what the robot does.
        gait: with which gait.
        state: of its safety supervisor.
        task: what it finds its own way for; empty while it is told where to go.
        way: how it finds it; None before it has said so.
        why: the reason for that, where it gave one.
        mission: its list of waypoints.
        armed: True while torque may be on.
        alarm: MAV_STATE of the heartbeat.
        healthy: parts by name, False where something is wrong with them.
        uplink_loss: share of our messages that the robot missed, 0..1.
        late_ticks: ticks so far that took longer than the period.
        texts: what was told, oldest first.
        arrived: s, when the newest message of each kind came.
    """

    time: float = math.nan
    rpy: FloatArray = field(default_factory=lambda: _unknown(3))
    rates: FloatArray = field(default_factory=lambda: _unknown(3))
    position: FloatArray = field(default_factory=lambda: _unknown(3))
    velocity: FloatArray = field(default_factory=lambda: _unknown(3))
    joints: FloatArray = field(default_factory=lambda: _unknown(N_JOINTS))
    joint_valid: BoolArray = field(default_factory=lambda: np.zeros(N_JOINTS, bool))
    contact: BoolArray = field(default_factory=lambda: np.zeros(N_LEGS, bool))
    contact_valid: BoolArray = field(default_factory=lambda: np.zeros(N_LEGS, bool))
    temperatures: FloatArray = field(default_factory=lambda: _unknown(N_JOINTS))
    voltage: float = math.nan
    load: float = math.nan
    mode: str = ""
    gait: str = ""
    state: str = ""
    task: str = ""
    way: Way | None = None
    why: str = ""
    mission: Mission = field(default_factory=Mission)
    armed: bool = False
    alarm: int = 0
    healthy: dict[str, bool] = field(default_factory=dict)
    uplink_loss: float = 0.0
    late_ticks: int = 0
    texts: deque[Text] = field(default_factory=lambda: deque(maxlen=200))
    arrived: dict[str, float] = field(default_factory=dict)
    _parts: dict[int, list[str]] = field(default_factory=dict)

    def take(self, message: Any, now: float) -> None:
        """Take in a message of the robot's; others change nothing but its time of arrival."""
        kind = message.get_type()
        self.arrived[kind] = now
        take = _TAKE.get(kind)
        if take is not None:
            take(self, message, now)

    def age(self, now: float) -> float:
        """Time (s) since anything came; infinite before that."""
        return now - max(self.arrived.values()) if self.arrived else math.inf

    def tell(self, text: str, severity: int, now: float) -> None:
        """Add a line for the operator."""
        if text.startswith(NAVIGATION_TEXT):
            self.why = text.removeprefix(NAVIGATION_TEXT).partition(": ")[2]
        number = self.texts[-1].number + 1 if self.texts else 1
        self.texts.append(Text(number=number, time=now, severity=severity, text=text))

    def _heartbeat(self, message: Any, now: float) -> None:
        self.mode, self.gait, self.state = unpack_mode(message.custom_mode)
        self.task = unpack_task(message.custom_mode)
        self.armed = bool(message.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED)
        self.alarm = message.system_status

    def _attitude(self, message: Any, now: float) -> None:
        self.time = message.time_boot_ms * 1e-3
        self.rpy = np.array([message.roll, -message.pitch, -message.yaw])
        self.rates = np.array([message.rollspeed, -message.pitchspeed, -message.yawspeed])

    def _position(self, message: Any, now: float) -> None:
        self.position = np.array([message.x, -message.y, -message.z])
        self.velocity = np.array([message.vx, -message.vy, -message.vz])

    def _joints(self, message: Any, now: float) -> None:
        self.joints = np.array(message.actuator[:N_JOINTS])
        self.joint_valid = _bits(message.active, 0, N_JOINTS)
        self.contact = _bits(message.active, CONTACT_BIT, N_LEGS)
        self.contact_valid = _bits(message.active, CONTACT_VALID_BIT, N_LEGS)

    def _system(self, message: Any, now: float) -> None:
        health = message.onboard_control_sensors_health
        self.healthy = {name: bool(health & bit) for name, bit in PARTS.items()}
        self.load = message.load * 1e-3
        self.uplink_loss = message.drop_rate_comm * 1e-4
        self.late_ticks = message.errors_count1

    def _battery(self, message: Any, now: float) -> None:
        known = message.voltages[0] != _UNKNOWN_U16
        self.voltage = message.voltages[0] * 1e-3 if known else math.nan

    def _floats(self, message: Any, now: float) -> None:
        name = message.name if isinstance(message.name, bytes) else str(message.name).encode()
        if name.rstrip(b"\x00") == TEMPERATURES:
            self.temperatures = np.array(message.data[:N_JOINTS])
        elif name.rstrip(b"\x00") == NAVIGATION:
            lead, left, clearance, age, x, y = message.data[:6]
            known = lead in range(len(LEADS)) and left in range(0xFFFF)
            self.way = Way(
                lead=str(LEADS[int(lead)]) if known else "?",
                waypoints_left=int(left) if known else 0,
                clearance=clearance,
                marker_age=age,
                marker=np.array([x, y]),
            )

    def _mission(self, message: Any, now: float) -> None:
        self.mission = Mission(next=message.seq, total=message.total, state=message.mission_state)

    def _text(self, message: Any, now: float) -> None:
        if message.id == 0:
            self.tell(message.text, message.severity, now)
            return
        parts = self._parts.setdefault(message.id, [])
        if message.chunk_seq != len(parts):  # one was lost: what has come is told as it is
            parts.append("…")
        parts.append(message.text)
        if len(message.text) < 50:
            self.tell("".join(self._parts.pop(message.id)), message.severity, now)
        while len(self._parts) > 8:
            self._parts.pop(next(iter(self._parts)))


PARTS = {
    "gyro": mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    "odometry": mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION,
    "servos": mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,
    "station": mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
    "battery": mavlink.MAV_SYS_STATUS_SENSOR_BATTERY,
}
_TAKE = {
    "HEARTBEAT": RobotPicture._heartbeat,
    "ATTITUDE": RobotPicture._attitude,
    "LOCAL_POSITION_NED": RobotPicture._position,
    "ACTUATOR_OUTPUT_STATUS": RobotPicture._joints,
    "SYS_STATUS": RobotPicture._system,
    "BATTERY_STATUS": RobotPicture._battery,
    "DEBUG_FLOAT_ARRAY": RobotPicture._floats,
    "MISSION_CURRENT": RobotPicture._mission,
    "STATUSTEXT": RobotPicture._text,
}


def _bits(value: int, first: int, count: int) -> BoolArray:
    return np.array([bool(value >> (first + index) & 1) for index in range(count)])
