"""The driver against the emulated board: data, times, faults of the sensors and of the line."""

import threading

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.board import BoardConfig
from bluefoot_mpc.io.board.framing import encode_frame
from bluefoot_mpc.io.board.messages import ImuSample, Kind, encode_imu
from bluefoot_mpc.io.emulation.board import BoardTimes
from bluefoot_mpc.io.findings import Severity

from .bench import GRAVITY, Bench


def after_start(bench):
    bench.run(0.3)
    return bench


def test_every_sample_arrives_once_with_its_own_time_and_value():
    bench = after_start(Bench())
    bench.robot.taken.clear()
    frames = bench.run(2.0)
    bench.run(0.02)
    for name in ("gyro", "accel", "magnetometer"):
        sent = np.concatenate([getattr(batch, name) for batch in bench.robot.taken])
        got = np.concatenate([getattr(frame.imu, name) for frame in frames])
        start = next(
            k for k in range(8) if np.allclose(sent[: len(got) - k], got[k:], atol=3e-3, equal_nan=True)
        )
        assert start <= 4
    times = np.concatenate([frame.imu.time for frame in frames])
    assert np.allclose(times / 0.005, np.rint(times / 0.005), atol=2e-3)
    assert np.allclose(np.diff(times), 0.005, atol=1e-5)
    assert all(frame.imu.valid.all() and not frame.faults for frame in frames)
    assert [len(frame.imu.time) for frame in frames[1:]] == [4] * 99
    assert frames[-1].imu.accel.mean(axis=0) == pytest.approx(GRAVITY, abs=0.3)
    assert frames[-1].voltage == pytest.approx(11.4)
    assert frames[-1].current == pytest.approx(2.5)
    assert frames[-1].voltage_valid
    assert frames[-1].contact_valid.all()
    statistics = frames[-1].statistics
    assert (statistics.bad_frames, statistics.lost_frames, statistics.time_jumps) == (0, 0, 0)


@pytest.mark.parametrize("offset", [0.0, 1234.5, 4294.9672])
def test_times_hold_with_a_clock_that_drifts_and_wraps(offset):
    bench = after_start(Bench(times=BoardTimes(clock_offset=offset, clock_drift=1e-4)))
    frames = bench.run(20.0)
    times = np.concatenate([frame.imu.time for frame in frames])
    # 100 millionths over the window of 5 s are half a millisecond.
    assert np.abs(times - np.rint(times / 0.005) * 0.005).max() < 0.0007
    assert all(frame.imu.valid.all() for frame in frames)
    assert frames[-1].statistics.time_jumps == 0


def test_foot_switches_come_with_their_time():
    bench = after_start(Bench(trot=True))
    frames = bench.run(2.0)
    for frame in frames:
        when = frame.contact_time[0]
        assert frame.time - 0.021 <= when <= frame.time
        swing = int(when / 0.3 + 1e-6) % 2 == 1
        assert frame.contact.tolist() == [swing, not swing, not swing, swing]
        assert frame.contact_valid.all()


def silent(bench):
    bench.board.faults.imu_silent = True


def frozen(bench):
    bench.board.faults.imu_frozen = True


def not_measured(bench):
    bench.board.faults.imu_nan = True


@pytest.mark.parametrize(
    ("fault", "word"), [(silent, "no sample"), (frozen, "frozen"), (not_measured, "impossible")]
)
def test_a_broken_imu_is_seen_and_so_is_its_return(fault, word):
    bench = after_start(Bench())
    assert bench.run(0.2)[-1].imu_valid
    fault(bench)
    frame = bench.run(0.16)[-1]
    assert not frame.imu_valid
    assert not frame.imu.valid.any()
    assert any(word in text for text in frame.faults)
    assert frame.voltage_valid
    bench.board.faults.__init__()
    frame = bench.run(0.1)[-1]
    assert frame.imu_valid
    assert frame.imu.valid.all()


def test_silence_is_seen_within_fifty_milliseconds_and_a_frozen_sensor_within_a_hundred():
    for fault, least, limit in ((silent, 0.049, 0.081), (frozen, 0.09, 0.131)):
        bench = after_start(Bench())
        began = bench.clock.now()
        fault(bench)
        bad = [frame.time - began for frame in bench.run(0.3) if not frame.imu_valid]
        assert least <= bad[0] <= limit


@pytest.mark.parametrize("jump", [5.0, -3.0, 0.2, -0.02, 3000.0])
def test_a_jump_of_the_boards_clock_is_flagged_and_mended(jump):
    bench = after_start(Bench())
    bench.board.faults.clock_jump = jump
    frames = bench.run(1.0)
    flagged = sum(int((~frame.imu.valid).sum()) for frame in frames)
    assert 1 <= flagged <= 12
    assert frames[-1].statistics.time_jumps >= 1
    good = np.concatenate([frame.imu.time[frame.imu.valid] for frame in frames])
    assert np.abs(good - np.rint(good / 0.005) * 0.005).max() < 1e-4
    assert (np.diff(good) > 0).all()
    assert not frames[-1].faults


@pytest.mark.parametrize("state", [True, False])
def test_a_stuck_switch_is_flagged_while_the_others_cycle(state):
    bench = after_start(Bench(trot=True))
    bench.board.faults.stuck_switch[2] = state
    frames = bench.run(8.0)
    assert frames[100].contact_valid.all()
    assert frames[-1].contact_valid.tolist() == [True, True, False, True]
    assert any("RL: stuck" in text for text in frames[-1].faults)
    bench.board.faults.stuck_switch.clear()
    assert bench.run(0.7)[-1].contact_valid.all()


def test_standing_still_or_lifting_one_foot_again_and_again_flags_nobody():
    bench = after_start(Bench())
    for _ in range(30):
        bench.board.faults.stuck_switch[1] = not bench.board.faults.stuck_switch.get(1, True)
        frames = bench.run(0.3)
        assert all(frame.contact_valid.all() for frame in frames)


def test_a_chattering_switch_is_flagged_and_trusted_again_after_a_rest():
    bench = after_start(Bench(trot=True))
    bench.board.faults.chattering.add(3)
    frame = bench.run(0.4)[-1]
    assert frame.contact_valid.tolist() == [True, True, True, False]
    assert "foot switch RR: chatters" in frame.faults
    bench.board.faults.chattering.clear()
    assert not bench.run(0.5)[-1].contact_valid[3]
    assert bench.run(2.0)[-1].contact_valid.all()
    # Forgiven is forgotten: what would not have been chatter before is none now.
    for number in range(20):
        bench.board.faults.stuck_switch[3] = number % 2 == 0
        assert bench.run(0.02)[-1].contact_valid.all()


@pytest.mark.parametrize("volts", [2.0, 30.0])
def test_an_impossible_voltage_is_not_valid(volts):
    bench = after_start(Bench())
    bench.robot.volts = volts
    frame = bench.run(0.1)[-1]
    assert not frame.voltage_valid
    assert frame.voltage == pytest.approx(volts)


def test_a_board_that_falls_silent_makes_everything_invalid_and_comes_back():
    bench = after_start(Bench())
    bench.board.faults.silent = True
    frame = bench.run(0.4)[-1]
    assert not frame.imu_valid
    assert not frame.voltage_valid
    assert not frame.contact_valid.any()
    assert not frame.connected
    bench.board.faults.silent = False
    frame = bench.run(3.0)[-1]
    assert frame.connected
    assert not frame.faults
    assert frame.statistics.reconnects >= 1


def test_a_pulled_plug_is_survived_with_ever_longer_waits():
    bench = after_start(Bench())
    bench.link.out = True
    frames = bench.run(0.7)
    assert not frames[-1].connected
    assert any("no such port" in text for text in frames[-1].faults)
    bench.link.out = False
    frames = bench.run(1.0)
    assert frames[-1].connected
    assert frames[-1].imu.valid.all()
    assert not frames[-1].faults


def test_a_dead_link_from_the_beginning_never_raises():
    bench = Bench()
    bench.link.out = True
    frame = bench.run(1.0)[-1]
    assert not frame.imu_valid
    assert np.isnan(frame.voltage)
    assert not frame.power_on
    bench.driver.power(True)
    bench.driver.cut()
    assert all(found.severity is Severity.REFUSAL for found in bench.driver.findings())
    bench.link.out = False
    assert bench.run(2.0)[-1].imu.valid.all()


def test_damaged_bytes_are_counted_and_never_become_data():
    bench = after_start(Bench())
    random = np.random.default_rng(9)

    def damage(data):
        if not data:
            return data
        changed = bytearray(data)
        for _ in range(int(random.integers(0, 3))):
            changed[int(random.integers(len(changed)))] ^= int(random.integers(1, 256))
        return bytes(changed)

    bench.link.change = damage
    frames = bench.run(10.0)
    statistics = frames[-1].statistics
    assert statistics.bad_frames > 100
    assert statistics.lost_frames > 100
    for frame in frames:
        assert np.abs(frame.imu.gyro[frame.imu.valid]).max(initial=0.0) < 0.1
        assert not frame.voltage_valid or frame.voltage == pytest.approx(11.4)
    bench.link.change = lambda data: data
    assert not bench.run(1.5)[-1].faults


def test_a_stall_of_the_adapter_delays_samples_but_keeps_their_times():
    bench = after_start(Bench())
    held = []
    bench.link.change = lambda data: (held.append(data), b"")[1]
    bench.run(0.2)
    bench.link.change = lambda data: b"".join(held) + data
    first = bench.run(0.02)[0]
    bench.link.change = lambda data: data
    assert len(first.imu.time) == 44
    assert first.imu.valid.all()
    assert np.allclose(first.imu.time, np.rint(first.imu.time / 0.005) * 0.005, atol=1e-4)


def test_good_frames_of_foreign_firmware_are_counted():
    bench = after_start(Bench())
    bench.link.change = lambda data: encode_frame(0x55, 0, b"abc") + data
    assert bench.run(0.2)[-1].statistics.bad_messages == 10


def test_samples_that_nobody_takes_do_not_pile_up():
    bench = Bench(config=BoardConfig(buffer=50))
    after_start(bench)
    for _ in range(100):
        bench.clock.sleep_until(bench.clock.now() + 0.02)
        bench.driver.poll()
    frame = bench.driver.take()
    assert len(frame.imu.time) == 50
    assert frame.statistics.imu_dropped > 300
    assert (np.diff(frame.imu.time) > 0).all()


def test_impossible_measurements_are_flagged_and_reported_as_measured():
    bench = after_start(Bench())
    bench.link.change = lambda data: b""
    bench.run(0.04)
    wild = encode_imu(ImuSample(round(bench.clock.now() * 1e6), (32.7, 0.0, 0.0), GRAVITY, None))
    bench.link.change = lambda data: encode_frame(Kind.IMU, 0, wild)
    frame = bench.run(0.02)[0]
    assert frame.imu.gyro[0, 0] == pytest.approx(32.7)
    assert not frame.imu.valid[0]
    assert any("impossible angular velocity" in text for text in frame.faults)


def test_another_version_of_the_protocol_is_named():
    bench = after_start(Bench())
    bench.driver.hello = bench.driver.hello.__class__(2, (1, 0), 1, 0, False)
    assert any("version 2" in str(found) for found in bench.driver.findings())


def test_a_healthy_board_is_one_good_finding():
    bench = after_start(Bench())
    bench.clock.sleep_until(bench.clock.now() + 0.02)
    bench.driver.poll()
    (found,) = bench.driver.findings()
    assert len(bench.driver.take().imu.time) == 4, "a check takes no samples away"
    assert found.severity is Severity.OK
    assert "11.40 V, firmware 1.0" in found.text


def test_close_is_idempotent_and_later_calls_do_nothing():
    bench = after_start(Bench())
    for _ in range(2):
        bench.driver.close()
    bench.driver.poll()
    bench.driver.beat()
    bench.driver.cut()


def test_a_cut_from_another_thread_is_heard():
    bench = Bench()
    assert bench.power_on().power_on
    thread = threading.Thread(target=bench.driver.cut)
    thread.start()
    thread.join()
    assert not bench.run(0.1)[-1].power_on


@pytest.mark.parametrize("wrong", [{"imu_silence": 0.0}, {"voltage_min": 20.0}, {"retry_first": -1.0}])
def test_impossible_thresholds_are_refused(wrong):
    with pytest.raises(ConfigurationError):
        BoardConfig(**wrong)
