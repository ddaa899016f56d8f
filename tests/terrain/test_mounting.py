"""How the LIDAR is mounted, from a sweep of a floor."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.terrain.mounting import Floor, MountingConfig, find_mounting
from tests.terrain.flat_floor import MOUNTS, sweep_of

FLAT = Floor(0.0, 0.0)


def turned(roll, pitch, yaw, height=0.127):
    return replace(MOUNTS, lidar_rpy_deg=(roll, pitch, yaw), lidar=(0.04, 0.0, height))


@pytest.mark.parametrize("true", [(0.7, 1.0, 0.0), (-1.5, -2.0, 0.8), (0.0, 0.0, 0.0)])
def test_roll_pitch_yaw_and_height_are_found(true):
    found = find_mounting(sweep_of(turned(*true, height=0.130)), FLAT, MOUNTS)
    assert not found.reason
    np.testing.assert_allclose(found.rpy_deg[:2], true[:2], atol=0.05)
    assert found.rpy_deg[2] == pytest.approx(true[2], abs=0.2)
    assert found.height == pytest.approx(0.130, abs=0.001)
    assert found.misfit == pytest.approx(1.0, abs=0.1)
    # What it says of its own error is neither boast nor nonsense.
    assert (found.deviation_deg[:2] < 0.1).all()
    assert 0.1 < found.deviation_deg[2] < 0.3


def test_what_is_believed_already_is_taken_as_the_start():
    believed = turned(0.7, 1.0, 0.0)
    found = find_mounting(sweep_of(turned(1.0, 1.5, 0.0)), FLAT, believed)
    np.testing.assert_allclose(found.rpy_deg[:2], (1.0, 1.5), atol=0.05)


def test_an_error_of_the_attitude_that_all_scans_share_is_within_what_it_admits():
    found = find_mounting(sweep_of(MOUNTS, tilt_error=math.radians(0.06)), FLAT, MOUNTS)
    assert (np.abs(found.rpy_deg) < 2.0 * found.deviation_deg).all()


def test_a_floor_that_is_not_flat_is_refused():
    rng = np.random.default_rng(1)
    looks = []
    for scan, position, quaternion in sweep_of(MOUNTS):
        # Blocks up to 20 mm high, a few rays wide.
        height = np.repeat(rng.uniform(0.0, 0.02, 140), 5)[: scan.distance.size]
        looks.append((replace(scan, distance=scan.distance * (1.0 - height / 0.24)), position, quaternion))
    found = find_mounting([type(sweep_of(MOUNTS)[0])(*look) for look in looks], FLAT, MOUNTS)
    assert "not flat" in found.reason
    np.testing.assert_array_equal(found.rpy_deg, MOUNTS.lidar_rpy_deg)


@pytest.mark.parametrize(
    ("looks", "floor", "reason"),
    [
        ([], FLAT, "only 0 usable scans"),
        (sweep_of(MOUNTS, pitches=np.radians(np.linspace(20.0, 23.0, 20))), FLAT, "pitched through 3.0"),
        (sweep_of(MOUNTS), Floor(0.0, 0.05), "slopes by 2.9"),
        (sweep_of(MOUNTS), Floor(math.nan, math.nan), "slopes"),
        (sweep_of(MOUNTS), Floor(0.5, 0.0), "points on the floor"),
        (sweep_of(turned(9.0, 0.0, 0.0)), FLAT, ""),
    ],
)
def test_what_tells_nothing_is_refused_with_the_reason(looks, floor, reason):
    found = find_mounting(looks, floor, MOUNTS)
    assert found.reason
    assert reason in found.reason
    assert np.isinf(found.deviation_deg).all()


def test_scans_without_numbers_are_left_out():
    looks = sweep_of(MOUNTS)
    scan, position, _ = looks[0]
    looks[0] = looks[0]._replace(position=position * np.nan)
    looks[1] = looks[1]._replace(scan=replace(scan, valid=False))
    looks[2] = looks[2]._replace(scan=replace(scan, distance=scan.distance[:-1]))
    looks[3] = looks[3]._replace(scan=replace(scan, distance=np.full_like(scan.distance, np.nan)))
    assert not find_mounting(looks, FLAT, MOUNTS).reason
    assert find_mounting(looks[:4], FLAT, MOUNTS, MountingConfig(least_scans=2)).reason
