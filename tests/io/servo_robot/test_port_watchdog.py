"""The watchdog process on ports that are lost and opened again while it watches."""

import os
import select
import time
import tty

import pytest

from bluefoot_mpc.io.board.framing import encode_frame
from bluefoot_mpc.io.board.messages import Kind
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.safety.guard import GuardConfig
from bluefoot_mpc.io.safety.watchdog_process import TORQUE_OFF
from bluefoot_mpc.io.serial_link import WRITE_PATIENCE, SerialLink
from bluefoot_mpc.io.servo_robot.port_watchdog import PortWatchdog

PATIENCE = 20.0  # s, on a machine that others use as well


class Terminal:
    """A pseudo-terminal; its port is a link that can be led to another one."""

    def __init__(self, name):
        self.name, self.far = name, -1
        self.plug_in()

    def plug_in(self):
        self.far, near = os.openpty()
        tty.setraw(near)
        self.name.unlink(missing_ok=True)
        self.name.symlink_to(os.ttyname(near))
        os.close(near)

    def hears(self, packet):
        data, end = b"", time.monotonic() + PATIENCE
        while packet not in data and time.monotonic() < end:
            if select.select([self.far], [], [], 0.05)[0]:
                data += os.read(self.far, 4096)
        return packet in data


@pytest.fixture
def robot(tmp_path):
    servos, board = Terminal(tmp_path / "servos"), Terminal(tmp_path / "board")
    clock = MonotonicClock()
    links = [SerialLink(str(servos.name), 1_000_000, clock), SerialLink(str(board.name), 115_200, clock)]
    watchdog = PortWatchdog(links[:1], links[1])
    yield servos, board, links, watchdog
    watchdog.close()
    for link in links:
        link.close()
    for terminal in (servos, board):
        os.close(terminal.far)


def open_ports(pid):
    """Files of terminals that a process holds."""
    folder = f"/proc/{pid}/fd"
    held = []
    for name in os.listdir(folder):
        path = os.readlink(f"{folder}/{name}")
        if path.startswith("/dev/pts/"):
            held.append(path)
    return sorted(held)


def settles(condition):
    end = time.monotonic() + PATIENCE
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    return condition()


def test_a_port_is_opened_again_although_the_watchdog_holds_it(robot):
    _, _, links, watchdog = robot
    for link in links:
        link.reopen()
    assert watchdog.beat()
    names = sorted(os.path.realpath(link.name) for link in links)
    # Nothing of the old descriptors stays: neither the program's nor the watchdog's.
    assert settles(lambda: [p for p in open_ports(watchdog.pid) if p in names] == names)


def test_a_lost_port_is_let_go_so_that_the_adapter_gets_its_name_back(robot):
    _, board, links, watchdog = robot
    old = os.path.realpath(board.name)
    assert old in open_ports(watchdog.pid)
    links[1].close()
    assert watchdog.beat()
    assert settles(lambda: old not in open_ports(watchdog.pid))


def test_ports_that_came_back_are_switched_off_when_the_program_falls_silent(robot):
    servos, board, links, watchdog = robot
    for terminal, link in zip((servos, board), links, strict=True):
        link.close()
        watchdog.beat()
        os.close(terminal.far)
        terminal.plug_in()
        link.reopen()
    assert watchdog.beat()
    assert servos.hears(TORQUE_OFF)
    assert board.hears(encode_frame(Kind.POWER_CUT, 0))


def test_two_ports_that_hang_are_given_up_before_the_program_is():
    assert GuardConfig().off_after > 2.0 * WRITE_PATIENCE
