"""Scans of a flat, level floor by a LIDAR on a trunk that pitches: for tests of sweeps and of mountings."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_quaternion
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.terrain.mounting import PosedScan
from bluefoot_mpc.types import FloatArray, LidarScan

MOUNTS = SensorMounts(imu=(0.0, 0.0, 0.02), lidar=(0.04, 0.0, 0.127), camera=(0.105, 0.0, 0.07))
BEARINGS = np.radians(np.arange(-119.0, 119.5, 0.35))
HEIGHT = 0.118
"""m, trunk above the floor, which is at z = 0."""


def trunk(pitch: float, roll: float = 0.0) -> tuple[FloatArray, FloatArray]:
    """Position (3,) m and quaternion (4,) of a trunk."""
    return np.array([0.0, 0.0, HEIGHT]), quaternion_from_rpy(np.array([roll, pitch, 0.0]))


def floor_scan(
    position: FloatArray,
    quaternion: FloatArray,
    mounts: SensorMounts = MOUNTS,
    time: float = 0.0,
    rng: np.random.Generator | None = None,
) -> LidarScan:
    """What a LIDAR sees of the floor; with the sensor's noise where a generator is given."""
    base = rotation_from_quaternion(quaternion)
    down = np.column_stack((np.cos(BEARINGS), np.sin(BEARINGS))) @ (base @ mounts.lidar_rotation)[2, :2]
    lens = position[2] + base[2] @ np.array(mounts.lidar)
    with np.errstate(divide="ignore"):
        distance = np.where(down < -1e-3, -lens / down, np.nan)
    if rng is not None:
        distance = distance + rng.normal(size=distance.size) * np.maximum(0.01, 0.01 * distance)
    distance[~(distance <= 5.6)] = np.nan
    return LidarScan(time=time, bearing=BEARINGS, distance=distance, valid=True)


def sweep_of(
    mounts: SensorMounts, seed: int = 0, pitches: FloatArray | None = None, tilt_error: float = 0.0
) -> list[PosedScan]:
    """A sweep by a LIDAR that is mounted so, seen by a robot that errs in roll by `tilt_error` (rad)."""
    rng = np.random.default_rng(seed)
    looks = []
    for pitch in np.radians(np.linspace(11.0, 31.0, 40)) if pitches is None else pitches:
        scan = floor_scan(*trunk(float(pitch)), mounts, rng=rng)
        looks.append(PosedScan(scan, *trunk(float(pitch), roll=tilt_error)))
    return looks
