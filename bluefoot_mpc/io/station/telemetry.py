"""What the robot tells: its state as messages of MAVLink's ``common`` dialect.

MAVLink's frames are NED and FRD (x north or forward, y east or right, z down);
ours follow REP-103 (x forward, y left, z up). Going over means turning by half
a turn about x: y and z change sign, and so do pitch and yaw.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.io.station.protocol import LEADS, pack_mode
from bluefoot_mpc.types import Mode, SensorFrame, Telemetry

N_OUTPUTS = 32  # of ACTUATOR_OUTPUT_STATUS
CONTACT_BIT = 16
CONTACT_VALID_BIT = 20
TEMPERATURES = b"temp"
NAVIGATION = b"nav"
NAVIGATION_TEXT = "navigation: "
"""How texts begin that say what leads the robot on its own way, and why."""
_TEMPERATURE_ARRAY, _NAVIGATION_ARRAY = 1, 2
_UNKNOWN_U16 = 0xFFFF
_UNKNOWN_I16 = 0x7FFF
_LOW, _CRITICAL, _EMERGENCY = 10.8, 10.2, 9.6  # V, of a 3S pack: warn, sit, cut
_POWERLESS = ("disarmed", "checking", "stopped", "emergency")
_SENSORS = {
    "gyro": mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    "accel": mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
    "odometry": mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION,
    "servos": mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS,
    "station": mavlink.MAV_SYS_STATUS_SENSOR_RC_RECEIVER,
    "battery": mavlink.MAV_SYS_STATUS_SENSOR_BATTERY,
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Snapshot:
    """What was published on one tick.

    Attributes:
        telemetry: the controller's account.
        frame: what the sensors said.
        state: of the safety supervisor, one of `protocol.STATES`, or empty.
        reasons: what the supervisor has against going on.
        period: s, command period.
    """

    telemetry: Telemetry
    frame: SensorFrame
    state: str = ""
    reasons: tuple[str, ...] = ()
    period: float = 0.02


@dataclass(frozen=True, kw_only=True, slots=True)
class UplinkHealth:
    """How the robot hears its station.

    Attributes:
        alive: False when nothing that counts has come for a while.
        loss: share of the station's messages that were lost, 0..1.
        bad: frames that failed their sum or their signature.
    """

    alive: bool = False
    loss: float = 0.0
    bad: int = 0


def heartbeat(snapshot: Snapshot | None) -> Any:
    """HEARTBEAT: mode, gait, supervisor's state and task in custom_mode, armed and guided in base_mode."""
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    mode, gait, state, task, status = Mode.OFF, "", "", "", mavlink.MAV_STATE_BOOT
    if snapshot is not None:
        mode, gait = snapshot.telemetry.mode, snapshot.telemetry.motion.gait
        state, status = snapshot.state, _status(snapshot)
        guide = snapshot.telemetry.motion.guide
        if guide is not None:
            task = str(guide.task)
            base |= mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
        if mode is not Mode.OFF and state not in _POWERLESS:
            base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_GROUND_QUADRUPED,
        mavlink.MAV_AUTOPILOT_GENERIC,
        base,
        pack_mode(mode, gait, state, task),
        status,
        3,
    )


def farewell() -> list[Any]:
    """What a robot says whose program ends: a text, and a heartbeat that has no torque and powers off."""
    beat = heartbeat(None)
    beat.system_status = mavlink.MAV_STATE_POWEROFF
    return [*texts(mavlink.MAV_SEVERITY_NOTICE, "the robot's program ends", 0), beat]


def attitude(snapshot: Snapshot) -> Any:
    """ATTITUDE: roll, pitch, yaw (rad, FRD against NED) and body rates (rad/s, FRD)."""
    estimate = snapshot.telemetry.estimate
    roll, pitch, yaw = estimate.rpy.tolist()
    p, q, r = estimate.angular_velocity.tolist()
    return mavlink.MAVLink_attitude_message(_boot_ms(snapshot), roll, -pitch, -yaw, p, -q, -r)


def position(snapshot: Snapshot) -> Any:
    """LOCAL_POSITION_NED: trunk in the odometry frame turned to NED, m and m/s."""
    estimate = snapshot.telemetry.estimate
    x, y, z = estimate.position.tolist()
    u, v, w = (rotation_from_quaternion(estimate.quaternion) @ estimate.linear_velocity).tolist()
    return mavlink.MAVLink_local_position_ned_message(_boot_ms(snapshot), x, -y, -z, u, -v, -w)


def joints(snapshot: Snapshot) -> Any:
    """ACTUATOR_OUTPUT_STATUS: outputs 0..15 are the measured joint angles, rad, leg-major.

    ``active``: bits 0..15 joint reading valid, 16..19 foot touches, 20..23 foot
    switch valid (order FL, FR, RL, RR).
    """
    frame = snapshot.frame
    active = _bits(frame.joint_valid.tolist())
    active |= _bits(frame.contact.tolist()) << CONTACT_BIT
    active |= _bits(frame.contact_valid.tolist()) << CONTACT_VALID_BIT
    angles = frame.joint_position.tolist()
    outputs = angles + [0.0] * (N_OUTPUTS - len(angles))
    return mavlink.MAVLink_actuator_output_status_message(int(frame.time * 1e6), active, outputs)


def system(snapshot: Snapshot, uplink: UplinkHealth) -> Any:
    """SYS_STATUS: load of the tick, voltage, health of the parts, errors.

    errors_count1 counts late ticks, errors_count2 joints without a reading,
    errors_comm frames from the station that failed their sum or signature.
    """
    telemetry, frame = snapshot.telemetry, snapshot.frame
    healthy = {
        "gyro": bool(frame.imu.valid.any()),
        "accel": bool(frame.imu.valid.any()),
        "odometry": telemetry.estimate.healthy,
        "servos": bool(frame.joint_valid.all()),
        "station": uplink.alive,
        "battery": frame.voltage_valid,
    }
    present = sum(_SENSORS.values())
    return mavlink.MAVLink_sys_status_message(
        present,
        present,
        sum(bit for name, bit in _SENSORS.items() if healthy[name]),
        _clipped(1000.0 * telemetry.tick_us * 1e-6 / snapshot.period, 0xFFFF),
        _millivolts(frame),
        -1,
        -1,
        _clipped(1e4 * uplink.loss, 10000),
        uplink.bad & 0xFFFF,
        telemetry.deadline_misses & 0xFFFF,
        int((~frame.joint_valid).sum()),
        0,
        0,
    )


def battery(snapshot: Snapshot) -> Any:
    """BATTERY_STATUS: voltage of the pack at the servos as cell 0, mV; current is not measured."""
    frame = snapshot.frame
    return mavlink.MAVLink_battery_status_message(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        _UNKNOWN_I16,
        [_millivolts(frame)] + [_UNKNOWN_U16] * 9,
        -1,
        -1,
        -1,
        -1,
        0,
        _charge(frame),
    )


def temperatures(snapshot: Snapshot) -> Any:
    """DEBUG_FLOAT_ARRAY named ``temp``: temperatures of the 16 servos, °C; NaN where unknown."""
    values = snapshot.frame.joint_temperature.tolist()
    return mavlink.MAVLink_debug_float_array_message(
        int(snapshot.frame.time * 1e6), TEMPERATURES, _TEMPERATURE_ARRAY, values + [0.0] * (58 - len(values))
    )


def navigation(snapshot: Snapshot) -> Any:
    """DEBUG_FLOAT_ARRAY named ``nav``, or None while the robot is told where to go.

    Its numbers: what leads (`protocol.LEADS`), waypoints left, clearance (m), age of the marker's
    sighting (s), where it was seen (m, odometry frame, x and y); infinite and NaN as in the report.
    """
    report = snapshot.telemetry.navigation
    if report is None:
        return None
    values = [
        float(LEADS.index(report.guided)),
        float(report.waypoints_left),
        report.clearance,
        report.marker_age,
        *report.marker_position[:2].tolist(),
    ]
    return mavlink.MAVLink_debug_float_array_message(
        int(snapshot.frame.time * 1e6), NAVIGATION, _NAVIGATION_ARRAY, values + [0.0] * (58 - len(values))
    )


def led(snapshot: Snapshot) -> str:
    """What leads the robot and why, in words; empty while it is told where to go."""
    report = snapshot.telemetry.navigation
    if report is None:
        return ""
    return f"{report.guided}: {report.reason}" if report.reason else str(report.guided)


def texts(severity: int, text: str, number: int) -> list[Any]:
    """STATUSTEXT: one message, or several of 50 characters each that belong together.

    Args:
        severity: MAV_SEVERITY.
        text: any; signs that ASCII lacks are put into words.
        number: of this text, 1..65535; ties the parts together.
    """
    data = text.replace("°", " deg").replace("·", "*").encode("ascii", "replace")[:200] or b"?"
    parts = [data[i : i + 50] for i in range(0, len(data), 50)]
    if len(parts) == 1:
        return [mavlink.MAVLink_statustext_message(severity, parts[0])]
    return [
        mavlink.MAVLink_statustext_message(severity, part, number, index) for index, part in enumerate(parts)
    ]


def _status(snapshot: Snapshot) -> int:
    mode, state = snapshot.telemetry.mode, snapshot.state
    if mode is Mode.SAFE or state == "emergency":
        return int(mavlink.MAV_STATE_EMERGENCY)
    if snapshot.reasons:
        return int(mavlink.MAV_STATE_CRITICAL)
    resting = mode is Mode.OFF or state in _POWERLESS
    return int(mavlink.MAV_STATE_STANDBY if resting else mavlink.MAV_STATE_ACTIVE)


def _boot_ms(snapshot: Snapshot) -> int:
    return int(snapshot.telemetry.time * 1e3) & 0xFFFFFFFF


def _bits(values: list[bool]) -> int:
    return sum(1 << index for index, value in enumerate(values) if value)


def _clipped(value: float, most: int) -> int:
    return max(0, min(most, round(value))) if math.isfinite(value) else most


def _millivolts(frame: SensorFrame) -> int:
    known = frame.voltage_valid and math.isfinite(frame.voltage)
    return _clipped(1e3 * frame.voltage, _UNKNOWN_U16 - 1) if known else _UNKNOWN_U16


def _charge(frame: SensorFrame) -> int:
    if not frame.voltage_valid or not math.isfinite(frame.voltage):
        return int(mavlink.MAV_BATTERY_CHARGE_STATE_UNDEFINED)
    ladder = (
        (_EMERGENCY, mavlink.MAV_BATTERY_CHARGE_STATE_EMERGENCY),
        (_CRITICAL, mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL),
        (_LOW, mavlink.MAV_BATTERY_CHARGE_STATE_LOW),
    )
    states = [state for limit, state in ladder if frame.voltage < limit]
    return int(states[0] if states else mavlink.MAV_BATTERY_CHARGE_STATE_OK)
