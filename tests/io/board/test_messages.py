"""Messages and their bytes."""

import contextlib
import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.io.board.framing import Frame
from bluefoot_mpc.io.board.messages import (
    ACCEL_UNIT,
    FIELD_UNIT,
    GYRO_UNIT,
    CutReason,
    Hello,
    ImuSample,
    Kind,
    MessageError,
    Power,
    Refusal,
    Switches,
    TimeReply,
    decode,
    encode_hello,
    encode_imu,
    encode_power,
    encode_switches,
    encode_time,
)

NAN = math.nan
counts32 = st.integers(0, 2**32 - 1)


def three(limit):
    return st.tuples(*[st.floats(-limit, limit)] * 3)


@given(counts32, three(32.0), three(160.0), st.none() | three(3.0))
def test_imu_samples_come_back_rounded(count, gyro, accel, field):
    sample = decode(Frame(Kind.IMU, 0, encode_imu(ImuSample(count, gyro, accel, field))))
    assert sample.count == count
    assert sample.gyro == pytest.approx(gyro, abs=0.5001 * GYRO_UNIT)
    assert sample.accel == pytest.approx(accel, abs=0.5001 * ACCEL_UNIT)
    if field is None:
        assert sample.magnetometer is None
    else:
        assert sample.magnetometer == pytest.approx(field, abs=0.5001 * FIELD_UNIT)


def test_what_could_not_be_measured_stays_so_and_too_much_is_the_end_of_the_range():
    payload = encode_imu(ImuSample(1, (NAN, 99.0, -99.0), (0.0, NAN, 1.0), None))
    sample = decode(Frame(Kind.IMU, 0, payload))
    assert math.isnan(sample.gyro[0])
    assert sample.gyro[1:] == pytest.approx((32.767, -32.767))
    assert math.isnan(sample.accel[1])


@given(counts32, st.tuples(*[st.booleans()] * 4), st.tuples(*[st.integers(0, 255)] * 4))
def test_switches_come_back(count, closed, edges):
    switches = Switches(count, closed, edges)
    assert decode(Frame(Kind.SWITCHES, 0, encode_switches(switches))) == switches


@given(st.floats(0.0, 65.0), st.floats(-300.0, 300.0), st.floats(-40.0, 125.0), st.sampled_from(CutReason))
def test_power_comes_back(voltage, current, temperature, cut):
    power = decode(
        Frame(Kind.POWER, 0, encode_power(Power(5, voltage, current, temperature, True, False, cut)))
    )
    assert power.voltage == pytest.approx(voltage, abs=0.00051)
    assert power.current == pytest.approx(current, abs=0.0051)
    assert power.temperature == pytest.approx(temperature, abs=0.051)
    assert (power.on, power.live, power.cut) == (True, False, cut)


def test_unknown_voltage_is_nan():
    payload = encode_power(Power(5, NAN, NAN, NAN, False, True, CutReason.COMMAND))
    power = decode(Frame(Kind.POWER, 0, payload))
    assert all(map(math.isnan, (power.voltage, power.current, power.temperature)))
    assert (power.on, power.live) == (False, True)


def test_the_short_ones_come_back():
    assert decode(Frame(Kind.TIME, 0, encode_time(TimeReply(7, 8)))) == TimeReply(7, 8)
    hello = Hello(1, (2, 3), 0xDEADBEEF, 4, True)
    assert decode(Frame(Kind.HELLO, 0, encode_hello(hello))) == hello
    assert decode(Frame(Kind.CODE, 0, struct.pack("<I", 77))) == 77
    assert decode(Frame(Kind.REFUSED, 0, b"\x04")) is Refusal.CODE


@given(st.integers(0, 255), st.binary(max_size=64))
def test_any_frame_is_a_message_or_a_typed_error(kind, payload):
    with contextlib.suppress(MessageError):
        decode(Frame(kind, 0, payload))


@pytest.mark.parametrize(
    ("kind", "payload"),
    [
        (Kind.IMU, bytes(17)),
        (Kind.SWITCHES, bytes(8)),
        (Kind.SWITCHES, struct.pack("<IB4B", 0, 0x1F, 0, 0, 0, 0)),
        (Kind.POWER, struct.pack("<IHhhBB", 0, 0, 0, 0, 0, 9)),
        (Kind.POWER, struct.pack("<IHhhBB", 0, 0, 0, 0, 4, 0)),
        (Kind.REFUSED, b"\0"),
        (Kind.REFUSED, b""),
        (Kind.HEARTBEAT, b""),
    ],
)
def test_impossible_messages_are_refused(kind, payload):
    with pytest.raises(MessageError):
        decode(Frame(kind, 0, payload))
