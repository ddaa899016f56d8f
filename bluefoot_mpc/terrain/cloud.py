"""From scans of the tilted LIDAR to points in the odometry frame (thesis, chapter 6, terrain)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import FloatArray, LidarScan


@dataclass(frozen=True, kw_only=True, slots=True)
class CloudConfig:
    """Which rays of a scan become points."""

    least_range: float = 0.02  # m; nearer values are the sensor's error codes
    own_radius: float = 0.15  # m from the sensor; what is nearer belongs to the robot
    greatest_range: float = 2.5  # m; the height error of the tilt grows with the range
    smooth: int = 3  # rays to either side over which ranges are averaged; 0 = none
    same: float = 0.035  # m, by which ranges of one surface differ from their median, at most

    def __post_init__(self) -> None:
        require_nonnegative(
            least_range=self.least_range, own_radius=self.own_radius, same=self.same
        )  # fmt: skip
        require_range(0, 50, smooth=self.smooth)
        require_positive(greatest_range=self.greatest_range)
        if self.greatest_range <= max(self.least_range, self.own_radius):
            raise ConfigurationError(
                f"greatest_range = {self.greatest_range:g} must be more than least_range = "
                f"{self.least_range:g} and own_radius = {self.own_radius:g}"
            )


@dataclass(frozen=True, slots=True)
class Cloud:
    """Points of one or more scans.

    Attributes:
        points: (n, 3) m, in one frame, usually the odometry frame.
        time: (n,) s, end of the scan that each point is of.
    """

    points: FloatArray
    time: FloatArray

    def __post_init__(self) -> None:
        if self.points.ndim != 2 or self.points.shape[1] != 3 or self.time.shape != self.points.shape[:1]:
            raise ConfigurationError(
                f"a cloud needs (n, 3) points and (n,) times, not {self.points.shape} and {self.time.shape}"
            )


def join(clouds: Iterable[Cloud]) -> Cloud:
    """All points of clouds in one frame, in the order given; an empty cloud for none."""
    parts = list(clouds)
    if not parts:
        return Cloud(np.zeros((0, 3)), np.zeros(0))
    return Cloud(np.vstack([c.points for c in parts]), np.concatenate([c.time for c in parts]))


def scan_points(
    scan: LidarScan, position: FloatArray, quaternion: FloatArray, mount: SensorMounts,
    config: CloudConfig | None = None,
) -> FloatArray:  # fmt: skip
    """(k, 3) m, what a scan met, odometry frame: ``world_T_base · base_T_lidar`` of every ray with an echo.

    Printed the other way round; the product's order is reversed (thesis, chapter 6). A scan that must not be
    used, one without echoes, and a pose that is no number give no points.

    Args:
        scan: as it came from the sensor.
        position: (3,) m, estimated, of the base in the odometry frame at the time of the scan.
        quaternion: (4,) x y z w, estimated, base to odometry frame.
        mount: where the LIDAR sits on the base, and how it is turned.
        config: which rays count.
    """
    config = config or CloudConfig()
    distance = np.asarray(scan.distance, dtype=np.float64)
    bearing = np.asarray(scan.bearing, dtype=np.float64)
    posed = np.isfinite(position).all() and np.isfinite(quaternion).all()
    if not (scan.valid and posed and distance.shape == bearing.shape and distance.ndim == 1):
        return np.zeros((0, 3))
    least = max(config.least_range, config.own_radius)
    met = np.isfinite(distance) & (distance >= config.least_range)
    distance = smooth_ranges(np.where(met, distance, np.nan), config)
    echo = (distance >= least) & (distance <= config.greatest_range) & np.isfinite(bearing)
    distance, bearing = distance[echo], bearing[echo]
    rotation_base_to_world = rotation_from_quaternion(quaternion)
    plane = (rotation_base_to_world @ mount.lidar_rotation)[:, :2]
    in_lidar = np.stack((distance * np.cos(bearing), distance * np.sin(bearing)))
    origin = position + rotation_base_to_world @ np.array(mount.lidar)
    return np.asarray((plane @ in_lidar).T + origin)


def lidar_place(position: FloatArray, quaternion: FloatArray, mount: SensorMounts) -> FloatArray:
    """(3,) m, where the LIDAR is in the odometry frame.

    Args:
        position: (3,) m, of the base in the odometry frame.
        quaternion: (4,) x y z w, base to odometry frame.
        mount: where the LIDAR sits on the base.
    """
    return np.asarray(position + rotation_from_quaternion(quaternion) @ np.array(mount.lidar))


def smooth_ranges(distance: FloatArray, config: CloudConfig) -> FloatArray:
    """(n,) m, ranges averaged over the neighbouring rays that met the same surface; no echo stays none.

    Rays are 0.35 degrees apart, 6 mm across at 1 m, and the sensor's noise there is 10 mm along the ray: a
    mean over seven rays more than halves it, and costs 2 cm of sharpness sideways. Where the ground rises by
    20 mm the ranges jump by 40 to 80 mm, for the rays come in flat: only ranges near the median of the
    nearest five count, so that edges stay where they are.

    Args:
        distance: (n,) m in order of bearing; NaN where no echo came back.
        config: how wide, and what is near.
    """
    if config.smooth == 0 or len(distance) == 0:
        return distance
    width = config.smooth
    wide = np.pad(distance, width, constant_values=np.nan)
    around = np.lib.stride_tricks.sliding_window_view(wide, 2 * width + 1)
    middle = around[:, max(0, width - 2) : width + 3]
    rising = np.sort(middle, axis=1)
    known = np.count_nonzero(np.isfinite(middle), axis=1)
    reference = np.take_along_axis(rising, (np.maximum(known - 1, 0) // 2)[:, None], axis=1)
    same = np.abs(around - reference) <= config.same
    count = np.count_nonzero(same, axis=1)
    mean = np.where(same, around, 0.0).sum(axis=1) / np.maximum(count, 1)
    return np.where(np.isfinite(distance), mean, np.nan)
