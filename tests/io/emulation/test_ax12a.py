import math

import pytest

from tests.io.emulation.bench import (
    ACTION,
    ALL,
    PING,
    READ,
    REG_WRITE,
    RESET,
    SYNC_WRITE,
    WRITE,
    Bench,
    low_high,
    status,
)

VOLTAGE, ANGLE, HEAT, RANGE, SUM, OVERLOAD, INSTRUCTION = (1 << bit for bit in range(7))


@pytest.fixture
def bench():
    return Bench()


# Packets as the e-manual of Protocol 1.0 prints them, byte for byte.
def test_the_manuals_own_packets(bench):
    assert bench.send(bytes.fromhex("ffff010201fb")) == bytes.fromhex("ffff010200fc")  # ping
    bench.shafts.temperature = 32.0
    # read the temperature (43): 20 is the manual's value at 0x20 °C
    assert bench.send(bytes.fromhex("ffff0104022b01cc")) == bytes.fromhex("ffff01030020db")


def test_every_register_has_the_factorys_value(bench):
    reply = bench.ask(1, READ, 0, 50)
    table = reply[5:-1]
    assert len(table) == 50
    assert table[0:2] == bytes((12, 0))
    assert list(table[3:19]) == [1, 1, 250, 0, 0, 255, 3, 0, 70, 60, 140, 255, 3, 2, 36, 36]
    assert list(table[24:30]) == [0, 0, 1, 1, 32, 32]
    assert table[30:32] == table[36:38] == bytes((0, 2))  # goal at power-up is the present position
    assert table[34:36] == table[14:16]
    assert list(table[44:50]) == [0, 0, 0, 0, 32, 0]


@pytest.mark.parametrize(
    ("level", "ping", "read", "write"),
    [(0, True, False, False), (1, True, True, False), (2, True, True, True)],
)
def test_status_return_level(bench, level, ping, read, write):
    bench[1].write(16, level)
    assert bool(bench.ask(1, PING)) == ping
    assert bool(bench.ask(1, READ, 36, 2)) == read
    assert bool(bench.ask(1, WRITE, 25, 1)) == write
    assert bench[1].read(25) == 1


def test_return_delay_and_bytes_make_the_replys_time(bench):
    bench.ask(1, PING)
    assert bench.clock.now() == pytest.approx(6e-5 + 250 * 2e-6 + 6e-5)
    bench[1].write(5, 0)
    start = bench.clock.now()
    bench.ask(1, READ, 36, 8)
    assert bench.clock.now() - start == pytest.approx(8e-5 + 14e-5)


def test_broadcast_is_obeyed_and_never_answered(bench):
    assert bench.ask(ALL, WRITE, 25, 1) == b""
    assert [servo.read(25) for servo in bench.line.all] == [1, 1, 1]
    assert bench.ask(ALL, PING) == b""
    assert bench.ask(ALL, READ, 0, 2) == b""


def test_registered_write_waits_for_action(bench):
    assert bench.ask(1, REG_WRITE, 30, *low_high(600)) == status(1)
    assert bench.ask(1, READ, 44, 1) == status(1, 0, 1)
    assert bench[1].read(30, 2) == 512
    assert bench.ask(1, ACTION) == status(1)
    assert bench[1].read(30, 2) == 600
    assert bench.ask(1, READ, 44, 1) == status(1, 0, 0)
    assert bench.ask(1, ACTION) == status(1, INSTRUCTION)


def test_action_to_all_starts_all_together(bench):
    for identity in (1, 2):
        bench.ask(identity, REG_WRITE, 30, *low_high(600 + identity))
    assert bench.ask(ALL, ACTION) == b""
    assert [bench[i].read(30, 2) for i in (1, 2, 3)] == [601, 602, 512]


def test_sync_write_reaches_each_and_skips_who_is_missing(bench):
    data = [30, 4]
    for identity in (1, 9, 3):
        data += [identity, *low_high(500 + identity), *low_high(100)]
    assert bench.ask(ALL, SYNC_WRITE, *data) == b""
    assert [bench[i].read(30, 2) for i in (1, 2, 3)] == [501, 512, 503]
    assert [bench[i].read(32, 2) for i in (1, 2, 3)] == [100, 0, 100]
    assert bench.line.violations == 0


def test_sync_write_of_a_wrong_length_does_nothing(bench):
    bench.ask(ALL, SYNC_WRITE, 30, 2, 1, 0, 2, 2, 0)
    assert bench[1].read(30, 2) == 512
    assert bench.line.violation_kinds == {"length": 1}
    assert bench.ask(1, SYNC_WRITE, 30, 1, 1, 0) == status(1, INSTRUCTION)


def test_errors_of_instructions(bench):
    assert bench.ask(1, 0x55) == status(1, INSTRUCTION)
    assert bench.ask(1, READ, 36) == status(1, INSTRUCTION)
    assert bench.ask(1, READ, 49, 2) == status(1, RANGE)
    assert bench.ask(1, READ, 36, 0) == status(1, RANGE)
    assert bench.ask(1, WRITE, 30, *low_high(1024)) == status(1, RANGE)
    assert bench.ask(1, WRITE, 36, 1, 1) == status(1, RANGE)  # read-only
    assert bench.ask(1, WRITE, 48, 1, 1, 1) == status(1, RANGE)  # past the end
    broken = bytearray.fromhex("ffff010201fb")
    broken[-1] ^= 1
    assert bench.send(bytes(broken)) == status(1, SUM)
    assert bench.line.violation_kinds == {"checksum": 1}
    # An instruction's error is gone with the next.
    assert bench.ask(1, PING) == status(1)


def test_a_refused_write_changes_nothing(bench):
    before = bytes(bench[1].registers)
    assert bench.ask(1, WRITE, 24, 1, 1, 1, 1, 32, 32, *low_high(2000)) == status(1, RANGE)
    assert bytes(bench[1].registers) == before


def test_angle_limits_bound_the_goal(bench):
    assert bench.ask(1, WRITE, 6, *low_high(300), *low_high(700)) == status(1)
    assert bench.ask(1, WRITE, 30, *low_high(299)) == status(1, ANGLE)
    assert bench.ask(1, WRITE, 30, *low_high(701)) == status(1, ANGLE)
    assert bench.ask(1, WRITE, 30, *low_high(700)) == status(1)
    assert bench.line.eeprom_writes == 1


def test_a_goal_switches_the_torque_on_and_is_counted(bench):
    assert not bench.shafts.drives[0].enabled
    bench.ask(1, WRITE, 30, *low_high(520))
    drive = bench.shafts.drives[0]
    assert drive.enabled
    assert drive.goal == 520
    assert bench.line.goal_writes_while_off == 1
    bench.ask(1, WRITE, 30, *low_high(521))
    assert bench.line.goal_writes_while_off == 1


def test_wheel_mode(bench):
    bench.ask(1, WRITE, 6, 0, 0, 0, 0)
    assert bench.ask(1, WRITE, 32, *low_high(1024 + 300)) == status(1)
    assert bench.ask(2, WRITE, 32, *low_high(1024)) == status(2, RANGE)  # joint mode knows no direction
    bench.ask(1, WRITE, 24, 1)
    drive = bench.shafts.drives[0]
    assert drive.is_wheel
    assert drive.enabled
    assert drive.speed == 1324


def test_compliance_and_punch_reach_the_shaft(bench):
    bench.ask(1, WRITE, 26, 3, 4, 64, 127)
    bench.ask(1, WRITE, 48, *low_high(50))
    drive = bench.shafts.drives[0]
    assert drive.margin == (3, 4)
    assert drive.slope == (64, 64)  # 127 acts as 64, 128 as 128
    assert drive.punch == 50
    bench.ask(1, WRITE, 28, 128, 3)
    assert bench.shafts.drives[0].slope == (128, 2)


def test_lock_closes_the_eeprom_until_power_is_cut(bench):
    assert bench.ask(1, WRITE, 47, 1) == status(1)
    assert bench.ask(1, WRITE, 5, 0) == status(1, RANGE)
    assert bench.ask(1, WRITE, 47, 0) == status(1, RANGE)
    assert bench.ask(1, WRITE, 25, 1) == status(1)  # RAM is open
    now = bench.clock.now()
    bench.line.power(False, now)
    bench.line.power(True, now + 0.1)
    bench.wait(0.3)
    assert bench.ask(1, WRITE, 5, 0) == status(1)


def test_new_id_and_baud_hold_from_the_next_packet(bench):
    assert bench.ask(1, WRITE, 3, 7) == status(1)
    assert bench.ask(1, PING) == b""
    assert bench.ask(7, PING) == status(7)
    assert bench.ask(7, WRITE, 4, 34) == status(7)
    assert bench.ask(7, PING) == b""
    bench.line.host_baud = 57_600
    assert bench.line.servos[1].identity == 7
    assert bench.ask(7, PING) == status(7)
    assert bench.ask(2, PING) == b""


def test_reset_brings_back_the_factorys_eeprom(bench):
    bench.ask(2, WRITE, 5, 0)
    assert bench.ask(2, RESET) == status(2)
    assert bench[2].identity == 1
    assert bench[2].read(5) == 250


def test_present_values_carry_signs_in_bit_10(bench):
    shafts = bench.shafts
    shafts.angle, shafts.speed, shafts.load, shafts.voltage = math.radians(30), -1.0, 0.5, 11.14
    words = bench.ask(1, READ, 36, 8)[5:-1]
    assert int.from_bytes(words[0:2], "little") == 512 + 102
    speed = int.from_bytes(words[2:4], "little")
    assert speed & 1024
    assert speed & 1023 == round(1.0 / (0.111 * math.tau / 60))
    assert int.from_bytes(words[4:6], "little") == 512
    assert list(words[6:]) == [111, 25]
    shafts.load, shafts.angle = -1.0, math.radians(-170)
    words = bench.ask(1, READ, 36, 8)[5:-1]
    assert int.from_bytes(words[4:6], "little") == 2047
    assert words[0:2] == b"\x00\x00"


def test_voltage_out_of_limits_shows_and_does_not_shut_down(bench):
    bench.ask(1, WRITE, 30, *low_high(520))
    bench.shafts.voltage = 5.9
    assert bench.ask(1, PING) == status(1, VOLTAGE)
    assert bench.shafts.drives[0].enabled
    bench.shafts.voltage = 12.0
    assert bench.ask(1, PING) == status(1)


def test_overheating_shuts_down_until_it_is_cool_and_the_limit_rewritten(bench):
    bench.ask(1, WRITE, 30, *low_high(520))
    bench[1].forced_temperature = 71.0
    assert bench.ask(1, PING) == status(1, HEAT)
    assert bench[1].read(34, 2) == 0
    assert not bench.shafts.drives[0].enabled
    bench.ask(1, WRITE, 34, *low_high(1023))  # still hot
    assert bench[1].read(34, 2) == 0
    bench[1].forced_temperature = None
    assert bench.ask(1, PING) == status(1)
    assert not bench.shafts.drives[0].enabled  # cool, but not rewritten
    bench.ask(1, WRITE, 34, *low_high(800))
    assert bench.shafts.drives[0].enabled
    assert bench.shafts.drives[0].torque_limit == 800


def test_the_shutdown_mask_decides(bench):
    bench.ask(1, WRITE, 18, 0)
    bench.ask(1, WRITE, 30, *low_high(520))
    bench[1].forced_temperature = 71.0
    assert bench.ask(1, PING) == status(1, HEAT)
    assert bench.shafts.drives[0].enabled


def test_a_stalled_motor_becomes_an_overload_after_a_while(bench):
    bench.ask(1, WRITE, 30, *low_high(520))
    bench.shafts.load = 1.0
    bench.ask(1, PING)
    bench.wait(1.5)
    assert bench.ask(1, PING) == status(1)
    bench.wait(1.0)
    assert bench.ask(1, PING) == status(1, OVERLOAD)
    assert bench[1].read(34, 2) == 0
    bench.shafts.load = 0.0
    assert bench.ask(1, PING) == status(1, OVERLOAD)  # it shows until the limit is rewritten
    assert bench.ask(1, WRITE, 34, *low_high(900)) == status(1)
    assert bench[1].read(34, 2) == 900


def test_a_forced_overload_stays(bench):
    bench.ask(1, WRITE, 30, *low_high(520))
    bench[1].forced_overload = True
    assert bench.ask(1, PING) == status(1, OVERLOAD)
    assert bench.ask(1, WRITE, 34, *low_high(900)) == status(1, OVERLOAD)
    assert bench[1].read(34, 2) == 0
    bench[1].forced_overload = False
    assert bench.ask(1, WRITE, 34, *low_high(900)) == status(1)
    assert bench[1].read(34, 2) == 900


def test_an_overload_that_does_not_shut_down_passes(bench):
    bench.ask(1, WRITE, 18, 0)
    bench[1].forced_overload = True
    assert bench.ask(1, PING) == status(1, OVERLOAD)
    bench[1].forced_overload = False
    assert bench.ask(1, PING) == status(1)


def test_moving(bench):
    bench.ask(1, WRITE, 30, *low_high(600))
    assert bench.ask(1, READ, 46, 1) == status(1, 0, 0)
    bench.shafts.speed = 1.0
    assert bench.ask(1, READ, 46, 1) == status(1, 0, 1)
    bench.shafts.angle = (600 - 512) * math.radians(300) / 1023
    assert bench.ask(1, READ, 46, 1) == status(1, 0, 0)


def test_power_takes_the_ram_and_leaves_the_eeprom(bench):
    bench.ask(1, WRITE, 5, 0)
    bench.ask(1, WRITE, 30, *low_high(520))
    now = bench.clock.now()
    bench.line.power(False, now)
    assert not bench.shafts.drives[0].enabled
    assert bench[1].read(24) == 0
    assert bench.ask(1, PING) == b""
    bench.shafts.angle = 0.1
    bench.line.power(True, bench.clock.now())
    assert bench.ask(1, PING) == b""  # it is still starting
    bench.wait(0.1)
    assert bench.ask(1, READ, 24, 1) == status(1, 0, 0)
    assert bench[1].read(5) == 0
    assert bench[1].read(30, 2) == bench[1].read(36, 2) == 532  # round(0.1 rad / 0.293°) from the middle
    assert not bench.shafts.drives[0].enabled
