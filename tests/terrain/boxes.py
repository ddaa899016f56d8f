"""Boxes on a floor as a tilted LIDAR sees them: an exact ray-caster in numpy, with the sensor's noise."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_quaternion, rotation_z
from bluefoot_mpc.io.lidar.geometry import bearings
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.terrain.cloud import lidar_place, scan_points
from bluefoot_mpc.types import FloatArray, LidarScan

MOUNT = SensorMounts(imu=(0.0, 0.0, 0.0), lidar=(0.04, 0.0, 0.127), camera=(0.1, 0.0, 0.05))
HEIGHT = 0.11
"""m, of the trunk above the floor."""
_BEARING = bearings()


@dataclass(frozen=True, slots=True)
class Box:
    """A block on the floor: middle (m), sides (m), height (m) and yaw (rad)."""

    x: float
    y: float
    length: float
    width: float
    top: float
    yaw: float = 0.0


@dataclass(frozen=True, slots=True)
class Off:
    """By how much the estimated pose is off the true one.

    Attributes:
        place: (3,) m.
        yaw: rad.
        tilt_deg: degrees of roll and pitch, all along.
        jitter_deg: degrees, standard deviation from scan to scan.
    """

    place: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw: float = 0.0
    tilt_deg: float = 0.0
    jitter_deg: float = 0.0


def rubble(seed: int, height: float, count: int = 45) -> list[Box]:
    """Blocks of 4 to 14 cm on a grid of 15 cm ahead of the robot, turned and shifted at random."""
    rng = np.random.default_rng(seed)
    places = [(0.5 + 0.15 * k, -0.6 + 0.15 * i) for k in range(7) for i in range(9)]
    chosen = rng.permutation(len(places))[:count]
    return [
        Box(
            *(np.array(places[k]) + rng.uniform(-0.02, 0.02, 2)).tolist(),
            *rng.uniform(0.04, 0.10, 2).tolist(),
            float(rng.uniform(0.002, height)),
            float(rng.uniform(-1.5, 1.5)),
        )
        for k in chosen
    ]


def heights(boxes: list[Box], places: FloatArray) -> FloatArray:
    """(...,) m, the true top at places (..., 2) m."""
    found = np.zeros(places.shape[:-1])
    for box in boxes:
        local = (places - (box.x, box.y)) @ rotation_z(box.yaw)[:2, :2]
        on = (np.abs(local[..., 0]) <= 0.5 * box.length) & (np.abs(local[..., 1]) <= 0.5 * box.width)
        found = np.where(on, np.maximum(found, box.top), found)
    return found


def cast(boxes: list[Box], origin: FloatArray, rays: FloatArray) -> FloatArray:
    """(k,) m along rays (k, 3) from an origin to what they meet first; infinite for nothing."""
    found = np.where(rays[:, 2] < 0.0, -origin[2] / np.where(rays[:, 2] == 0.0, 1.0, rays[:, 2]), np.inf)
    for box in boxes:
        rotation = rotation_z(box.yaw)
        start = (origin - (box.x, box.y, 0.5 * box.top)) @ rotation
        along = rays @ rotation
        along = np.where(np.abs(along) < 1e-12, 1e-12, along)
        half = 0.5 * np.array((box.length, box.width, box.top))
        one, two = (-half - start) / along, (half - start) / along
        enters, leaves = np.minimum(one, two).max(axis=1), np.maximum(one, two).min(axis=1)
        found = np.where((enters <= leaves) & (enters > 0.0), np.minimum(found, enters), found)
    return found


def sweep(
    boxes: list[Box], rng: np.random.Generator, place: tuple[float, float, float] = (0.0, 0.0, 0.0),
    off: Off | None = None, noise: float = 0.010,
) -> list[tuple[FloatArray, float, FloatArray]]:  # fmt: skip
    """Scans of a sweep: points (k, 3) by the estimated pose, time, and where the LIDAR was believed to be.

    The levels lie 20 mm apart on the floor, from 0.45 m ahead to 1.3 m.

    Args:
        boxes: on the floor.
        rng: of the noise.
        place: true x, y (m) and yaw (rad) of the robot.
        off: errors of the estimate.
        noise: m, standard deviation of a range within 1 m, and its share beyond.
    """
    off = off or Off()
    scans = []
    for k, ahead in enumerate(np.arange(0.45, 1.3, 0.02)):
        pitch = math.atan2(HEIGHT, ahead) + math.asin(MOUNT.lidar[2] / math.hypot(ahead, HEIGHT))
        rpy = np.array([0.0, pitch, place[2]])
        position = np.array([place[0], place[1], HEIGHT])
        rotation = rotation_from_quaternion(quaternion_from_rpy(rpy))
        bearing = _BEARING + rng.normal(0.0, math.radians(0.05), len(_BEARING))
        rays = np.stack((np.cos(bearing), np.sin(bearing), np.zeros_like(bearing)), axis=1) @ rotation.T
        distance = cast(boxes, position + rotation @ np.array(MOUNT.lidar), rays)
        distance[distance > 5.6] = np.nan
        distance += noise * np.maximum(distance, 1.0) * rng.standard_normal(len(distance))
        distance[rng.random(len(distance)) < 0.005] = np.nan
        tilt = np.radians(off.tilt_deg) + np.radians(off.jitter_deg) * rng.standard_normal(2)
        believed = quaternion_from_rpy(rpy + np.array([*tilt, off.yaw]))
        where = position + np.array(off.place)
        scan = LidarScan(time=0.1 * k, bearing=_BEARING, distance=distance, valid=True)
        scans.append(
            (scan_points(scan, where, believed, MOUNT), scan.time, lidar_place(where, believed, MOUNT))
        )
    return scans
