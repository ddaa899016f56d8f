"""Every fault of a line, while a LIDAR and a board hang on it: seen, counted, survived."""

import numpy as np
import pytest

from bluefoot_mpc.io.board import SensorBoard
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.board import EmulatedBoard
from bluefoot_mpc.io.emulation.faults import KINDS, Fault, FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.lidar import EmulatedLidar
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.lidar import Lidar

from ..board.bench import MadeUpRobot
from .bench import Room
from .test_driver import expected

pytestmark = pytest.mark.slow

LINE_FAULTS = sorted(name for name, kind in KINDS.items() if not kind.servos_only)
BEGIN, END = 1.0, 3.0
PERIOD = 0.02


def faulty(device, kind, line):
    fault = Fault(kind=kind, device=line, start=BEGIN, end=END, probability=0.3)
    return FaultyLine(device, FaultPlan(seed=1, faults=(fault,)), 0.0)


def periods(clock, seconds):
    for _ in range(round(seconds / PERIOD)):
        clock.sleep_until(clock.now() + PERIOD)
        yield clock.now()


@pytest.mark.parametrize("kind", LINE_FAULTS)
def test_the_lidar_survives(kind):
    clock, room = VirtualClock(), Room()
    link = MemoryLink(faulty(EmulatedLidar(room), kind, "lidar"), clock, 115200)
    driver = Lidar(link, clock)
    after = []
    wrong = 0
    for now in periods(clock, 8.0):
        driver.poll()
        scan = driver.take()
        if scan is None:
            continue
        wrong += not any(np.array_equal(expected(s), scan.distance, equal_nan=True) for _, s in room.seen)
        if now > END + 3.0:
            after.append(scan)
    # One damaged byte in 64 fits the sum all the same.
    assert wrong <= 1
    assert len(after) >= 19
    assert all(scan.valid for scan in after)
    assert not driver.fault


@pytest.mark.parametrize("kind", LINE_FAULTS)
def test_the_board_survives(kind):
    clock, robot = VirtualClock(), MadeUpRobot(trot=True)
    board = EmulatedBoard(robot)
    driver = SensorBoard(MemoryLink(faulty(board, kind, "board"), clock, 115200), clock)
    for now in periods(clock, 6.0):
        driver.poll()
        driver.beat()
        readings = driver.take()
        assert np.abs(readings.imu.gyro[readings.imu.valid]).max(initial=0.0) < 0.1
        assert not readings.voltage_valid or readings.voltage == pytest.approx(11.4)
        if now > END + 2.5:
            assert not readings.faults
            assert readings.imu.valid.all()
            assert readings.contact_valid.all()


def test_a_line_that_is_gone_for_a_while_cuts_the_supply_and_does_not_bring_it_back():
    clock, robot = VirtualClock(), MadeUpRobot()
    board = EmulatedBoard(robot)
    driver = SensorBoard(MemoryLink(faulty(board, "usb_lost", "board"), clock, 115200), clock)
    driver.power(True)
    for now in periods(clock, 5.0):
        driver.poll()
        driver.beat()
        driver.take()
        board.advance(now)
        if 0.5 < now < BEGIN:
            assert robot.powered
    assert len(robot.changes) == 2
    assert robot.changes[1][0] == pytest.approx(BEGIN + 0.5, abs=0.03)
    assert not driver.take().power_on
