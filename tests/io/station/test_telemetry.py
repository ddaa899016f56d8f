"""What the robot tells, as pymavlink and the picture of the station read it."""

import math

import numpy as np
import pytest
from pymavlink.dialects.v20 import common as mavlink

from bluefoot_mpc.io.station import telemetry as tell
from bluefoot_mpc.io.station.picture import RobotPicture
from bluefoot_mpc.io.station.protocol import GAITS, MODES, STATES, pack_mode, unpack_mode
from bluefoot_mpc.io.station.telemetry import Snapshot, UplinkHealth
from bluefoot_mpc.types import Mode

from .made_up import Peer, snapshot

BUILDERS = (tell.attitude, tell.position, tell.joints, tell.battery, tell.temperatures)


def over_the_line(message):
    """The message as pymavlink reads it at the other end."""
    (received,) = Peer().parse(Peer(1, 1).pack(message))
    return received


def test_attitude_is_forward_right_down():
    read = over_the_line(tell.attitude(snapshot(2.5, rpy=np.array([0.1, -0.2, 0.3]))))
    assert read.time_boot_ms == 2500
    # Ours: nose down and left are positive; MAVLink's: nose up and right.
    assert (read.roll, read.pitch, read.yaw) == pytest.approx((0.1, 0.2, -0.3))
    assert (read.rollspeed, read.pitchspeed, read.yawspeed) == pytest.approx((0.01, -0.02, -0.03))


def test_position_is_north_east_down():
    facing_left = np.array([0.0, 0.0, math.pi / 2])
    read = over_the_line(tell.position(snapshot(rpy=facing_left, position=np.array([1.0, 2.0, 0.11]))))
    assert (read.x, read.y, read.z) == pytest.approx((1.0, -2.0, -0.11))
    # 0.06 m/s forward is to the west when it faces left.
    assert (read.vx, read.vy, read.vz) == pytest.approx((-0.01, -0.06, 0.0), abs=1e-6)


def test_joints_carry_angles_contacts_and_what_is_valid():
    valid = np.ones(16, bool)
    valid[5] = False
    read = over_the_line(tell.joints(snapshot(joint_valid=valid)))
    assert read.actuator[:16] == pytest.approx(list(np.linspace(-1.0, 1.0, 16)))
    assert read.active & 0xFFFF == 0xFFFF & ~(1 << 5)
    assert read.active >> 16 & 0xF == 0b1101
    assert read.active >> 20 & 0xF == 0b1011


def test_a_missing_voltage_is_unknown_and_not_zero():
    for gone in (snapshot(voltage_valid=False), snapshot(voltage=math.nan)):
        assert over_the_line(tell.battery(gone)).voltages[0] == 0xFFFF
        assert over_the_line(tell.system(gone, UplinkHealth())).voltage_battery == 0xFFFF
    read = over_the_line(tell.battery(snapshot(voltage=10.1)))
    assert read.voltages[0] == 10100
    assert read.charge_state == mavlink.MAV_BATTERY_CHARGE_STATE_CRITICAL


def test_measured_values_are_told_as_measured():
    hot = np.full(16, 71.0)
    hot[3] = np.nan
    read = over_the_line(tell.temperatures(snapshot(joint_temperature=hot)))
    assert read.name == "temp"
    assert read.data[0] == 71.0
    assert math.isnan(read.data[3])
    assert over_the_line(tell.battery(snapshot(voltage=16.8))).voltages[0] == 16800


def test_system_status_names_what_is_ill():
    silent = np.ones(16, bool)
    silent[2] = False
    health = UplinkHealth(alive=True, loss=0.25, bad=7)
    read = over_the_line(tell.system(snapshot(joint_valid=silent), health))
    ill = read.onboard_control_sensors_present & ~read.onboard_control_sensors_health
    assert ill == mavlink.MAV_SYS_STATUS_SENSOR_MOTOR_OUTPUTS
    assert (read.load, read.drop_rate_comm, read.errors_comm) == (250, 2500, 7)
    assert (read.errors_count1, read.errors_count2) == (3, 1)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("state", STATES)
def test_the_custom_mode_goes_there_and_back(mode, state):
    for gait in GAITS:
        assert unpack_mode(pack_mode(mode, gait, state)) == (str(mode), gait, state)


def test_words_that_are_not_known_are_marked():
    assert unpack_mode(pack_mode(Mode.WALK, "gallop", "dreaming")) == ("walk", "?", "?")
    assert unpack_mode(0xFFFFFF) == ("?", "?", "?")


@pytest.mark.parametrize(
    ("mode", "state", "armed", "status"),
    [
        (Mode.WALK, "active", True, mavlink.MAV_STATE_ACTIVE),
        (Mode.OFF, "", False, mavlink.MAV_STATE_STANDBY),
        (Mode.STAND, "disarmed", False, mavlink.MAV_STATE_STANDBY),
        (Mode.SAFE, "stopping", True, mavlink.MAV_STATE_EMERGENCY),
        (Mode.STAND, "emergency", False, mavlink.MAV_STATE_EMERGENCY),
    ],
)
def test_heartbeats_tell_armed_or_not(mode, state, armed, status):
    read = over_the_line(tell.heartbeat(snapshot(mode=mode, state=state)))
    assert bool(read.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED) is armed
    assert read.system_status == status
    assert read.type == mavlink.MAV_TYPE_GROUND_QUADRUPED


def test_a_reason_against_going_on_is_critical():
    known = snapshot()
    told = Snapshot(telemetry=known.telemetry, frame=known.frame, state="sitting", reasons=("battery low",))
    assert tell.heartbeat(told).system_status == mavlink.MAV_STATE_CRITICAL


def test_the_picture_turns_everything_back():
    known, picture = snapshot(2.5), RobotPicture()
    for build in BUILDERS:
        picture.take(over_the_line(build(known)), 7.0)
    picture.take(over_the_line(tell.heartbeat(known)), 7.0)
    estimate = known.telemetry.estimate
    np.testing.assert_allclose(picture.rpy, estimate.rpy, atol=1e-6)
    np.testing.assert_allclose(picture.rates, estimate.angular_velocity, atol=1e-6)
    np.testing.assert_allclose(picture.position, estimate.position, atol=1e-6)
    np.testing.assert_allclose(picture.joints, known.frame.joint_position, atol=1e-6)
    np.testing.assert_array_equal(picture.contact, known.frame.contact)
    np.testing.assert_array_equal(picture.contact_valid, known.frame.contact_valid)
    np.testing.assert_allclose(picture.temperatures, known.frame.joint_temperature)
    assert picture.voltage == pytest.approx(11.4)
    assert (picture.mode, picture.gait, picture.state, picture.armed) == ("stand", "walk", "active", True)
    assert (picture.time, picture.age(7.5)) == (2.5, 0.5)


def test_long_texts_arrive_whole():
    text = "servo 7 (FR_knee): 66 °C is too hot: let it cool down for ten minutes, then arm again"
    messages = tell.texts(4, text, 9)
    assert len(messages) == 2
    picture = RobotPicture()
    for message in messages:
        picture.take(over_the_line(message), 1.0)
    (line,) = picture.texts
    assert line.text == text.replace("°", " deg")
    assert (line.severity, line.number) == (4, 1)
    picture.take(over_the_line(tell.texts(6, "short", 10)[0]), 2.0)
    assert [line.number for line in picture.texts] == [1, 2]


def test_a_lost_part_of_a_text_is_marked():
    first, _, last = tell.texts(4, "x" * 60 + "y" * 60, 3)
    picture = RobotPicture()
    picture.take(over_the_line(first), 1.0)
    picture.take(over_the_line(last), 1.0)
    assert "…" in picture.texts[0].text
