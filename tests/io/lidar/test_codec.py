"""Numbers, sums, blocks and replies, against the examples that Hokuyo published."""

import contextlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.lidar.codec import (
    checksum,
    decode_blocks,
    decode_number,
    decode_values,
    encode_blocks,
    encode_number,
    encode_values,
    with_sum,
    without_sum,
)
from bluefoot_mpc.io.lidar.errors import ScipError
from bluefoot_mpc.io.lidar.geometry import POINTS, SWEEP_END, bearings
from bluefoot_mpc.io.lidar.replies import (
    Reply,
    ReplyParser,
    distances_of,
    facts_of,
    is_same_command,
    parameters_of,
    parse_reply,
    scan_command,
    stamp_of,
)


@pytest.mark.parametrize(("value", "text"), [(1234, b"CB"), (5432, b"1Dh"), (16000000, b"m2@0")])
def test_numbers_of_the_specification(value, text):
    assert encode_number(value, len(text)) == text
    assert decode_number(text) == value


@pytest.mark.parametrize(
    ("text", "total"), [(b"00", b"P"), (b"99", b"b"), (b"02", b"R"), (b"PROT:SCIP 2.0", b"N")]
)
def test_sums_that_real_sensors_send(text, total):
    assert bytes((checksum(text),)) == total
    assert without_sum(with_sum(text)) == text


@given(st.lists(st.integers(0, 2**18 - 1), max_size=700))
def test_three_characters_come_back(values):
    text = encode_values(np.array(values, dtype=np.int64), 3)
    assert decode_values(text, 3).tolist() == values
    assert b"".join(encode_number(value, 3) for value in values) == text


@given(st.lists(st.integers(0, 2**12 - 1), max_size=700))
def test_two_characters_in_blocks_come_back(values):
    text = encode_values(np.array(values, dtype=np.int64), 2)
    lines = tuple(encode_blocks(text).split(b"\n")[:-1])
    assert decode_values(decode_blocks(lines, 2 * len(values)), 2).tolist() == values
    assert all(len(line) <= 65 for line in lines)


@pytest.mark.parametrize("value", [-1, 4096])
def test_numbers_that_do_not_fit_are_refused(value):
    with pytest.raises(ScipError):
        encode_number(value, 2)
    with pytest.raises(ScipError):
        encode_values(np.array([5, value]), 2)


@pytest.mark.parametrize("text", [b"0", b"00\x2f", b"\x70\x30\x30", b"\xff\xff\xff"])
def test_characters_outside_the_code_are_refused(text):
    with pytest.raises(ScipError):
        decode_values(text, 3)
    if len(text) == 3:
        with pytest.raises(ScipError):
            decode_number(text)


def test_bearings_run_from_right_to_left_over_239_degrees():
    degrees = np.degrees(bearings())
    assert len(degrees) == POINTS == 682
    assert degrees[0] == pytest.approx(-119.53, abs=0.01)
    assert degrees[-1] == pytest.approx(119.88, abs=0.01)
    assert degrees[384 - 44] == 0.0
    assert (np.diff(degrees) > 0).all()
    assert pytest.approx(239.8, abs=0.05) == 682 * 360 / 1024
    assert pytest.approx(0.0708, abs=1e-4) == SWEEP_END


def test_the_command_for_endless_scans():
    assert scan_command() == b"MD0044072501000"
    assert scan_command("GS", 0, 9, cluster=3) == b"GS0000000903"
    assert is_same_command(b"MD0044072501099", scan_command())
    assert not is_same_command(b"MD0044072401099", scan_command())
    assert not is_same_command(b"VV", b"PP")


VERSION = (
    b"VV\n00P\nVEND:Hokuyo Automatic Co.,Ltd.;[\nPROD:SOKUIKI Sensor URG-04LX-UG01(Simple-URG);[\n"
    b"FIRM:3.4.03(17/Dec./2012);T\nPROT:SCIP 2.0;N\nSERI:H1510998;V\n\n"
)
"""What a real sensor of the family sent."""


def test_what_a_real_sensor_sent_is_understood():
    (reply,) = ReplyParser().feed(VERSION)
    facts = facts_of(reply)
    assert facts["PROT"] == "SCIP 2.0"
    assert facts["SERI"] == "H1510998"
    for place in range(len(VERSION) - 2):
        damaged = bytearray(VERSION)
        damaged[place] ^= 0x04
        for reply in ReplyParser().feed(bytes(damaged)):
            if reply.echo == b"VV" and reply.status == "00":
                with pytest.raises(ScipError):
                    facts_of(reply)


def test_missing_parameters_are_named():
    with pytest.raises(ScipError, match="MODL"):
        parameters_of(Reply(b"PP", "00", ()))
    assert issubclass(ScipError, DeviceError)


@given(st.binary(max_size=200))
def test_any_bytes_give_replies_or_nothing(data):
    for reply in ReplyParser().feed(data + b"\n\n"):
        for reader in (stamp_of, facts_of, parameters_of):
            with contextlib.suppress(ScipError):
                reader(reply)
        with contextlib.suppress(ScipError):
            distances_of(reply, POINTS)


def test_a_reply_behind_a_broken_one_is_found():
    whole = VERSION.rstrip(b"\n")
    reply, is_clean = parse_reply(b"MD0044072501000\n99b\n0000P\nabc" + whole)
    assert reply is not None
    assert reply.echo == b"VV"
    assert not is_clean


def test_babble_does_not_fill_the_memory():
    parser = ReplyParser()
    for _ in range(1000):
        assert parser.feed(b"0" * 100) == []
    assert len(parser._rest) <= 4096
    assert [reply.echo for reply in parser.feed(b"\n\n" + VERSION)] == [b"VV"]
