import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from tests.io.emulation.bench import (
    ALL,
    PING,
    READ,
    SYNC_WRITE,
    WRITE,
    Bench,
    StillShafts,
    low_high,
    packet,
    status,
)


@pytest.fixture
def bench():
    return Bench(16)


def test_a_control_cycle_takes_the_time_of_its_bytes(bench):
    for servo in bench.line.all:
        servo.write(5, 0)
    data = [30, 4]
    for identity in range(1, 17):
        data += [identity, *low_high(512), *low_high(100)]
    sync = packet(ALL, SYNC_WRITE, *data)
    assert len(sync) == 88
    bench.link.write(sync)
    for identity in range(1, 17):
        assert len(bench.ask(identity, READ, 36, 8)) == 14
    # 88 bytes, then sixteen times 8 out and 14 back, at 10 µs a byte.
    assert bench.clock.now() == pytest.approx((88 + 16 * 22) * 1e-5, abs=1e-9)
    assert bench.line.violations == 0


def test_pieces_make_a_packet_unless_a_tenth_of_a_second_lies_between(bench):
    request = packet(1, PING)
    bench.link.write(request[:3])
    bench.wait(0.09)
    assert bench.send(request[3:]) == status(1)
    bench.link.write(request[:3])
    bench.wait(0.11)
    assert bench.send(request[3:]) == b""
    assert bench.line.violation_kinds == {"timeout": 1, "garbage": 1}
    assert bench.send(request) == status(1)


def test_garbage_before_a_packet_does_not_matter(bench):
    assert bench.send(b"\x00\xff\x01" + packet(1, PING)) == status(1)
    assert bench.send(b"\xff" + packet(1, PING)) == status(1)  # three times FF
    assert bench.line.violation_kinds == {"garbage": 2}


def test_two_packets_at_once_are_both_obeyed(bench):
    bench.send(packet(ALL, WRITE, 25, 1) + packet(3, WRITE, 25, 0))
    assert [servo.read(25) for servo in bench.line.all[:4]] == [1, 1, 0, 1]


def test_more_than_the_receive_buffer_is_no_packet(bench):
    assert bench.send(packet(ALL, SYNC_WRITE, 24, 2, *[1, 1, 0] * 45)) == b""  # 143 bytes
    assert bench.line.servos[1].read(24) == 1
    assert bench.send(packet(ALL, SYNC_WRITE, 24, 1, *[2, 1] * 68)) == b""  # 144 bytes
    assert bench.line.servos[2].read(24) == 0
    assert bench.line.violation_kinds["length"] == 1


def test_talking_over_a_reply_garbles_it_and_is_not_heard(bench):
    bench.link.write(packet(1, READ, 36, 8))
    bench.wait(8e-5 + 500e-6 + 5e-5)  # in the middle of the reply
    bench.link.write(packet(2, WRITE, 25, 1))
    reply = bench.link.read(100, bench.clock.now() + 0.02)
    assert len(reply) == 14
    assert reply != status(1, 0, *reply[5:-1])
    assert bench.line.violation_kinds == {"collision": 1}
    assert bench.line.servos[2].read(25) == 0


def test_two_servos_with_one_id_garble_each_other(bench):
    bench.line.servos[2].write(3, 1)
    reply = bench.ask(1, PING)
    assert len(reply) == 6
    assert reply != status(1)
    assert bench.line.violation_kinds == {"overlap": 1}
    # With delays that keep them apart, both arrive.
    bench.line.servos[2].write(5, 0)
    assert bench.ask(1, PING) + bench.link.read(100, bench.clock.now() + 0.02) == 2 * status(1)


def test_a_servo_that_was_unplugged_comes_back_limp(bench):
    bench.ask(4, WRITE, 30, *low_high(600))
    servo = bench.line.servos[4]
    bench.line.plug(servo, False, bench.clock.now())
    assert not bench.shafts.drives[3].enabled
    assert bench.ask(4, PING) == b""
    assert bench.ask(5, PING) == status(5)
    bench.line.plug(servo, True, bench.clock.now())
    bench.wait(0.2)
    assert bench.ask(4, READ, 24, 1) == status(4, 0, 0)
    assert not bench.shafts.drives[3].enabled


def test_a_plug_without_power_stays_dead(bench):
    servo = bench.line.servos[4]
    bench.line.power(False, 0.1)
    bench.line.plug(servo, False, 0.2)
    bench.line.plug(servo, True, 0.3)
    bench.clock.sleep_until(1.0)
    assert bench.ask(4, PING) == b""
    bench.line.power(True, 1.1)
    bench.clock.sleep_until(2.0)
    assert bench.ask(4, PING) == status(4)


def test_eeprom_writes_are_counted(bench):
    bench.ask(1, WRITE, 24, 1)
    assert bench.line.eeprom_writes == 0
    bench.ask(1, WRITE, 5, 0)
    bench.ask(ALL, WRITE, 5, 0)
    assert bench.line.eeprom_writes == 17


def test_time_passes_for_the_shafts_while_the_host_is_silent(bench):
    bench.link.read(1, 7.0)
    assert bench.shafts.time == 7.0


@pytest.mark.parametrize(
    ("ids", "baud", "text"),
    [((), 1_000_000, "at least one"), ((254,), 1_000_000, "0..253"), ((1, 1), 1_000_000, "twice"),
     ((1,), 3_000_000, "57600"), ((1,), 0, "57600")],
)  # fmt: skip
def test_lines_that_cannot_be_are_refused(ids, baud, text):
    with pytest.raises(ConfigurationError, match=text):
        ServoLine(StillShafts(2), ids, baud)


@settings(max_examples=200, deadline=None)
@given(st.lists(st.one_of(st.binary(max_size=40), st.builds(
    packet, st.integers(0, 255), st.integers(0, 255), st.integers(0, 255), st.integers(0, 255),
    st.integers(0, 255))), max_size=12))  # fmt: skip
def test_no_bytes_break_a_line(pieces):
    bench = Bench(3)
    for piece in pieces:
        bench.link.write(piece)
        reply = bench.link.read(300, bench.clock.now() + 0.01)
        for servo in bench.line.all:
            assert 0 <= servo.read(30, 2) <= 1023
            assert len(servo.registers) == 50
        assert math.isinf(bench.line.due()) or reply
    bench.wait(1.0)
    bench.line.host_baud = 1_000_000
    for servo in bench.line.all:
        assert servo.hears(bench.clock.now())
