"""The supply through the board: on while a command works, off afterwards, whatever happens."""

import threading
import time

import pytest

from bluefoot_mpc.cli.main import main
from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.commissioning import supply as supply_module
from bluefoot_mpc.io.commissioning.ports import limp_afterwards
from bluefoot_mpc.io.commissioning.supply import ServoSupply
from bluefoot_mpc.io.emulation.board import EmulatedBoard
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.link import LinkLostError
from bluefoot_mpc.io.serial_link import SerialLink

from ..board.bench import MadeUpRobot
from .bench import Bench

pytestmark = pytest.mark.slow


class Powered(MadeUpRobot):
    """A robot whose servos live on what the board switches."""

    def __init__(self, bench):
        super().__init__()
        self.bench = bench
        bench.line.power(False, 0.0)

    def set_power(self, on):
        super().set_power(on)
        self.bench.line.power(on, self.time)


class FromZero(MonotonicClock):
    """Real time since the test began: the made-up robot samples from zero on."""

    def __init__(self):
        self.start = time.monotonic()

    def now(self):
        return time.monotonic() - self.start

    def sleep_until(self, when):
        time.sleep(max(0.0, when - self.now()))


@pytest.fixture
def robot():
    """A bench whose servos are dark until the board switches them on."""
    lock, clock = threading.RLock(), FromZero()
    bench = Bench()
    source = Powered(bench)
    board = EmulatedBoard(source)
    with (
        PtyLine(bench.line, lock=lock, clock=clock) as servos,
        PtyLine(board, baud=115_200, lock=lock, clock=clock) as line,
    ):
        bench.port, bench.board, bench.source, bench.emulated = servos.port, line.port, source, board
        yield bench


def test_servos_have_supply_while_a_command_runs(robot):
    words = ["servo", "scan", "--port", robot.port, "--ids", "1-3"]
    assert main(words) == 3
    assert main([*words, "--board", robot.board]) == 0
    assert [on for _, on in robot.source.changes if on] == [True]
    assert not robot.source.powered


def test_heartbeats_go_on_while_the_command_is_busy(robot):
    clock = MonotonicClock()
    with ServoSupply(SerialLink(robot.board, 115_200, clock), clock) as supply:
        time.sleep(1.0)  # twice the time after which the board cuts by itself
        assert robot.source.powered
        assert all(not finding.mend for finding in supply.findings())
    assert not robot.source.powered


def test_sensors_are_not_silent_because_nobody_has_listened_since_the_last_beat(robot, monkeypatch):
    monkeypatch.setattr(supply_module, "BEAT", 0.2)  # s: longer than an IMU may be silent
    clock = MonotonicClock()
    with ServoSupply(SerialLink(robot.board, 115_200, clock), clock) as supply:
        time.sleep(0.5)  # between two beats
        assert all(not finding.mend for finding in supply.findings())


def test_supply_goes_off_after_an_error(robot):
    clock = MonotonicClock()
    link = SerialLink(robot.board, 115_200, clock)

    def work():
        with ServoSupply(link, clock):
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work()
    assert not robot.source.powered


def test_a_silent_board_is_named(robot):
    robot.emulated.faults.silent = True
    clock = MonotonicClock()
    link = SerialLink(robot.board, 115_200, clock)
    with pytest.raises(DeviceError, match="does not switch the servos' supply on"):
        ServoSupply(link, clock).__enter__()


def test_a_lost_port_is_opened_again_to_switch_torque_off():
    bench = Bench(count=2)
    ports = bench.ports()
    bus = ports.buses[0]

    def work():
        with limp_afterwards(ports, [1, 2]):
            bus.write(1, "torque_enable", 1)
            bus.link.close()
            bus.read(1, "torque_enable")

    with pytest.raises(LinkLostError):
        work()
    assert bench.limp


def test_a_port_that_stays_away_is_shouted_about(monkeypatch, caplog):
    bench = Bench(count=2)
    ports = bench.ports()
    link = ports.buses[0].link
    with limp_afterwards(ports, [1, 2]):
        ports.buses[0].write(1, "torque_enable", 1)
        link.close()
        monkeypatch.setattr(link, "_hung_up", lambda _: True)
    assert "servo 1, 2: cut the servos' power" in caplog.text
