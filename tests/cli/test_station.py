"""The station's operator: keys, gamepad and page behind one source; and the command in a real terminal."""

import contextlib
import json
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import termios
import time

import pytest

from bluefoot_mpc.cli.station_arguments import StationCommand
from bluefoot_mpc.cli.station_operator import PAGE_TIMEOUT, Operator
from bluefoot_mpc.cli.teleop import Teleop
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.station.config import StationConfig
from bluefoot_mpc.io.station.link import StationLink
from bluefoot_mpc.io.station.orders import Order
from bluefoot_mpc.io.station.picture import Mission, RobotPicture
from bluefoot_mpc.types import GuideTask, Mode

pytestmark = pytest.mark.slow


class Clock:
    time = 100.0

    def now(self):
        return self.time


class Link:
    """Remembers what the operator says."""

    def __init__(self):
        self.clock = Clock()
        self.motion, self.orders, self.told = None, [], []
        self.picture, self.config, self.answer = RobotPicture(), StationConfig(), ("", "")

    def steer(self, motion):
        self.motion = motion

    def order(self, order, motion):
        self.orders.append(order)
        self.motion = motion

    def ask(self, order):
        self.orders.append(order)

    def tell(self, text):
        self.told.append(text)

    def look(self, look):
        return look(self.picture)

    def result(self):
        return self.answer


class Keys:
    """A keyboard that types what it is told."""

    def __init__(self):
        self.typed, self.closed = [], False

    def read(self):
        typed, self.typed = self.typed, []
        return typed


class Pad:
    """A gamepad."""

    sticks = (0.0, 0.0, 0.0)

    def read(self):
        return self.sticks, []


class Desk:
    """An operator with everything on the desk; `later` lets time pass as the station does."""

    def __init__(self):
        self.link, self.keys, self.pad = Link(), Keys(), Pad()
        self.operator = Operator(self.link, Teleop(), self.keys, self.pad)

    def later(self, seconds=0.04, hold=None):
        for _ in range(max(1, round(seconds / 0.04))):
            self.link.clock.time += 0.04
            if hold is not None:
                self.operator.sticks(1, hold)
            self.operator.update()
        return self.link.motion


@pytest.fixture
def desk():
    return Desk()


def test_at_first_nothing_is_asked(desk):
    motion = desk.later(1.0)
    assert motion.mode is Mode.STAND
    assert desk.link.orders == []


def test_keys_drive_and_the_dead_man_stops(desk):
    desk.keys.typed = ["w", "w", "g"]
    motion = desk.later()
    assert (motion.mode, motion.velocity[0], motion.gait) == (Mode.WALK, 0.02, "walk")
    assert desk.later(4.5).velocity[0] == 0.02
    assert not desk.later(1.0).velocity.any()


@pytest.mark.parametrize(("key", "order"), [("m", Order.ARM), ("p", Order.STOP), ("0", Order.EMERGENCY)])
def test_orders_have_keys(desk, key, order):
    desk.keys.typed = ["w", key]
    motion = desk.later()
    assert desk.link.orders == [order]
    assert not motion.velocity.any()


@pytest.mark.parametrize(("key", "task"), [("v", GuideTask.WANDER), ("b", GuideTask.FOLLOW)])
def test_tasks_have_keys_and_need_no_hand(desk, key, task):
    desk.keys.typed = [key]
    motion = desk.later()
    assert (motion.mode, motion.guide.task) == (Mode.WALK, task)
    desk.link.picture.task = str(task)
    # The same order all the time, far beyond the dead man's time.
    assert desk.later(20.0).guide is motion.guide
    desk.keys.typed = [key]
    motion = desk.later()
    assert (motion.mode, motion.guide) == (Mode.STAND, None)


def test_a_hand_on_pad_keys_or_stick_ends_a_task(desk):
    for move in ("key", "stick", "pad"):
        desk.operator.task(3, "wander")
        assert desk.later().guide.task is GuideTask.WANDER
        if move == "key":
            desk.keys.typed = ["w"]
        desk.pad.sticks = (0.5 if move == "stick" else 0.0, 0.0, 0.0)
        motion = desk.later(hold=(0.5, 0.0, 0.0) if move == "pad" else None)
        assert (motion.mode, motion.guide) == (Mode.WALK, None), move
        assert motion.velocity[0] > 0.0
        desk.pad.sticks = (0.0, 0.0, 0.0)
        desk.operator.gone(1)


@pytest.mark.parametrize("order", [Order.STOP, Order.HALT, Order.SIT, Order.EMERGENCY])
def test_orders_end_a_task(desk, order):
    desk.operator.task(3, "follow")
    desk.later()
    desk.operator.order(str(order))
    assert desk.later().guide is None
    assert order in desk.link.orders


def reached(desk, number, total, state=3):
    desk.link.picture.task, desk.link.picture.mission = "goto", Mission(next=number, total=total, state=state)


def test_waypoints_are_gone_to_and_those_reached_are_left_out_later(desk):
    desk.operator.task(3, "goto")
    assert desk.later().guide is None
    assert "no waypoint" in desk.link.told[0]
    for point in ((1.0, 0.0), (2.0, 1.0)):
        desk.operator.waypoint(*point)
    desk.operator.task(3, "goto")
    assert desk.later().guide.waypoints.tolist() == [[1.0, 0.0], [2.0, 1.0]]
    reached(desk, 1, 2)
    desk.operator.waypoint(3.0, 3.0)
    account = desk.operator.account()
    assert (account["reached"], account["sent"], len(account["waypoints"])) == (1, 2, 3)
    desk.operator.task(3, "goto")
    assert desk.later().guide.waypoints.tolist() == [[2.0, 1.0], [3.0, 3.0]]
    reached(desk, 1, 2, state=5)
    assert desk.operator.account()["reached"] == 3
    # From the first on, once all are reached.
    desk.operator.task(3, "goto")
    assert len(desk.later().guide.waypoints) == 3


def test_clearing_ends_the_way(desk):
    desk.operator.waypoint(1.0, 0.0)
    desk.operator.task(3, "goto")
    desk.later()
    desk.operator.clear()
    assert desk.later().guide is None
    assert desk.link.orders == [Order.CLEAR]
    assert desk.operator.account()["waypoints"] == []


def test_what_the_robot_has_ended_is_over(desk):
    desk.operator.task(3, "wander")
    assert desk.later(5.0).guide is not None  # it has not begun yet
    desk.link.picture.task = "wander"
    assert desk.later(5.0).guide is not None
    desk.link.picture.task = ""
    assert desk.later(1.0).guide is not None
    assert desk.later(1.0).guide is None


def test_what_the_robot_never_begins_is_over(desk):
    desk.operator.task(3, "wander")
    assert desk.later(14.0).guide is not None
    assert desk.later(2.0).guide is None
    assert "does not begin" in desk.link.told[0]


def test_what_the_robot_refuses_is_over(desk):
    desk.operator.task(3, "wander")
    desk.link.answer = ("wander", "denied")
    desk.later()
    assert desk.later().guide is None


def test_a_task_ends_with_the_page_that_began_it(desk):
    desk.operator.task(3, "wander")
    desk.operator.gone(4)
    assert desk.later().guide is not None
    desk.operator.gone(3)
    assert desk.later().guide is None
    assert desk.link.orders == [Order.HALT]
    # One from the keyboard stays.
    desk.keys.typed = ["v"]
    desk.later()
    desk.operator.gone(3)
    assert desk.later().guide is not None


def test_there_is_an_end_to_waypoints(desk):
    for number in range(60):
        desk.operator.waypoint(0.1 * number, 0.0)
    assert len(desk.operator.account()["waypoints"]) == 50
    assert "50" in desk.link.told[0]


def test_a_page_drives_exactly_as_far_as_its_pad_is_moved(desk):
    motion = desk.later(0.2, hold=(0.5, -0.1, 0.02))
    assert motion.mode is Mode.WALK
    assert motion.velocity == pytest.approx([0.05, -0.004])
    assert motion.yaw_rate == pytest.approx(0.006)


def test_a_page_that_says_nothing_any_more_has_let_go(desk):
    desk.later(0.2, hold=(0.5, 0.0, 0.0))
    assert desk.later(PAGE_TIMEOUT - 0.08).velocity[0] == pytest.approx(0.05)
    motion = desk.later(0.2)
    assert not motion.velocity.any()
    assert motion.mode is Mode.STAND


def test_a_page_that_closes_has_let_go(desk):
    desk.later(0.2, hold=(0.5, 0.0, 0.0))
    desk.operator.gone(2)
    assert desk.later().velocity.any()
    desk.operator.gone(1)
    assert not desk.later().velocity.any()


def test_an_idle_page_does_not_take_the_sticks_from_a_driving_one(desk):
    desk.later(0.2, hold=(0.5, 0.0, 0.0))
    desk.operator.sticks(2, (0.0, 0.0, 0.0))
    assert desk.later(0.04, hold=(0.5, 0.0, 0.0)).velocity[0] == pytest.approx(0.05)
    desk.operator.sticks(1, (0.0, 0.0, 0.0))
    assert not desk.later().velocity.any()


def test_an_idle_page_leaves_the_keyboard_alone(desk):
    desk.keys.typed = ["w"]
    assert desk.later(0.5, hold=(0.0, 0.0, 0.0)).velocity[0] == 0.01


def test_the_gamepad_drives_when_no_page_does(desk):
    desk.pad.sticks = (1.0, 0.0, 0.0)
    assert desk.later(0.2).velocity[0] == pytest.approx(0.1)
    assert desk.later(0.2, hold=(-0.5, 0.0, 0.0)).velocity[0] == pytest.approx(-0.05)


@pytest.mark.parametrize(("order", "mode"), [("stand", Mode.STAND), ("walk", Mode.WALK), ("sit", Mode.SIT)])
def test_modes_by_button(desk, order, mode):
    desk.later(0.2, hold=(0.5, 0.0, 0.0))
    desk.operator.order(order)
    motion = desk.later()
    assert motion.mode is mode
    assert not motion.velocity.any()
    assert desk.link.orders == [Order(order)]


def test_words_that_are_no_orders_do_nothing(desk):
    desk.operator.order("explode")
    desk.operator.gait("gallop")
    assert desk.link.orders == []
    assert desk.later().gait == "trot"


def test_the_trunk_follows_its_sliders(desk):
    desk.operator.trunk((0.5, -1.0, 0.0, 0.5))
    trunk = desk.later().trunk
    limit = Teleop().config.tilt_max
    assert trunk.rpy == pytest.approx([0.5 * limit, -limit, 0.0])
    assert trunk.position[2] == pytest.approx(0.01)


def test_x_sits_down_and_ends(desk):
    desk.keys.typed = ["x"]
    assert desk.later().mode is Mode.SIT
    assert not desk.operator.ended
    desk.later(4.0)
    assert desk.operator.ended


def test_a_keyboard_that_is_gone_leaves_page_and_gamepad(desk):
    desk.keys.closed = True
    desk.later()
    assert desk.later(0.2, hold=(0.5, 0.0, 0.0)).velocity[0] == pytest.approx(0.05)
    assert not desk.operator.ended


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"robot": "hardware"}, "unknown robot"),
        ({"timeout": 0.0}, "--timeout"),
        ({"page_port": 70000}, "--page-port"),
        ({"robot": "sim", "connect": "serial:/dev/ttyUSB0:57600"}, "leave --connect out"),
        ({"world": "room"}, "add --robot sim"),
        ({"set": ("sim.camera.enabled=true",)}, "add --robot sim"),
    ],
)
def test_wrong_options_are_refused(options, complaint):
    with pytest.raises(ConfigurationError, match=complaint):
        StationCommand(**options)


class Terminal:
    """``bluefoot station`` in a terminal of its own, and the robot's end of its link."""

    def __init__(self, folder):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.log = folder / "operator.jsonl"
        self.master, self.slave = pty.openpty()
        self.before = termios.tcgetattr(self.slave)
        words = ["station", "--connect", f"udpin:127.0.0.1:{self.port}", "--no-page", "--log", str(self.log)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bluefoot_mpc.cli", *words, "--json"],
            stdin=self.slave, stdout=subprocess.PIPE, stderr=self.slave,
        )  # fmt: skip
        self.seen = b""

    def look(self):
        if select.select([self.master], [], [], 0.02)[0]:
            self.seen += os.read(self.master, 65536)

    def until(self, condition, limit=30.0):
        end = time.monotonic() + limit
        while not condition():
            self.look()
            assert time.monotonic() < end, self.seen.decode(errors="replace")

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


@contextlib.contextmanager
def at_the_terminal(folder):
    terminal = Terminal(folder)
    try:
        with StationLink(f"udp:127.0.0.1:{terminal.port}") as robot:
            terminal.until(lambda: robot.station_seen)
            yield terminal, robot
    finally:
        if terminal.process.poll() is None:
            terminal.process.kill()
            terminal.process.wait()


def motion(robot):
    return robot.command(time.monotonic())[0]


def test_keys_in_a_terminal_reach_the_robot(tmp_path):
    with at_the_terminal(tmp_path) as (terminal, robot):
        terminal.type(b"w\x1b[A")
        terminal.until(lambda: motion(robot).mode is Mode.WALK and motion(robot).velocity[0] > 0.015)
        terminal.type(b"p")
        terminal.until(lambda: robot.stop_requested)
        terminal.until(lambda: b"stop: accepted" in terminal.seen)
        terminal.type(b"x")
        status, data = terminal.end()
    assert status == 0
    assert data["log"] == str(terminal.log)
    lines = [json.loads(line) for line in terminal.log.read_text().splitlines()]
    assert len(lines) == data["lines"]
    assert any(line["kind"] == "REMARK" and line["text"] == "order: stop" for line in lines)
    assert {line["way"] for line in lines} == {"in", "out", "here"}


def test_ctrl_c_ends_the_station_and_names_the_log(tmp_path):
    with at_the_terminal(tmp_path) as (terminal, robot):
        terminal.type(b"w")
        terminal.until(lambda: motion(robot).mode is Mode.WALK)
        terminal.process.send_signal(signal.SIGINT)
        status, data = terminal.end()
        assert motion(robot).mode is Mode.STAND
    assert status == 130
    assert data["log"] == str(terminal.log)
