"""Frames: stuffing, CRC, and a parser that nothing puts out of step."""

import binascii
import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.board.framing import (
    MAX_PAYLOAD,
    Frame,
    FrameError,
    FrameParser,
    crc16,
    decode_frame,
    encode_frame,
    stuff,
    unstuff,
)


def test_errors_are_those_of_a_device():
    assert issubclass(FrameError, DeviceError)


def test_crc_is_the_published_one():
    assert crc16(b"123456789") == 0x29B1


@pytest.mark.parametrize(
    ("plain", "stuffed"),
    [
        (b"", "01"),
        (b"\0", "0101"),
        (b"\0\0", "010101"),
        (b"\x11\x22\0\x33", "0311220233"),
        (b"\x11\0\0\0", "0211010101"),
        (bytes(range(1, 255)), "ff" + bytes(range(1, 255)).hex() + "01"),
    ],
)
def test_stuffing_of_known_examples(plain, stuffed):
    assert stuff(plain).hex() == stuffed
    assert unstuff(bytes.fromhex(stuffed)) == plain


@given(st.binary(max_size=600))
def test_stuffing_leaves_no_zero_and_comes_back(data):
    assert b"\0" not in stuff(data)
    assert unstuff(stuff(data)) == data


@given(st.binary(max_size=80))
def test_any_bytes_give_a_frame_or_a_typed_error(data):
    try:
        frame = decode_frame(data)
    except FrameError:
        return
    assert encode_frame(frame.kind, frame.sequence, frame.payload)[:-1] == stuff(unstuff(data))


@given(st.integers(0, 255), st.integers(0, 255), st.binary(max_size=MAX_PAYLOAD), st.integers(1, 9))
def test_frames_come_back_in_pieces_of_any_size(kind, sequence, payload, size):
    line = encode_frame(kind, sequence, payload)
    parser = FrameParser()
    found = [frame for at in range(0, len(line), size) for frame in parser.feed(line[at : at + size])]
    assert found == [Frame(kind, sequence, payload)]
    assert (parser.frames, parser.bad, parser.lost) == (1, 0, 0)


def test_a_payload_too_long_is_refused():
    with pytest.raises(FrameError, match="at most 64"):
        encode_frame(1, 0, bytes(MAX_PAYLOAD + 1))


def test_every_single_bit_error_is_found():
    line = encode_frame(2, 7, bytes(range(16)))
    for place in range(8 * (len(line) - 1)):
        damaged = bytearray(line)
        damaged[place // 8] ^= 1 << place % 8
        assert FrameParser().feed(bytes(damaged)) == []


def test_gaps_in_the_sequence_are_counted():
    parser = FrameParser()
    for sequence in (250, 251, 254, 255, 0, 3):
        parser.feed(encode_frame(1, sequence))
    assert parser.lost == 2 + 2


def test_babble_neither_fills_the_memory_nor_hides_the_next_frame():
    parser = FrameParser()
    for _ in range(1000):
        parser.feed(b"\xaa" * 100)
    assert len(parser._rest) < 200
    assert [f.sequence for f in parser.feed(b"\0" + encode_frame(1, 5))] == [5]


def test_no_damaged_frame_of_ten_thousand_gets_through():
    chance = random.Random(5)
    parser = FrameParser()
    wanted = {}
    accepted = 0
    for number in range(10_000):
        payload = chance.randbytes(chance.randrange(20))
        line = bytearray(encode_frame(3, number & 0xFF, payload))
        wanted[number & 0xFF] = payload
        for _ in range(chance.randrange(3)):
            place = chance.randrange(len(line))
            match chance.randrange(3):
                case 0:
                    line[place] ^= 1 << chance.randrange(8)
                case 1:
                    del line[place]
                case _:
                    line.insert(place, chance.randrange(256))
            if not line:
                break
        for frame in parser.feed(bytes(line)):
            accepted += 1
            assert frame.payload == wanted[frame.sequence], binascii.hexlify(line)
    assert accepted > 2000
    assert parser.bad > 2000
