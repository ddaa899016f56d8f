import threading

import pytest

from bluefoot_mpc.io.dynamixel.codec import ErrorBit, Instruction, status_packet
from bluefoot_mpc.io.dynamixel.errors import (
    CorruptReplyError,
    EepromRefusedError,
    LatchedError,
    NoReplyError,
    ServoFaultError,
)
from bluefoot_mpc.io.dynamixel.table import AX12A
from tests.io.dynamixel.fakes import code_count, fake_bus


def test_ping_read_and_write():
    bus, _ = fake_bus()
    assert bus.ping(3) == 0
    assert bus.read(3, "present_position") == 503
    bus.write(3, "moving_speed", 300)
    assert bus.read(3, AX12A["moving_speed"]) == 300
    assert bus.read_block(3, 0, 2) == b"\x0c\x00"


def test_deadline_follows_from_bytes_baud_delay_and_latency():
    bus, line = fake_bus(tries=1, latency=0.001, margin=0.002, return_delay=0.0005)
    begun = line.clock.now()
    with pytest.raises(NoReplyError):
        bus.read(40, "present_position")
    # 8 bytes there, 8 back, 10 µs each, and what may be added.
    assert line.clock.now() - begun == pytest.approx(16e-5 + 0.0035)


def test_silence_names_servo_port_and_what_to_check():
    bus, _ = fake_bus()
    with pytest.raises(
        NoReplyError, match=r"servo 40 on fake line: no reply to 3 requests\. Check its cable"
    ):
        bus.ping(40)
    assert bus.statistics.of(40).lost == 3
    assert bus.statistics.of(40).retries == 2


def test_a_lost_reply_is_asked_for_again():
    bus, line = fake_bus()
    replies = iter([[], None])
    line.change = lambda servo, reply: [(0.0, reply)] if next(replies, None) is None else []
    assert bus.read(3, "present_position") == 503
    assert bus.statistics.of(3).lost == 1


@pytest.mark.parametrize("at", range(2, 8))
def test_one_wrong_byte_never_gets_through(at):
    bus, line = fake_bus(tries=1)

    def spoil(servo, reply):
        changed = bytearray(reply)
        changed[at] ^= 0x10
        return [(0.0, bytes(changed))]

    line.change = spoil
    with pytest.raises((CorruptReplyError, NoReplyError)):
        bus.read(3, "present_position")


def test_a_reply_of_another_servo_is_not_taken():
    bus, line = fake_bus(tries=1)
    line.change = lambda servo, reply: [(0.0, status_packet(9, 0, b"\x01\x02"))]
    with pytest.raises(NoReplyError):
        bus.read(3, "present_position")
    assert bus.statistics.of(3).wrong_id == 1


def test_a_short_status_is_not_taken():
    bus, line = fake_bus(tries=1)
    line.change = lambda servo, reply: [(0.0, status_packet(servo, 0, b"\x01"))]
    with pytest.raises(CorruptReplyError, match="1 bytes instead of 2"):
        bus.read(3, "present_position")


def test_garbage_around_a_reply_and_a_reply_in_pieces():
    bus, line = fake_bus()
    line.change = lambda servo, reply: [
        (0.0, b"\x00\xff\xff\xff\x03\x55" + reply[:3]),
        (0.0002, reply[3:6]),
        (0.0004, reply[6:] + b"\xff\x07"),
    ]
    for _ in range(3):
        assert bus.read(3, "present_position") == 503
    assert bus.statistics.garbage_bytes > 0


@pytest.mark.parametrize("delay", [0.004, 0.01, 0.06])
def test_a_late_reply_is_not_taken_for_a_later_one(delay):
    bus, line = fake_bus()
    lateness = iter([delay, 0.0])
    line.change = lambda servo, reply: [(next(lateness, 0.0), reply)]
    for value in range(600, 640):
        line.tables[3][36:38] = value.to_bytes(2, "little")
        assert bus.read(3, "present_position") == value
        line.clock.sleep_until(line.clock.now() + 0.0025)


def test_what_waits_before_a_request_is_not_its_answer():
    bus, line = fake_bus()
    for _ in range(3):
        line.inject(status_packet(3, 0, b"\x01\x01"), line.clock.now() + 0.001)
        line.clock.sleep_until(line.clock.now() + 0.002)
        assert bus.read(3, "present_position") == 503
    assert bus.statistics.stale_bytes == 24


def test_half_a_packet_before_a_request_does_not_swallow_its_answer():
    bus, line = fake_bus(tries=1)
    for _ in range(3):
        line.inject(b"\xff\xff\x03\x20\x00\x01", line.clock.now() + 0.001)
        line.clock.sleep_until(line.clock.now() + 0.002)
        begun = line.clock.now()
        assert bus.read(3, "present_position") == 503
        assert line.clock.now() - begun == pytest.approx(16e-5)


def test_a_late_acknowledgement_does_not_stand_for_another_write():
    bus, line = fake_bus(tries=1)
    line.change = lambda servo, reply: [(0.06, reply)]
    with pytest.raises(NoReplyError):
        bus.write(3, "moving_speed", 1)
    line.change = lambda servo, reply: []
    with pytest.raises(NoReplyError):
        bus.write(3, "torque_limit", 2)


def test_two_different_replies_are_no_reply():
    bus, line = fake_bus(tries=1)
    line.change = lambda servo, reply: [(0.0, reply + status_packet(servo, 0, b"\x01\x01"))]
    with pytest.raises(CorruptReplyError, match="two different replies"):
        bus.read(3, "present_position")


def test_babble_ends_at_the_deadline():
    bus, line = fake_bus(tries=1)
    line.change = lambda servo, reply: [(0.0, bytes(50)) for _ in range(200)]
    begun = line.clock.now()
    with pytest.raises((CorruptReplyError, NoReplyError)):
        bus.read(3, "present_position")
    assert line.clock.now() - begun < 0.005


def test_errors_of_a_servo_in_words():
    bus, line = fake_bus()
    line.errors[3] = int(ErrorBit.RANGE)
    with pytest.raises(ServoFaultError, match="out of range"):
        bus.write(3, "moving_speed", 3)
    line.errors[3] = int(ErrorBit.OVERHEATING)
    assert bus.read(3, "present_position") == 503
    assert bus.errors[3] == ErrorBit.OVERHEATING


def test_permanent_memory_is_not_written():
    bus, line = fake_bus()
    with pytest.raises(EepromRefusedError, match="permanent memory"):
        bus.write(3, "return_delay_time", 0)
    with pytest.raises(EepromRefusedError):
        bus.sync_write(AX12A["id"].address, {3: b"\x04"})
    with pytest.raises(EepromRefusedError):
        bus.broadcast("id", 7)
    assert not line.sent
    allowed, line = fake_bus(allow_eeprom=True)
    allowed.write(3, "return_delay_time", 7)
    assert line.tables[3][5] == 7


def test_nothing_that_moves_passes_a_closed_latch():
    bus, line = fake_bus()
    bus.latch.close("test")
    refused = (
        lambda: bus.write(3, "goal_position", 500),
        lambda: bus.write(3, "moving_speed", 500),
        lambda: bus.write(3, "torque_limit", 500),
        lambda: bus.write(3, "torque_enable", 1),
        lambda: bus.reg_write(3, "goal_position", 500),
        bus.action,
        lambda: bus.action(3),
        lambda: bus.broadcast("torque_enable", 1),
        lambda: bus.broadcast("goal_position", 1),
        lambda: bus.sync_write(30, {3: bytes(4)}),
        lambda: bus.sync_write(24, {3: b"\x00", 4: b"\x01"}),
        lambda: bus.sync_write(28, {3: bytes(3)}),
    )
    for move in refused:
        with pytest.raises(LatchedError, match="test"):
            move()
    assert not line.sent
    bus.broadcast("torque_enable", 0)
    bus.write(3, "torque_enable", 0)
    bus.write(3, "led", 1)
    bus.ping(3)
    assert len(line.sent) == 4
    bus.latch.release()
    bus.write(3, "goal_position", 500)


def test_no_goal_follows_an_emergency_stop_of_another_thread():
    bus, line = fake_bus()
    stop = threading.Event()

    def move():
        while not stop.is_set():
            try:
                bus.sync_write(30, {3: bytes(4)})
            except LatchedError:
                return

    thread = threading.Thread(target=move)
    thread.start()
    while code_count(line, Instruction.SYNC_WRITE) < 20:
        pass
    bus.latch.close("emergency")
    bus.broadcast("torque_enable", 0)
    thread.join(timeout=5.0)
    stop.set()
    off = next(i for i, packet in enumerate(line.sent) if packet.instruction == Instruction.WRITE)
    assert off == len(line.sent) - 1


def test_a_value_that_does_not_arrive_is_noticed():
    bus, line = fake_bus()
    bus.write_verified(3, "moving_speed", 300)
    line._store = lambda *_: None
    with pytest.raises(ServoFaultError, match="moving_speed holds 300 after 200"):
        bus.write_verified(3, "moving_speed", 200)


def test_rolling_share_of_failures():
    bus, line = fake_bus(tries=1)
    for turn in range(20):
        line.change = lambda servo, reply, turn=turn: [] if turn % 2 else [(0.0, reply)]
        if turn % 2:
            with pytest.raises(NoReplyError):
                bus.ping(3)
        else:
            bus.ping(3)
    assert bus.statistics.of(3).recent_failures == 0.5
    assert bus.statistics.total.lost == 10
