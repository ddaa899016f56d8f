"""Control table, units and latch: the data that everything else rests on."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.io.dynamixel import units
from bluefoot_mpc.io.dynamixel.codec import Instruction, instruction_packet, sync_write_packet, write_packet
from bluefoot_mpc.io.dynamixel.latch import Latch, could_move, eeprom_address
from bluefoot_mpc.io.dynamixel.table import AX12A, RAM_START, Access, Area


def test_table_is_in_order_and_does_not_overlap():
    for one, next_ in itertools.pairwise(AX12A):
        assert one.end <= next_.address
    assert AX12A.size == 50
    for register in AX12A:
        assert (register.area is Area.EEPROM) == (register.address < RAM_START)
        assert register.size in {1, 2}
        assert 0 <= register.low <= register.high < 1 << 8 * register.size
        assert register.default is None or register.low <= register.default <= register.high


def test_what_is_measured_is_read_only():
    read_only = {register.name for register in AX12A if register.access is Access.READ}
    assert {"model_number", "firmware_version", "registered", "moving"} <= read_only
    assert all(name.startswith("present_") == (name in read_only) for name in _names_from(30, 44))


def _names_from(start, end):
    return [register.name for register in AX12A if start <= register.address < end]


def test_values_and_names():
    goal = AX12A["goal_position"]
    assert goal.encode(1023) == b"\xff\x03"
    assert goal.decode(b"\x00\xff\x03", 29) == 1023
    with pytest.raises(ValueError, match=r"goal_position = 1024 must lie in 0\.\.1023"):
        goal.encode(1024)
    with pytest.raises(UnknownNameError, match="goal_position"):
        AX12A["goal_positio"]


def test_units_of_the_data_sheet():
    assert units.angle_from_counts(512) == 0.0
    assert math.degrees(units.angle_from_counts(513)) == pytest.approx(0.293, abs=5e-4)
    assert units.counts_from_angle(units.angle_from_counts(700)) == 700
    assert units.speed_from_register(1) * 60.0 / (2.0 * math.pi) == pytest.approx(0.111)
    assert units.speed_from_register(1024 + 9) == -units.speed_from_register(9)
    assert units.load_from_register(1023) == 1.0
    assert units.load_from_register(2047) == -1.0
    assert units.voltage_from_register(118) == pytest.approx(11.8)
    assert units.baud_from_register(1) == 1e6
    assert units.register_from_baud(57_600) == 34
    assert units.delay_from_register(250) == pytest.approx(500e-6)
    assert units.register_from_torque_limit(0.5) == 512


def test_a_small_speed_does_not_become_no_limit():
    assert units.register_from_speed(0.0) == 0
    assert units.register_from_speed(1e-6) == 1
    assert units.register_from_speed(100.0) == 1023


@given(st.integers(-1023, 1023))
def test_direction_bit(count):
    assert units.signed(units.unsigned(count)) == count


def test_measured_nonsense_is_not_clipped():
    assert units.angle_from_counts(65535) > 100.0


@given(st.integers(0, 49), st.binary(min_size=1, max_size=20), st.booleans())
def test_what_could_move(address, data, registered):
    data = data[: 50 - address]
    touched = range(address, address + len(data))
    enables = 24 in touched and data[24 - address] != 0
    moves = enables or bool(set(touched) & set(range(30, 36)))
    assert could_move(write_packet(1, address, data, registered=registered)) == moves
    assert could_move(write_packet(254, address, data)) == moves
    assert could_move(sync_write_packet(address, {1: data, 2: data})) == moves
    assert could_move(sync_write_packet(address, {1: bytes(len(data)), 2: data})) == moves


def test_other_instructions():
    assert not could_move(instruction_packet(1, Instruction.PING))
    assert not could_move(instruction_packet(1, Instruction.READ, b"\x24\x02"))
    for code in (Instruction.ACTION, Instruction.RESET, 0x92):
        assert could_move(instruction_packet(254, code))


def test_permanent_memory():
    assert eeprom_address(write_packet(1, 3, b"\x07")) == 3
    assert eeprom_address(write_packet(1, 20, bytes(12))) == 20
    assert eeprom_address(write_packet(1, 24, b"\x00")) is None
    assert eeprom_address(instruction_packet(1, Instruction.RESET)) == 3
    assert eeprom_address(instruction_packet(1, Instruction.READ, b"\x03\x01")) is None


def test_latch_keeps_its_first_reason():
    latch = Latch()
    assert not latch.closed
    latch.close("one")
    latch.close("two")
    assert latch.closed
    assert latch.reason == "one"
    latch.release()
    assert not latch.closed
    assert Latch(closed=True).reason == "never armed"
