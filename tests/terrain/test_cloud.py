"""Scans to points, and point clouds as files."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_quaternion
from bluefoot_mpc.terrain.cloud import Cloud, CloudConfig, join, scan_points, smooth_ranges
from bluefoot_mpc.types import FloatArray, LidarScan
from tests.terrain.boxes import MOUNT, Box, cast

RAW = CloudConfig(smooth=0)
LEVEL = np.array([0.0, 0.0, 0.0, 1.0])
BEARING = np.radians(np.arange(-110.0, 110.5, 0.35))


def _scan(distance: FloatArray, bearing: FloatArray | None = None) -> LidarScan:
    bearing = np.linspace(-0.1, 0.1, len(distance)) if bearing is None else bearing
    return LidarScan(time=1.0, bearing=bearing, distance=distance, valid=True)


@pytest.mark.parametrize("turned", [(0.0, 0.0, 0.0), (2.0, -3.0, 5.0)])
def test_points_lie_where_the_rays_ended(turned: tuple[float, float, float]) -> None:
    """Rays cast through the true pose and a turned mounting come back onto the floor and the box."""
    mount = replace(MOUNT, lidar_rpy_deg=turned)
    position, quaternion = np.array([0.3, -0.2, 0.11]), quaternion_from_rpy(np.array([0.05, 0.35, 0.4]))
    rotation = rotation_from_quaternion(quaternion)
    plane = np.stack((np.cos(BEARING), np.sin(BEARING), np.zeros_like(BEARING)), axis=1)
    rays = plane @ (rotation @ mount.lidar_rotation).T
    origin = position + rotation @ np.array(mount.lidar)
    distance = cast([Box(0.9, 0.1, 0.2, 0.2, 0.03)], origin, rays)
    distance[~(distance < 2.5)] = np.nan
    points = scan_points(_scan(distance, BEARING), position, quaternion, mount, RAW)
    assert len(points) == np.count_nonzero(distance < 2.5) > 300
    assert points == pytest.approx((origin + distance[:, None] * rays)[np.isfinite(distance)], abs=1e-12)
    assert points[:, 2].min() == pytest.approx(0.0, abs=1e-9)
    assert points[:, 2].max() == pytest.approx(0.03, abs=2e-3)


def test_rays_of_no_use_are_left_out() -> None:
    """No echo, error codes, the robot itself, and what is too far to be mapped."""
    distance = np.array([np.nan, 0.01, 0.10, 1.0, 4.0, np.inf, -1.0])
    points = scan_points(_scan(distance), np.zeros(3), LEVEL, MOUNT, RAW)
    assert len(points) == 1
    assert points[0] == pytest.approx((1.04, 0.0, 0.127), abs=0.02)


def test_bad_scans_give_no_points() -> None:
    """Nothing seen, marked as bad, not as many as bearings, and a pose that is no number."""
    good = _scan(np.ones(5))
    nothing = [
        (_scan(np.full(5, np.nan)), np.zeros(3)),
        (_scan(np.zeros(0)), np.zeros(3)),
        (replace(good, valid=False), np.zeros(3)),
        (replace(good, bearing=np.zeros(4)), np.zeros(3)),
        (good, np.array([0.0, np.nan, 0.0])),
    ]
    assert len(scan_points(good, np.zeros(3), LEVEL, MOUNT)) == 5
    for scan, position in nothing:
        assert scan_points(scan, position, LEVEL, MOUNT).shape == (0, 3)


def test_smoothing_takes_noise_off_and_leaves_edges() -> None:
    """Less than half of the noise is left on a floor; a jump of range stays between its two rays."""
    rng = np.random.default_rng(1)
    true = np.where(np.arange(600) < 300, 0.9, 0.84)
    noisy = true + rng.normal(0.0, 0.010, 600)
    noisy[50] = np.nan
    smooth = smooth_ranges(noisy, CloudConfig())
    assert math.isnan(smooth[50])
    left = np.delete(smooth - true, 50)
    assert left.std() < 0.005
    assert np.abs(left).max() < 0.02  # blurred across the edge it would be 0.03
    assert smooth_ranges(noisy, RAW) is noisy


def test_clouds_join() -> None:
    """Points and times in order; none give an empty cloud; what does not match is refused."""
    one, two = Cloud(np.ones((2, 3)), np.ones(2)), Cloud(np.zeros((1, 3)), np.zeros(1))
    both = join([one, two])
    assert both.points.shape == (3, 3)
    assert both.time.tolist() == [1.0, 1.0, 0.0]
    assert join([]).points.shape == (0, 3)
    with pytest.raises(ConfigurationError, match="a cloud needs"):
        Cloud(np.ones((2, 3)), np.ones(3))


def test_configuration_is_checked(tmp_path: Path) -> None:
    """A range that leaves nothing over is refused."""
    with pytest.raises(ConfigurationError, match="greatest_range"):
        CloudConfig(greatest_range=0.1)
