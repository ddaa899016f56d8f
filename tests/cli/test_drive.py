"""Driving: keys through a terminal into commands, in real time, and everything tidy afterwards."""

import io
import json
import os
import pty
import select
import signal
import subprocess
import sys
import termios
import time

import pytest

from bluefoot_mpc.cli import drive
from bluefoot_mpc.cli.gamepad import Gamepad
from bluefoot_mpc.cli.teleop import Teleop, TeleopState
from bluefoot_mpc.types import Mode


class Keys:
    """A keyboard that types one list per look."""

    def __init__(self, *looks):
        self.looks = list(looks)
        self.closed = False

    def read(self):
        return self.looks.pop(0) if self.looks else []


@pytest.fixture
def session(tmp_path):
    def make(*looks, limit=100.0):
        screen = io.StringIO()
        keys = Keys(*looks)
        made = drive.Session(
            teleop=Teleop(),
            keyboard=keys,
            gamepad=Gamepad(tmp_path / "none"),
            state=TeleopState(),
            limit=limit,
            screen=screen,
        )
        return made, keys, screen

    return make


def test_keys_become_commands_at_once_and_last(session):
    source, _, _ = session([], ["w", "g"])
    assert source(0.0).mode is Mode.STAND
    assert source(0.02).velocity[0] == 0.01
    later = source(0.04)
    assert (later.mode, later.velocity[0], later.gait) == (Mode.WALK, 0.01, "walk")


def test_help_and_status_go_to_the_screen(session):
    source, _, screen = session(["h"])
    source(0.0)
    assert "trot or walk" in screen.getvalue()
    for tick in range(1, 51):
        source(0.02 * tick)
    lines = screen.getvalue().count("mm/s")
    assert lines == pytest.approx(1.0 / drive.STATUS_PERIOD, abs=1)


def test_a_closed_terminal_ends_the_drive_sitting(session):
    source, keys, _ = session(["w"])
    source(0.0)
    keys.closed = True
    assert source(0.02).mode is Mode.SIT
    assert source(30.0) is None


def test_the_drive_ends_at_its_limit(session):
    source, _, _ = session(limit=5.0)
    assert source(4.98).mode is Mode.STAND
    assert source(5.0).mode is Mode.SIT
    assert source(20.0) is None


class Terminal:
    """``bluefoot drive`` in a terminal of its own."""

    def __init__(self, folder):
        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        words = [
            "-m",
            "bluefoot_mpc.cli",
            "drive",
            "--no-view",
            "--no-report",
            "--json",
            "--out",
            str(folder),
        ]
        self.process = subprocess.Popen(
            [sys.executable, *words], stdin=self.slave, stdout=subprocess.PIPE, stderr=self.slave
        )
        self.seen = b""

    def until(self, words, limit=60.0):
        end = time.monotonic() + limit
        while words not in self.seen and time.monotonic() < end:
            self.look()
        assert words in self.seen, self.seen.decode(errors="replace")

    def look(self):
        if select.select([self.master], [], [], 0.1)[0]:
            self.seen += os.read(self.master, 65536)

    def type(self, keys):
        os.write(self.master, keys)

    def end(self):
        """(exit status, what --json printed), after the process has ended by itself."""
        while self.process.poll() is None:
            self.look()
        out = self.process.stdout.read()
        self.process.stdout.close()
        assert termios.tcgetattr(self.slave) == self.before
        os.close(self.slave)
        os.close(self.master)
        return self.process.returncode, json.loads(out)


@pytest.mark.slow
def test_a_drive_from_the_keyboard(tmp_path):
    terminal = Terminal(tmp_path)
    terminal.until(b"stand trot")
    terminal.type(b"w\x1b[Aw")
    terminal.until(b"walk  trot   +30")
    terminal.type(b"g")
    terminal.until(b"walk  walk   +30")
    terminal.type(b"x")
    terminal.until(b"sitting down")
    status, data = terminal.end()
    assert status == 0
    assert not data["fell"]
    assert data["real_time_factor"] < 1.2
    assert (tmp_path / "log.mcap").is_file()


@pytest.mark.slow
def test_ctrl_c_sits_down_keeps_the_log_and_ends_with_130(tmp_path):
    terminal = Terminal(tmp_path)
    terminal.until(b"stand trot")
    terminal.process.send_signal(signal.SIGINT)
    status, data = terminal.end()
    assert status == 130
    assert data["stop_reason"] == "interrupted"
    assert (tmp_path / "log.mcap").is_file()
