"""The cycle against the project's emulator: every fault of the line, and pseudo-terminals in real time."""

import numpy as np
import pytest

from bluefoot_mpc.io.clock import MonotonicClock, VirtualClock
from bluefoot_mpc.io.dynamixel.arming import arm, torque_off
from bluefoot_mpc.io.dynamixel.bus import BusConfig, ServoBus
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.dynamixel.latch import Latch
from bluefoot_mpc.io.dynamixel.layout import ServoLayout, spread
from bluefoot_mpc.io.emulation.faults import Fault, FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.io.serial_link import SerialLink

pytestmark = pytest.mark.slow

LAYOUT = ServoLayout()
PERIOD, BUDGET = 0.02, 0.016
SPEED, LIMIT = np.zeros(16), np.full(16, 600.0)


def servos(ids=LAYOUT.ids):
    line = ServoLine(OwnShafts(len(ids)), ids)
    for servo in line.all:
        servo.write(5, 0)
    return line


class Robot:
    """Armed servos in memory; a fault begins at 1.5 s."""

    def __init__(self, *faults):
        self.clock = VirtualClock()
        self.line = servos()
        link = MemoryLink(FaultyLine(self.line, FaultPlan(faults=faults, seed=5)), self.clock)
        self.bus = ServoBus(link, self.clock)
        self.cycle = BusCycle([self.bus], LAYOUT, self.clock)
        arm([self.bus], LAYOUT, 0.6)
        self.cycle.admit()
        self.clock.sleep_until(1.0)
        self.longest, self.turn, self.wrong = 0.0, 0, 0

    def run(self, seconds):
        """Share of fresh readings; what is fresh must be what the servo has."""
        fresh = []
        for _ in range(round(seconds / PERIOD)):
            begun = self.clock.now()
            self.turn += 1
            goal = 512.0 + np.rint(40.0 * np.sin(0.1 * self.turn + np.arange(16.0)))
            self.cycle.write(goal, SPEED, LIMIT)
            self.readings = self.cycle.read(begun + BUDGET)
            self.longest = max(self.longest, self.clock.now() - begun)
            held = np.array([servo.read(36, 2) for servo in self.line.all])
            # 60 ms at full speed are 70 counts: what is older shows.
            self.wrong += int(np.sum(np.abs(held - self.readings.counts)[self.readings.fresh] > 12))
            fresh.append(self.readings.fresh.mean())
            self.clock.sleep_until(begun + PERIOD)
        return float(np.mean(fresh))


@pytest.mark.parametrize(
    ("kind", "least"),
    [
        ("drop_reply", 0.97),
        ("corrupt_reply", 0.97),
        ("bad_checksum", 0.98),
        ("truncate_reply", 0.97),
        ("wrong_length", 0.97),
        ("wrong_id", 0.97),
        ("duplicate_reply", 1.0),
        ("late_reply", 0.97),
        ("garbage", 1.0),
        ("split_reply", 0.97),
        ("short_status", 0.98),
        ("range_error", 0.98),
        ("drop_request", 0.97),
        ("corrupt_request", 0.85),  # a servo that takes a wrong length for right swallows what follows
        ("corrupt_sync_write", 0.97),
    ],
)
def test_a_tenth_of_all_packets_spoilt(kind, least):
    robot = Robot(Fault(kind=kind, start=1.5, probability=0.1))
    assert robot.run(2.0) >= least
    assert robot.wrong == 0
    assert robot.longest <= BUDGET + 1e-9
    assert not robot.readings.returned.any()
    assert robot.line.eeprom_writes == 0


@pytest.mark.parametrize(
    "fault",
    [
        Fault(kind="babble", start=1.5, end=2.0),
        Fault(kind="stall", start=1.5),
        Fault(kind="usb_lost", start=1.5),
        Fault(kind="drop_reply", start=1.5, end=2.0),
        Fault(kind="late_reply", start=1.5, end=2.0),
        Fault(kind="latency_timer", start=1.5, end=2.0),
        Fault(kind="babble", start=1.5, end=1.6),
    ],
    ids=lambda fault: fault.kind,
)
def test_the_line_fails_and_recovers_without_new_arming(fault):
    robot = Robot(fault)
    robot.run(1.7)
    assert robot.wrong == 0
    assert robot.longest <= BUDGET + 1e-9
    assert robot.run(0.4) == 1.0
    assert not robot.readings.returned.any()
    assert robot.cycle.takes_goals.all()


def test_unplugged_in_stance_and_plugged_in_again():
    robot = Robot(Fault(kind="unplugged", servo=7, start=1.5, end=2.5))
    robot.run(4.0)
    assert robot.readings.returned.tolist() == [joint == 6 for joint in range(16)]
    assert robot.readings.fresh.all()
    assert robot.line.servos[7].read(24) == 0
    arm([robot.bus], LAYOUT, 0.6, joints=[6])
    robot.cycle.admit([6])
    robot.run(0.2)
    assert robot.line.servos[7].read(24) == 1
    assert not robot.readings.returned.any()


def test_brown_out_leaves_all_limp_until_armed():
    robot = Robot(Fault(kind="brown_out", start=1.5, end=1.8))
    robot.run(2.0)
    assert robot.readings.returned.all()
    assert not any(servo.read(24) for servo in robot.line.all)


def test_heat_and_overload_show_as_they_are():
    robot = Robot(
        Fault(kind="temperature", servo=3, start=1.5), Fault(kind="overload", servo=5, start=1.5, end=2.0)
    )
    robot.run(1.6)
    assert robot.readings.temperature[2] == 75
    assert robot.readings.errors[2] == 4
    assert robot.readings.shut.nonzero()[0].tolist() == [2, 4]
    # The overload is over, and yet the servo is not switched on again.
    assert robot.line.servos[5].read(34, 2) == 0


def test_a_corrupted_torque_limit_is_mended():
    robot = Robot(Fault(kind="corrupt_sync_write", start=1.5, nth=1))
    robot.run(0.48)
    robot.cycle.write(np.full(16, 512.0), SPEED, LIMIT)
    for _ in range(4):
        robot.cycle.write(np.full(16, 512.0), SPEED, np.full(16, 200.0))
        robot.cycle.read(robot.clock.now() + BUDGET)
        robot.clock.sleep_until(robot.clock.now() + PERIOD)
    assert [servo.read(34, 2) for servo in robot.line.all] == [200] * 16


@pytest.mark.parametrize("ports", [1, 2, 4])
def test_pseudo_terminals_in_real_time(ports):
    layout, clock, latch = spread(ports), MonotonicClock(), Latch()
    lines = [servos([layout.ids[joint] for joint in layout.joints(port)]) for port in range(ports)]
    terminals = [PtyLine(line) for line in lines]
    # Threads of one process take turns: wait longer than on a real line.
    config = BusConfig(margin=0.1)
    links = [SerialLink(terminal.port, 1_000_000, clock) for terminal in terminals]
    buses = [ServoBus(link, clock, config, latch) for link in links]
    try:
        arm(buses, layout, 0.5)
        cycle = BusCycle(buses, layout, clock)
        cycle.admit()
        for _ in range(10):
            assert cycle.write(np.full(16, 530.0), SPEED, LIMIT)
            readings = cycle.read(clock.now() + 2.0)
        assert readings.fresh.all()
        assert np.abs(readings.counts - 512.0).max() < 30.0
        latch.close("test")
        assert not cycle.write(np.full(16, 500.0), SPEED, LIMIT)
        assert torque_off(buses, layout)[0].severity is Severity.OK
    finally:
        for bus in buses:
            bus.close()
        for terminal in terminals:
            terminal.close()
    assert not any(servo.read(24) for line in lines for servo in line.all)
    assert not any(line.violations for line in lines)


def test_a_terminal_that_hangs_up_and_comes_back(tmp_path):
    clock, port = MonotonicClock(), tmp_path / "servos"
    plan = FaultPlan(faults=(Fault(kind="usb_lost", start=0.3, value=0.3),))
    line = servos()
    with PtyLine(FaultyLine(line, plan, clock.now()), link=port) as terminal:
        bus = ServoBus(SerialLink(terminal.port, 1_000_000, clock), clock, BusConfig(margin=0.1))
        cycle = BusCycle([bus], LAYOUT, clock)
        begun, lost = clock.now(), 0
        readings = cycle.read(clock.now() + 1.0)
        while clock.now() - begun < 5.0 and not (lost and readings.fresh.all()):
            readings = cycle.read(clock.now() + 1.0)
            lost += bool(readings.lost_ports)
            clock.sleep_until(clock.now() + 0.01)
        bus.close()
    assert lost > 2
    assert readings.fresh.all()
    assert bus.statistics.reopened >= 1
