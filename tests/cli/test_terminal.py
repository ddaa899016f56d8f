"""Keys from a terminal, and the terminal as it was afterwards."""

import os
import pty
import signal
import subprocess
import sys
import termios
import textwrap
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.cli.terminal import Keyboard, decode_keys, raw_terminal
from bluefoot_mpc.exceptions import ConfigurationError


def test_letters_space_and_arrows():
    data = b"wG \x1b[A\x1b[B\x1bOC\x1b[D?"
    assert decode_keys(data) == (["w", "g", "space", "up", "down", "right", "left", "?"], b"")


def test_function_keys_modifiers_and_control_characters_mean_nothing():
    assert decode_keys(b"\x1b[15~\x1b[1;5A\x01\x00\xc3\xa4q") == (["up", "q"], b"")


@pytest.mark.parametrize("start", [b"\x1b", b"\x1b[", b"\x1b[1;"])
def test_the_start_of_a_sequence_is_kept(start):
    assert decode_keys(b"w" + start) == (["w"], start)


@given(data=st.binary(max_size=40), cut=st.integers(0, 40))
def test_where_the_stream_is_cut_does_not_matter(data, cut):
    first, rest = decode_keys(data[:cut])
    second, end = decode_keys(rest + data[cut:])
    assert (first + second, end) == decode_keys(data)


@pytest.fixture
def terminal(monkeypatch):
    master, slave = pty.openpty()
    with os.fdopen(slave, "r") as stream:
        monkeypatch.setattr("sys.stdin", stream)
        yield master, slave
    os.close(master)


def test_keys_come_at_once_and_the_terminal_is_restored(terminal):
    master, slave = terminal
    before = termios.tcgetattr(slave)
    with raw_terminal() as descriptor:
        assert not termios.tcgetattr(slave)[3] & (termios.ECHO | termios.ICANON)
        keyboard = Keyboard(descriptor)
        assert keyboard.read() == []
        os.write(master, b"w\x1b[A")
        assert keyboard.read() == ["w", "up"]
    assert termios.tcgetattr(slave) == before


def test_a_lone_escape_key_does_not_swallow_the_next_letter(terminal):
    master, _ = terminal
    with raw_terminal() as descriptor:
        keyboard = Keyboard(descriptor)
        os.write(master, b"\x1b")
        keyboard.read()
        keyboard.read()
        os.write(master, b"w")
        assert keyboard.read() == ["w"]


def test_a_closed_terminal_is_noticed(monkeypatch):
    master, slave = pty.openpty()
    keyboard = Keyboard(slave)
    os.close(master)
    assert keyboard.read() == []
    assert keyboard.closed
    os.close(slave)


def test_the_terminal_is_restored_after_an_error(terminal):
    _, slave = terminal
    before = termios.tcgetattr(slave)
    with pytest.raises(RuntimeError, match="broken"), raw_terminal():
        raise RuntimeError("broken")
    assert termios.tcgetattr(slave) == before


def test_no_terminal_is_refused(monkeypatch):
    with open(os.devnull) as nothing:
        monkeypatch.setattr("sys.stdin", nothing)
        with pytest.raises(ConfigurationError, match="no terminal"), raw_terminal():
            pass


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_the_terminal_is_restored_after_a_signal(number):
    master, slave = pty.openpty()
    before = termios.tcgetattr(slave)
    script = """
        import time
        from bluefoot_mpc.cli.terminal import raw_terminal
        with raw_terminal():
            print("ready", flush=True)
            time.sleep(30)
    """
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script)],
        stdin=slave,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    )
    assert process.stdout.readline() == b"ready\n"
    assert termios.tcgetattr(slave) != before
    time.sleep(0.05)
    process.send_signal(number)
    assert process.wait(20) != 0
    process.stdout.close()
    assert termios.tcgetattr(slave) == before
    os.close(slave)
    os.close(master)
