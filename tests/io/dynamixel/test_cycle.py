import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import ErrorBit, Instruction, status_packet
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.dynamixel.errors import CommandRangeError
from bluefoot_mpc.io.dynamixel.latch import Latch
from bluefoot_mpc.io.dynamixel.layout import ServoLayout, spread
from tests.io.dynamixel.fakes import FakeLine, code_count, registers

MIDDLE = np.full(16, 512.0)
SPEED = np.full(16, 100.0)
LIMIT = np.full(16, 300.0)
PERIOD = 0.02


class Rig:
    """A cycle on fake lines, with all servos armed."""

    def __init__(self, ports=1, admitted=True):
        self.clock = VirtualClock()
        self.layout = spread(ports)
        self.lines = [
            FakeLine(self.clock, [self.layout.ids[j] for j in self.layout.joints(p)]) for p in range(ports)
        ]
        latch = Latch()
        self.buses = [ServoBus(line, self.clock, latch=latch) for line in self.lines]
        self.cycle = BusCycle(self.buses, self.layout, self.clock)
        self.line, self.bus = self.lines[0], self.buses[0]
        for line in self.lines:
            for table in line.tables.values():
                table[24] = 1
                table[34:36] = b"\x2c\x01"
        if admitted:
            self.cycle.admit()
            self.step()
            self.step()
            self.step()

    def step(self, goal=MIDDLE, limit=LIMIT, budget=0.015):
        begun = self.clock.now()
        self.cycle.write(goal, SPEED, limit)
        readings = self.cycle.read(begun + budget)
        self.took = self.clock.now() - begun
        self.clock.sleep_until(begun + PERIOD)
        return readings


def silent(*servos):
    return lambda servo, reply: [] if servo in servos else [(0.0, reply)]


def test_bus_time_of_a_cycle():
    rig = Rig()
    rig.line.sent.clear()
    readings = rig.step()
    # 88 bytes, 16 times 8 + 8, and 8 + 14; 10 µs each.
    assert rig.took == pytest.approx(3.66e-3)
    assert readings.fresh.all()
    np.testing.assert_array_equal(readings.counts, 500 + np.arange(1, 17))
    assert code_count(rig.line, Instruction.READ) == 17
    assert len(rig.line.sent[0].parameters) + 6 == 88


def test_goal_and_speed_in_one_write_and_limits_only_when_they_change():
    rig = Rig()
    rig.line.sent.clear()
    sizes = []
    for limit in (LIMIT, LIMIT + 10, LIMIT + 10, LIMIT + 10, LIMIT + 10, None):
        rig.step(MIDDLE + 3, limit)
        writes = [packet for packet in rig.line.sent if packet.instruction == Instruction.SYNC_WRITE]
        sizes.append(len(writes[-1].parameters) + 6)
    # A new limit goes out three times, for nobody acknowledges it.
    assert sizes == [88, 120, 120, 120, 88, 88]
    table = rig.line.tables[7]
    assert int.from_bytes(table[30:32], "little") == 515
    assert int.from_bytes(table[32:34], "little") == 100
    assert int.from_bytes(table[34:36], "little") == 310


def test_values_that_fit_no_register_are_refused():
    rig = Rig()
    rig.line.sent.clear()
    for bad in (math.nan, math.inf, -1.0, 1024.0):
        goal = MIDDLE.copy()
        goal[5] = bad
        with pytest.raises(CommandRangeError, match="goal of joint 5"):
            rig.cycle.write(goal, SPEED)
    assert not rig.line.sent


def test_full_readings_come_in_turn():
    rig = Rig()
    for _ in range(16):
        readings = rig.step()
    np.testing.assert_array_equal(readings.temperature, 31)
    np.testing.assert_allclose(readings.voltage, 11.8)
    assert (rig.clock.now() - readings.full_times).max() < 16 * PERIOD + 1e-9


def test_measured_nonsense_stays_visible():
    rig = Rig()
    rig.line.tables[3][36:38] = b"\xff\xff"
    assert rig.step().counts[2] == 65535


def test_one_lost_reply_costs_less_than_5_ms_and_nothing_else():
    rig = Rig()
    rig.step()
    usual = rig.took
    lost = iter([5])
    rig.line.change = lambda servo, reply: [] if servo == next(lost, None) else [(0.0, reply)]
    lost = iter([0] * 4 + [5])
    readings = rig.step()
    assert readings.fresh.all()
    assert 0.001 < rig.took - usual <= 0.005
    assert rig.bus.statistics.of(5).lost == 1


def test_times_are_those_of_the_request():
    rig = Rig()
    begun = rig.clock.now()
    readings = rig.step()
    assert readings.times[0] == pytest.approx(begun + 88e-5 + 8e-5)


def test_a_dead_servo_does_not_slow_the_others():
    rig = Rig()
    rig.line.change = silent(7)
    for _ in range(6):
        readings = rig.step()
    assert readings.suspects[6]
    assert readings.suspects.sum() == 1
    assert not readings.fresh[6]
    begun, cycles = rig.clock.now(), 0
    while rig.clock.now() - begun < 3.0:
        rig.cycle.write(MIDDLE, SPEED, LIMIT)
        assert rig.cycle.read(rig.clock.now() + 0.015).fresh.sum() == 15
        cycles += 1
    assert cycles / 3.0 > 200.0
    assert rig.bus.statistics.of(7).lost <= 6 + 6 + 4  # soon, then once a second


def test_ten_percent_random_loss():
    rig = Rig()
    rng = np.random.default_rng(3)
    rig.line.change = lambda servo, reply: [] if rng.random() < 0.1 else [(0.0, reply)]
    fresh = np.mean([rig.step().fresh.mean() for _ in range(500)])
    assert fresh > 0.97
    assert not rig.step().returned.any()


@pytest.mark.parametrize("delay", [0.0035, 0.02, 0.0605])
def test_late_replies_never_pass_for_new_ones(delay):
    rig = Rig()
    rng = np.random.default_rng(4)
    rig.line.change = lambda servo, reply: [(delay if rng.random() < 0.2 else 0.0, reply)]
    for turn in range(400):
        value = 100 + turn
        for table in rig.line.tables.values():
            table[36:38] = value.to_bytes(2, "little")
        readings = rig.step(budget=0.018)
        assert (readings.counts[readings.fresh] == value).all()


def test_haste_gives_way_to_an_adapter_that_becomes_slower():
    rig = Rig()
    for _ in range(20):
        rig.step()
    rig.line.change = lambda servo, reply: [(0.0022, reply)]
    for _ in range(20):
        readings = rig.step(budget=0.06)
    lost = rig.bus.statistics.total.lost
    for _ in range(20):
        readings = rig.step(budget=0.06)
    assert readings.fresh.all()
    assert rig.bus.statistics.total.lost == lost


def test_duplicates_do_not_confuse():
    rig = Rig()
    rig.line.change = lambda servo, reply: [(0.0, reply), (0.0001, reply)]
    for turn in range(50):
        for servo, table in rig.line.tables.items():
            table[36:38] = (turn + servo).to_bytes(2, "little")
        readings = rig.step(budget=0.019)
        expected = turn + np.arange(1, 17)
        assert (readings.counts[readings.fresh] == expected[readings.fresh]).all()
    assert rig.bus.statistics.total.duplicates > 100


def test_a_second_different_reply_withdraws_the_first():
    rig = Rig()
    rig.line.change = lambda servo, reply: (
        [(0.0, reply), (0.00005, status_packet(5, 0, b"\x01\x01"))] if servo == 5 else [(0.0, reply)]
    )
    readings = rig.step()
    assert not readings.fresh[4]
    assert readings.fresh.sum() == 15


def test_a_servo_back_without_its_ram_gets_no_goal_until_armed():
    rig = Rig()
    table = rig.line.tables.pop(7)
    for _ in range(8):
        rig.step()
    rig.line.tables[7] = registers(7)
    for _ in range(120):
        readings = rig.step()
    assert readings.returned[6]
    assert readings.fresh[6]
    assert not readings.suspects[6]
    assert rig.line.tables[7][24] == 0
    rig.line.tables[7] = table
    rig.cycle.admit([6])
    readings = rig.step(MIDDLE + 9)
    assert not readings.returned.any()
    assert int.from_bytes(rig.line.tables[7][30:32], "little") == 521


@pytest.mark.parametrize("gone_for", [1, 2, 3, 7])
def test_a_short_absence_does_not_switch_torque_on_either(gone_for):
    rig = Rig()
    rig.line.tables.pop(7)
    for _ in range(gone_for):
        rig.step()
    rig.line.tables[7] = registers(7)
    for _ in range(80):
        readings = rig.step()
    assert rig.line.tables[7][24] == 0
    assert readings.returned[6]


def test_a_servo_that_was_only_silent_goes_on():
    rig = Rig()
    rig.line.change = silent(7)
    for _ in range(8):
        rig.step()
    rig.line.change = silent()
    for _ in range(60):
        readings = rig.step(MIDDLE + 4)
    assert not readings.returned.any()
    assert int.from_bytes(rig.line.tables[7][30:32], "little") == 516


def test_nothing_is_sent_before_arming_nor_when_latched():
    rig = Rig(admitted=False)
    assert not rig.cycle.write(MIDDLE, SPEED, LIMIT)
    rig.cycle.admit()
    assert rig.cycle.write(MIDDLE, SPEED, LIMIT)
    rig.bus.latch.close("test")
    assert not rig.cycle.write(MIDDLE, SPEED, LIMIT)
    assert code_count(rig.line, Instruction.SYNC_WRITE) == 1
    assert rig.step().fresh.all()


def test_the_limit_of_a_servo_that_shut_itself_off_is_not_rewritten():
    rig = Rig()
    rig.line.errors[7] = int(ErrorBit.OVERLOAD)
    rig.line.tables[7][34:36] = bytes(2)
    readings = rig.step()
    rig.line.errors.clear()
    for extra in range(1, 5):
        rig.step(limit=LIMIT + extra)
    assert readings.errors[6] == ErrorBit.OVERLOAD
    assert readings.shut[6]
    assert rig.line.tables[7][34:36] == bytes(2)
    assert int.from_bytes(rig.line.tables[8][34:36], "little") == 304


def test_a_lost_port_comes_back_without_new_arming():
    rig = Rig()
    rig.line.is_gone = True
    for _ in range(35):
        readings = rig.step()
    assert readings.lost_ports == ("fake line",)
    assert not readings.fresh.any()
    rig.line.is_gone = False
    for _ in range(8):
        readings = rig.step()
    assert readings.lost_ports == ()
    assert readings.fresh.all()
    assert not readings.returned.any()
    assert rig.cycle.takes_goals.all()


def test_a_tight_deadline_asks_everybody_in_turn():
    rig = Rig()
    seen = np.zeros(16, dtype=int)
    for _ in range(40):
        readings = rig.step(budget=0.0022)
        assert rig.took <= 0.0022 + 1e-9
        seen += readings.fresh
    assert seen.min() >= 12
    assert not readings.suspects.any()
    assert np.isfinite(readings.temperature).any()


@pytest.mark.parametrize(("ports", "longest"), [(2, 0.0021), (4, 0.0013)])
def test_several_ports_overlap(ports, longest):
    rig = Rig(ports)
    readings = rig.step()
    assert readings.fresh.all()
    np.testing.assert_array_equal(readings.counts, 500 + np.arange(1, 17))
    assert rig.took < longest


def test_a_dead_servo_on_one_of_two_ports():
    rig = Rig(2)
    rig.lines[1].change = silent(12)
    for _ in range(10):
        readings = rig.step()
    assert readings.suspects.tolist() == [joint == 11 for joint in range(16)]
    assert readings.fresh.sum() == 15


def test_layouts():
    assert spread(2).ports == (0,) * 8 + (1,) * 8
    assert spread(4).joints(3) == (12, 13, 14, 15)
    assert ServoLayout().part(6) == "servo 7 (FR_knee)"
    with pytest.raises(ConfigurationError, match="more than one joint"):
        ServoLayout(ids=(1,) * 16)
    with pytest.raises(ConfigurationError, match="1, 2"):
        spread(3)
    with pytest.raises(ConfigurationError, match="needs 2 ports"):
        BusCycle([Rig().bus], spread(2), VirtualClock())


def test_servos_that_there_was_no_time_to_ask_are_told_and_asked_first():
    rig = Rig()
    readings = rig.step(budget=0.0028)
    assert 0 < readings.put_off.sum() < 16
    np.testing.assert_array_equal(readings.put_off, ~readings.fresh)
    later = rig.step()
    assert later.fresh[readings.put_off].all()
    assert not later.put_off.any()


def test_a_servo_that_was_asked_in_vain_is_not_put_off():
    rig = Rig()
    rig.line.change = silent(7)
    readings = rig.step()
    assert not readings.fresh[6]
    assert not readings.put_off[6]
