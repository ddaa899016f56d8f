"""A gamepad's event stream, from a pipe in place of the device."""

import os
import struct

import pytest

from bluefoot_mpc.cli.gamepad import Gamepad, decode_events


def event(kind, number, value, time=0):
    return struct.pack("<IhBB", time, value, kind, number)


@pytest.fixture
def pipe(tmp_path):
    path = tmp_path / "js0"
    os.mkfifo(path)
    gamepad = Gamepad(path)
    assert gamepad.open()
    writer = os.open(path, os.O_WRONLY)
    yield gamepad, writer
    gamepad.close()
    os.close(writer)


def test_events_with_the_initial_flag_count_and_a_partial_one_does_not():
    data = event(0x82, 1, -32767) + event(0x01, 0, 1) + b"\x00\x01"
    assert list(decode_events(data)) == [(2, 1, -32767), (1, 0, 1)]


def test_sticks_and_buttons(pipe):
    gamepad, writer = pipe
    assert gamepad.read() == ((0.0, 0.0, 0.0), [])
    os.write(writer, event(2, 1, -32767) + event(2, 0, 32767) + event(2, 3, -32767))
    os.write(writer, event(1, 0, 1) + event(1, 0, 0) + event(1, 7, 1) + event(1, 9, 1))
    assert gamepad.read() == ((1.0, -1.0, 1.0), ["g", "x"])
    assert gamepad.read() == ((1.0, -1.0, 1.0), [])


def test_closing_centres_the_sticks(pipe):
    gamepad, writer = pipe
    os.write(writer, event(2, 1, -32767))
    assert gamepad.read()[0][0] == 1.0
    gamepad.close()
    gamepad.close()
    assert gamepad.read() == ((0.0, 0.0, 0.0), [])


def test_a_missing_device_is_no_error(tmp_path):
    gamepad = Gamepad(tmp_path / "js7")
    assert not gamepad.open()
    assert gamepad.read() == ((0.0, 0.0, 0.0), [])
