"""A robot that stands, as records; and pymavlink alone as the other end of the line."""

from __future__ import annotations

import numpy as np
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.io.station.telemetry import Snapshot
from bluefoot_mpc.types import (
    BodyState,
    GaitPhase,
    ImuBatch,
    Mode,
    MotionCommand,
    PostureReference,
    SensorFrame,
    Telemetry,
)


def snapshot(
    time: float = 1.0, *, mode: Mode = Mode.STAND, state: str = "active", events: tuple[str, ...] = (), **body
) -> Snapshot:
    """A tick; `body` replaces fields of estimate or frame."""
    frame_fields = {key: body.pop(key) for key in list(body) if key in SensorFrame.__dataclass_fields__}
    return Snapshot(
        telemetry=telemetry(time, mode, events, **body), frame=frame(time, **frame_fields), state=state
    )


def frame(time: float, **fields) -> SensorFrame:
    known = {
        "time": time,
        "joint_position": np.linspace(-1.0, 1.0, 16),
        "joint_speed": np.zeros(16),
        "joint_load": np.zeros(16),
        "joint_temperature": np.linspace(30.0, 45.0, 16),
        "joint_time": np.full(16, time),
        "joint_valid": np.ones(16, bool),
        "voltage": 11.4,
        "voltage_valid": True,
        "imu": ImuBatch(
            time=np.array([time]), gyro=np.zeros((1, 3)), accel=np.zeros((1, 3)),
            magnetometer=np.zeros((1, 3)), valid=np.array([True]),
        ),
        "contact": np.array([True, False, True, True]),
        "contact_time": np.full(4, time),
        "contact_valid": np.array([True, True, False, True]),
    }  # fmt: skip
    return SensorFrame(**(known | fields))


def telemetry(time: float, mode: Mode, events: tuple[str, ...], **fields) -> Telemetry:
    rpy = fields.pop("rpy", np.array([0.1, -0.2, 0.3]))
    known = {
        "time": time,
        "position": np.array([1.0, 2.0, 0.11]),
        "quaternion": quaternion_from_rpy(rpy),
        "rpy": rpy,
        "linear_velocity": np.array([0.06, 0.01, 0.0]),
        "angular_velocity": np.array([0.01, 0.02, 0.03]),
        "joint_position": np.zeros(16),
        "joint_velocity": np.zeros(16),
        "contact": np.ones(4, bool),
        "foot_position_in_base": np.zeros((4, 3)),
        "height": 0.1,
    }
    return Telemetry(
        time=time,
        mode=mode,
        motion=MotionCommand(mode=mode, gait="walk"),
        estimate=BodyState(**(known | fields)),
        phase=GaitPhase(
            swing=np.zeros(4, bool), y1=np.zeros(4), y2=np.zeros(4), phase=np.zeros(4), walking=False
        ),
        reference=PostureReference(
            trunk_position=np.zeros(3), trunk_rpy=np.zeros(3), foot_position=np.zeros((4, 3)),
            swing=np.zeros(4, bool),
        ),
        zmp=np.zeros(2),
        events=events,
        tick_us=5000.0,
        deadline_misses=3,
    )  # fmt: skip


class Peer:
    """A ground station, or a robot, of pymavlink only.

    Args:
        system: its MAVLink system.
        component: its component.
    """

    def __init__(self, system: int = 255, component: int = 190) -> None:
        self.mav = mavlink.MAVLink(None, system, component)
        self.mav.robust_parsing = True

    def pack(self, message) -> bytes:
        data = bytes(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256
        return data

    def parse(self, data: bytes) -> list:
        return [m for m in self.mav.parse_buffer(data) or [] if m.get_type() != "BAD_DATA"]

    def heartbeat(self) -> bytes:
        return self.pack(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3))

    def manual(self, x: int = 0, y: int = 0, r: int = 0, target: int = 1, **more) -> bytes:
        return self.pack(mavlink.MAVLink_manual_control_message(target, x, y, 500, r, 0, **more))

    def command(self, number: int, *parameters: float, target: int = 1) -> bytes:
        values = [*parameters, *([0.0] * (7 - len(parameters)))]
        return self.pack(mavlink.MAVLink_command_long_message(target, 1, number, 0, *values))

    def mode(self, mode: int, gait: int = 0) -> bytes:
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, mode, gait)


def sent(end, now: float) -> bytes:
    """Everything that an end of the link sends at a time."""
    frames = []
    while frame := end.produce(now):
        frames.append(frame)
    return b"".join(frames)


OFF, STAND, WALK, SIT, SAFE = range(5)
"""Modes as MAV_CMD_DO_SET_MODE has them."""
