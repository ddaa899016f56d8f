"""The supply switch: nothing but two steps and a beating heart turn it on, and everything turns it off."""

import random
from types import SimpleNamespace

import pytest

from bluefoot_mpc.io.board.framing import encode_frame
from bluefoot_mpc.io.board.messages import POWER_MAGIC, WORD, CutReason, Kind

from .bench import Bench


def test_power_goes_on_and_off():
    bench = Bench()
    assert not bench.run(0.2)[-1].power_on
    frame = bench.power_on()
    assert frame.power_on
    assert bench.robot.powered
    assert not frame.faults
    bench.driver.power(False)
    frame = bench.run(0.1)[-1]
    assert not frame.power_on
    assert not frame.faults
    assert not bench.robot.powered
    assert bench.board.supply.cut is CutReason.COMMAND
    assert bench.power_on().power_on


def test_wait_power_polls_by_itself():
    bench = Bench()
    bench.run(0.1)
    bench.driver.power(True)
    began = bench.clock.now()
    assert bench.driver.wait_power(True)
    assert bench.clock.now() - began < 0.1
    bench.driver.cut()
    assert bench.driver.wait_power(False)


def test_the_board_cuts_half_a_second_after_the_last_heartbeat_and_stays_off():
    bench = Bench()
    bench.power_on()
    last = bench.clock.now()
    bench.run(0.6, beat=False)
    assert not bench.robot.powered
    when, on = bench.robot.changes[-1]
    assert not on
    assert when - last == pytest.approx(0.5, abs=0.002)
    frame = bench.run(1.0)[-1]
    assert not frame.power_on
    assert any("no heartbeat" in text for text in frame.faults)
    assert not bench.robot.powered


def test_the_cut_comes_when_the_program_is_dead_and_nobody_reads():
    bench = Bench()
    bench.power_on()
    last = bench.clock.now()
    bench.board.advance(last + 10.0)
    assert bench.robot.changes[-1] == (pytest.approx(last + 0.5, abs=0.002), False)


def test_cut_acts_at_once():
    bench = Bench()
    bench.power_on()
    began = bench.clock.now()
    bench.driver.cut()
    bench.run(0.1)
    assert bench.robot.changes[-1][0] - began < 0.005


def test_cuts_that_are_lost_are_repeated_and_heartbeats_stop():
    bench = Bench()
    bench.power_on()
    bench.link.out = True
    bench.driver.cut()
    assert bench.robot.powered
    bench.run(0.06)
    bench.link.out = False
    bench.run(0.2)
    assert not bench.robot.powered
    assert bench.board.supply.cut is CutReason.COMMAND
    before = bench.driver.statistics.heartbeats
    bench.run(0.2)
    assert bench.driver.statistics.heartbeats == before


def test_a_board_that_is_not_heard_is_cut_all_the_same():
    bench = Bench()
    bench.power_on()
    bench.link.change = lambda data: b""
    assert not bench.run(0.34)[-1].connected
    bench.driver.cut()
    began = bench.clock.now()
    bench.board.advance(began + 0.02)
    assert bench.robot.changes[-1] == (pytest.approx(began, abs=0.005), False)


def test_power_needs_heartbeats():
    bench = Bench()
    bench.run(0.1, beat=False)
    bench.driver.power(True)
    frame = bench.run(0.8, beat=False)[-1]
    assert not frame.power_on
    assert any("no heartbeat" in text for text in frame.faults)
    assert bench.robot.changes == []
    bench.driver.power(True)
    assert bench.run(0.3)[-1].power_on


def test_a_low_battery_keeps_power_off_and_cuts_it():
    bench = Bench()
    bench.power_on()
    bench.robot.volts = 8.8
    frame = bench.run(0.5)[-1]
    assert not bench.robot.powered
    assert bench.board.supply.cut is CutReason.VOLTAGE
    assert any("battery is too low" in text for text in frame.faults)
    bench.driver.power(True)
    frame = bench.run(0.3)[-1]
    assert not frame.power_on
    assert any("charge it" in text for text in frame.faults)


def test_a_stuck_switch_is_reported():
    bench = Bench()
    bench.power_on()
    bench.board.supply.is_stuck = True
    bench.driver.cut()
    frame = bench.run(0.4)[-1]
    assert frame.power_on
    assert any("pull the battery" in text for text in frame.faults)


def test_a_board_that_does_not_answer_is_named():
    bench = Bench()
    bench.run(0.2)
    bench.board.supply.code = lambda magic, now: 1
    bench.driver._power.on_code = lambda code: []
    bench.driver.power(True)
    frame = bench.run(1.0)[-1]
    assert any("does not answer" in text for text in frame.faults)


def orders(board, *messages):
    """What the supply does after messages straight to the board."""
    now = board._tick_time
    for number, (kind, payload) in enumerate(messages):
        board.receive(encode_frame(kind, number, payload), now + 0.001 * (number + 1))
    board.advance(now + 0.02)
    return board.supply.on


GET_CODE = (Kind.GET_CODE, WORD.pack(POWER_MAGIC))
BEAT = (Kind.HEARTBEAT, b"")


def right_answer(code):
    return (Kind.POWER_ON, WORD.pack(~code & 0xFFFFFFFF))


def test_only_the_right_answer_in_time_and_only_once_switches_on():
    bench = Bench()
    board = bench.board
    bench.run(0.1)
    board.supply._random = SimpleNamespace(integers=lambda low, high: 0x12345678)
    right = right_answer(0x12345678)
    assert not orders(board, BEAT, right)
    assert not orders(board, BEAT, GET_CODE, (Kind.POWER_ON, WORD.pack(0x12345678)))
    assert not orders(board, BEAT, right)
    assert not orders(board, BEAT, (Kind.GET_CODE, WORD.pack(0)), right)
    assert not orders(board, BEAT, GET_CODE, (Kind.POWER_ON, b"\0"), (Kind.POWER_CUT, b""), right)
    assert orders(board, BEAT, GET_CODE, right)
    assert not orders(board, (Kind.POWER_CUT, b""))
    assert not orders(board, BEAT, right)


def test_a_code_grows_old():
    bench = Bench()
    bench.run(0.1)
    board = bench.board
    board.supply._random = SimpleNamespace(integers=lambda low, high: 5)
    orders(board, GET_CODE)
    board.advance(board._tick_time + 1.1)
    assert not orders(board, BEAT, right_answer(5))


def test_noise_of_a_hundred_thousand_bytes_switches_nothing_on():
    bench = Bench()
    bench.run(0.1)
    noise = random.Random(2)
    time = bench.clock.now()
    for _ in range(100):
        time += 0.01
        bench.board.receive(noise.randbytes(1000) + encode_frame(Kind.HEARTBEAT, 0), time)
        bench.board.advance(time)
    assert bench.robot.changes == []
