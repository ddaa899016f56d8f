"""Sweeps made level, and those that are of no use."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.navigation.scan import LevelScan, ScanConfig, ScanReader
from bluefoot_mpc.types import LidarScan
from tests.navigation.bench import BEARINGS, HEIGHT, MOUNTS, body_state

SWEEP = LidarScan(time=1.0, bearing=BEARINGS, distance=np.full(BEARINGS.size, 2.0), valid=True)


def reader() -> ScanReader:
    return ScanReader(ScanConfig(), MOUNTS)


def read(scan: LidarScan, tilt: tuple[float, float] = (0.0, 0.0)) -> LevelScan:
    result = reader().read(scan, body_state(1.0, tilt=tilt))
    assert isinstance(result, LevelScan)
    return result


def test_level_points_lie_around_the_mounting_point() -> None:
    scan = read(SWEEP)
    np.testing.assert_allclose(np.hypot(*(scan.points - (0.04, 0.0)).T), 2.0, atol=1e-12)
    assert scan.hit.all()


def test_a_ray_without_echo_reaches_as_far_as_the_sensor_and_hits_nothing() -> None:
    distance = SWEEP.distance.copy()
    distance[[5, 6, 7]] = (np.nan, 0.01, np.inf)
    scan = read(replace(SWEEP, distance=distance))
    np.testing.assert_array_equal(scan.distance[5:8], 5.6)
    assert not scan.hit[5:8].any()
    assert scan.hit[8]


def test_points_of_a_tilted_sensor_fall_on_the_wall_that_it_sees() -> None:
    roll, pitch, wall = 0.05, -0.04, 1.5
    # A wall across the way at x = 1.5 m in the level frame, measured by the tilted sensor.
    cos, sin = np.cos(BEARINGS), np.sin(BEARINGS)
    forward = math.cos(pitch) * cos + math.sin(pitch) * math.sin(roll) * sin
    start = math.cos(pitch) * 0.04 + math.sin(pitch) * math.cos(roll) * 0.127
    distance = np.where(forward > 0.3, (wall - start) / np.maximum(forward, 0.3), np.nan)
    scan = read(replace(SWEEP, distance=distance), tilt=(roll, pitch))
    seen = np.isfinite(distance) & (distance < 5.6)
    np.testing.assert_allclose(scan.points[seen, 0], wall, atol=1e-9)


def test_echoes_of_the_floor_are_free_space_up_to_there() -> None:
    pitch = 0.12  # nose down: the plane meets the floor two metres ahead
    lift = HEIGHT + 0.127 * math.cos(pitch) - 0.04 * math.sin(pitch)
    down = math.sin(pitch) * np.cos(BEARINGS)
    distance = np.where(down > 0.05, lift / np.maximum(down, 0.05), 2.0)
    distance = np.minimum(distance, 5.5)
    scan = read(replace(SWEEP, distance=distance), tilt=(0.0, pitch))
    floor = (down > 0.05) & (distance < 5.0)
    assert floor.sum() > 200
    assert not scan.hit[floor].any()
    np.testing.assert_array_equal(scan.distance, distance)
    # A thing before the floor is a thing.
    distance[BEARINGS.size // 2] = 1.0
    assert read(replace(SWEEP, distance=distance), tilt=(0.0, pitch)).hit[BEARINGS.size // 2]


def test_a_sweep_of_another_length_is_of_use() -> None:
    bearing = np.linspace(-2.0, 2.0, 150)
    scan = read(LidarScan(time=1.0, bearing=bearing, distance=np.full(150, 1.0), valid=True))
    assert scan.points.shape == (150, 2)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"valid": False}, "invalid"),
        ({"bearing": np.zeros(0), "distance": np.zeros(0)}, "no rays"),
        ({"distance": np.full(100, 2.0)}, "do not match"),
        ({"bearing": np.full(BEARINGS.size, np.nan)}, "not numbers"),
        ({"bearing": BEARINGS[::-1]}, "do not rise"),
        ({"bearing": BEARINGS * 0.3}, "far enough"),
        ({"bearing": BEARINGS[::20], "distance": SWEEP.distance[::20]}, "only"),
        ({"bearing": np.linspace(-2, 2, 45), "distance": np.full(45, 2.0)}, "gaps"),
    ],
)
def test_useless_sweeps_are_named(change: dict[str, object], reason: str) -> None:
    result = reader().read(replace(SWEEP, **change), body_state(1.0))  # type: ignore[arg-type]
    assert isinstance(result, str)
    assert reason in result


@pytest.mark.parametrize("distance", [np.nan, 0.003])
def test_a_sweep_without_any_echo_is_open_ground(distance: float) -> None:
    scan = read(replace(SWEEP, distance=np.full(BEARINGS.size, distance)))
    assert not scan.hit.any()
    np.testing.assert_array_equal(scan.distance, 5.6)


def test_a_good_sweep_after_a_useless_one_is_of_use() -> None:
    made = reader()
    assert isinstance(made.read(replace(SWEEP, bearing=BEARINGS * np.nan), body_state(1.0)), str)
    assert isinstance(made.read(SWEEP, body_state(1.0)), LevelScan)


def test_a_sensor_that_is_turned_on_the_trunk_gives_the_same_points_as_a_trunk_that_is_tilted() -> None:
    pitch = 0.10
    mounts = replace(MOUNTS, lidar=(0.0, 0.0, 0.0), lidar_rpy_deg=(0.0, math.degrees(pitch), 0.0))
    turned = ScanReader(ScanConfig(), mounts).read(SWEEP, body_state(1.0))
    level = replace(mounts, lidar_rpy_deg=(0.0, 0.0, 0.0))
    tilted = ScanReader(ScanConfig(), level).read(SWEEP, body_state(1.0, tilt=(0.0, pitch)))
    assert isinstance(turned, LevelScan)
    assert isinstance(tilted, LevelScan)
    np.testing.assert_allclose(turned.points, tilted.points, atol=1e-12)
    np.testing.assert_array_equal(turned.hit, tilted.hit)
    assert not turned.hit.all()
