"""The LIDAR's driver against the emulated sensor: scans, times, faults of sensor and line."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.emulation.lidar import LidarTimes
from bluefoot_mpc.io.emulation.lidar_replies import PARAMETERS
from bluefoot_mpc.io.findings import Severity
from bluefoot_mpc.io.lidar import LidarConfig, LidarError

from .bench import Bench

pytestmark = pytest.mark.slow


def expected(seen):
    return np.where((seen < 20) | (seen > 5600), np.nan, seen * 0.001)


def matching(room, scan):
    """Time at which the room looked as in a scan."""
    for time, seen in reversed(room.seen):
        if np.array_equal(expected(seen), scan.distance, equal_nan=True):
            return time
    raise AssertionError("a scan that nobody took")


def started(**arguments):
    bench = Bench(**arguments)
    bench.driver.start()
    bench.driver.take()
    return bench


def test_ten_scans_a_second_arrive_as_they_were_taken():
    bench = started()
    scans = bench.run(5.0)
    assert len(scans) == 50
    for now, scan in scans:
        assert scan.valid
        assert scan.time == pytest.approx(matching(bench.room, scan), abs=0.0015)
        assert scan.time <= now
        assert len(scan.bearing) == len(scan.distance) == 682
    assert bench.driver.statistics.bad_scans == bench.driver.statistics.bad_replies == 0
    assert bench.driver.facts["PROT"] == "SCIP 2.0"
    (found,) = bench.driver.findings()
    assert found.severity is Severity.OK


def test_error_codes_have_no_distance():
    bench = started()
    bench.room.scan = lambda time: np.concatenate([np.arange(20), np.full(662, 20)])
    _, scan = bench.run(0.3)[-1]
    assert np.isnan(scan.distance[:20]).all()
    assert (scan.distance[20:] == 0.020).all()


def test_a_scan_has_the_size_of_the_specification():
    bench = started()
    sizes = []
    bench.link.change = lambda data: (sizes.append(len(data)), data)[1]
    bench.run(2.0)
    assert sum(sizes) == 2137 * 20


@pytest.mark.parametrize("offset", [0.0, 16776.0, 16777.2])
def test_times_hold_with_a_clock_that_drifts_and_wraps(offset):
    bench = started(times=LidarTimes(clock_offset=offset, clock_drift=1e-4))
    for _, scan in bench.run(40.0):
        # Four milliseconds of drift in that time, and one of the sensor's clock.
        assert abs(scan.time - matching(bench.room, scan)) < 0.0055


@pytest.mark.parametrize("drift", [3e-3, -3e-3])
def test_arrivals_hold_a_bad_clock_within_bounds(drift):
    bench = started(times=LidarTimes(clock_drift=drift))
    for now, scan in bench.run(40.0):
        assert scan.time <= now + 1e-9
        assert abs(scan.time - matching(bench.room, scan)) < 0.075
    assert bench.driver.statistics.restarts == 0


def test_only_the_newest_scan_is_handed_out():
    bench = started()
    for _ in range(50):
        bench.clock.sleep_until(bench.clock.now() + 0.02)
        bench.driver.poll()
    scan = bench.driver.take()
    assert bench.clock.now() - scan.time < 0.13
    assert bench.driver.take() is None


def test_a_slow_port_loses_every_other_scan_and_the_times_still_hold():
    bench = started(times=LidarTimes(byte_time=10 / 115200))
    scans = bench.run(4.0)
    assert 19 <= len(scans) <= 21
    assert bench.lidar.skipped > 15
    for _, scan in scans[1:]:
        assert abs(scan.time - matching(bench.room, scan)) < 0.2


def test_another_sensor_is_refused_and_named():
    bench = Bench()
    bench.lidar.parameters = tuple(
        ("AMAX", "768") if name == "AMAX" else (name, value) for name, value in PARAMETERS
    )
    with pytest.raises(LidarError, match="last step 768 instead of 725"):
        bench.driver.start()
    (found,) = bench.driver.findings()
    assert found.severity is Severity.WARNING


def test_a_sensor_that_does_not_answer_is_named():
    bench = Bench()
    bench.lidar.silent = True
    with pytest.raises(LidarError, match="no answer to QT"):
        bench.driver.start()
    assert bench.driver.take() is None


def test_a_sensor_left_measuring_by_another_program_is_taken_over():
    bench = Bench()
    bench.lidar.receive(b"MS0044072501000\n", 0.0)
    bench.clock.sleep_until(1.0)
    bench.driver.start()
    assert bench.run(0.5)


def test_silence_is_seen_and_ends():
    bench = started()
    bench.run(0.5)
    bench.lidar.silent = True
    assert len(bench.run(2.0)) <= 1
    assert bench.driver.fault
    bench.lidar.silent = False
    scans = bench.run(4.0)
    assert scans
    assert not bench.driver.fault
    assert scans[-1][1].time == pytest.approx(matching(bench.room, scans[-1][1]), abs=0.0015)


def test_a_pulled_plug_is_survived():
    bench = started()
    bench.link.out = True
    assert not bench.run(0.7)
    assert "no such port" in bench.driver.fault
    bench.link.out = False
    assert bench.run(2.0)
    assert bench.driver.statistics.reconnects == 1


def test_a_sensor_that_restarts_is_set_up_again():
    bench = started()
    bench.run(1.0)
    bench.lidar._clear()
    bench.lidar._times = dataclasses.replace(bench.lidar._times, clock_offset=-1.5)
    scans = bench.run(3.0)
    assert len(scans) > 15
    assert bench.driver.statistics.restarts == 1
    assert scans[-1][1].time == pytest.approx(matching(bench.room, scans[-1][1]), abs=0.0015)


def test_a_jump_of_the_sensors_clock_is_seen():
    bench = started()
    bench.run(1.0)
    bench.lidar._times = dataclasses.replace(bench.lidar._times, clock_offset=1000.0)
    scans = bench.run(2.0)
    assert bench.driver.statistics.restarts == 1
    for _, scan in scans:
        assert scan.time == pytest.approx(matching(bench.room, scan), abs=0.0015)


def test_the_same_scan_again_and_again_is_not_valid():
    bench = started()
    bench.run(0.5)
    bench.room.still = True
    scans = [scan.valid for _, scan in bench.run(1.0)]
    assert scans[:3] == [True] * 3
    assert not any(scans[5:])
    assert "not measuring" in bench.driver.fault
    bench.room.still = False
    assert all(scan.valid for _, scan in bench.run(1.0)[1:])


def test_open_air_may_look_the_same_each_time():
    bench = started()
    bench.room.scan = lambda time: np.zeros(682, dtype=int)
    assert all(scan.valid for _, scan in bench.run(2.0))


def test_damaged_scans_are_counted_and_never_handed_out():
    bench = started()
    random = np.random.default_rng(4)

    def damage(data):
        changed = bytearray(data)
        for _ in range(int(random.integers(1, 3)) if data and random.random() < 0.25 else 0):
            place = int(random.integers(len(changed)))
            changed[place : place + int(random.integers(0, 2))] = random.bytes(int(random.integers(0, 3)))
        return bytes(changed)

    bench.link.change = damage
    scans = bench.run(60.0)
    assert bench.driver.statistics.bad_scans + bench.driver.statistics.bad_replies > 80
    assert len(scans) > 200
    # A sum of six bits lets one damage in 64 through; none that it finds may pass.
    assert sum(not any(np.array_equal(expected(s), scan.distance, equal_nan=True) for _, s in bench.room.seen)
               for _, scan in scans) <= 4  # fmt: skip
    bench.link.change = lambda data: data
    bench.run(2.0)
    assert len(bench.run(2.0)) == 20


def test_trouble_reported_by_the_sensor_begins_anew():
    bench = started()
    bench.link.change = lambda data: b"MD0044072501000\n50U\n\n"
    bench.run(0.02)
    assert "status 50" in bench.driver.fault
    bench.link.change = lambda data: data
    assert bench.run(2.0)


def test_close_stops_the_measurement_and_is_idempotent():
    bench = started()
    for _ in range(2):
        bench.driver.close()
    bench.driver.poll()
    bench.lidar.transmit(bench.clock.now() + 0.1)
    assert not bench.lidar.laser_on


def test_impossible_times_are_refused():
    with pytest.raises(ConfigurationError, match="silence"):
        LidarConfig(silence=0.0)
