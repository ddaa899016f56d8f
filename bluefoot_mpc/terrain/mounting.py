"""How the LIDAR is really turned on the trunk, found from a sweep of a flat, level floor.

A scan plane that is turned on the trunk sees a flat floor bent: a wrong roll tilts it sideways, a wrong
pitch lifts it the more the further away, a wrong height shifts all of it. A wrong yaw tilts it sideways
too, but the more the further the nose is down; that is little to go by, so yaw comes out a few times less
certain. The place along x and y moves points within the floor and cannot be found from it. A floor that
slopes looks like a sensor that is turned, so the floor must be level.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion, rotation_from_rpy, rpy_from_rotation
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import FloatArray, LidarScan

_YAW_SHARE = 3.0
"""Yaw is seen as the roll that changes with sin(pitch), by a third from 11 to 31 degrees."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MountingConfig:
    """Which points count, and when a result is refused."""

    least_range: float = 0.20  # m from the sensor
    greatest_range: float = 1.60  # m from the sensor
    least_scans: int = 10
    least_points: int = 1000
    least_span_deg: float = 6.0  # degrees of pitch between the first and the last scan
    first_band: float = 0.15  # m above and below the floor, at first ...
    band: float = 0.05  # ... and once the sensor's tilt is roughly known
    noise: float = 0.010  # m, standard deviation of a range below 1 m
    noise_far: float = 0.01  # of the range beyond
    max_misfit: float = 1.4  # spread of the heights over what the sensor's noise explains
    least_share: float = 0.90  # of the points near enough must lie within the band
    max_angle_deg: float = 8.0  # degrees; more is no error of mounting
    rounds: int = 6  # of the least squares
    max_slope_deg: float = 0.6  # degrees, of the floor under the feet
    pose_error_deg: float = 0.05  # degrees, of the estimated attitude, that all scans may share
    pose_error: float = 0.0006  # m, of the estimated height

    def __post_init__(self) -> None:
        require_positive(
            least_range=self.least_range, first_band=self.first_band, band=self.band, noise=self.noise,
            noise_far=self.noise_far, max_misfit=self.max_misfit, max_angle_deg=self.max_angle_deg,
            least_span_deg=self.least_span_deg, max_slope_deg=self.max_slope_deg,
        )  # fmt: skip
        require_nonnegative(pose_error_deg=self.pose_error_deg, pose_error=self.pose_error)
        require_range(self.least_range, 5.6, greatest_range=self.greatest_range)
        require_range(0.0, 1.0, least_share=self.least_share)
        require_range(2, 1000, least_scans=self.least_scans, rounds=self.rounds)
        require_range(10, 10_000_000, least_points=self.least_points)


class Floor(NamedTuple):
    """The floor as the feet show it.

    Attributes:
        height: m, in the odometry frame.
        slope: rad, of the plane under the feet against the level.
    """

    height: float
    slope: float


class PosedScan(NamedTuple):
    """A scan, and where the trunk was.

    Attributes:
        scan: as it came from the sensor.
        position: (3,) m, trunk origin in the odometry frame.
        quaternion: (4,) x, y, z, w: rotation_base_to_world.
    """

    scan: LidarScan
    position: FloatArray
    quaternion: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class Mounting:
    """How the LIDAR is mounted, or why that was not found.

    Attributes:
        rpy_deg: (3,) degrees, for ``sensors.lidar_rpy_deg`` of the parameter file.
        height: m, of the LIDAR over the trunk's origin, for the third of ``sensors.lidar``.
        deviation_deg: (3,) degrees, standard deviation of roll, pitch and yaw.
        height_deviation: m, of the height.
        misfit: spread of the heights over what the sensor's noise explains; about 1 on a flat floor.
        points: how many counted.
        reason: why nothing was found; empty where it was.
    """

    rpy_deg: FloatArray
    height: float
    deviation_deg: FloatArray
    height_deviation: float
    misfit: float = math.nan
    points: int = 0
    reason: str = ""


class _Rays(NamedTuple):
    """All rays of a sweep, one a row.

    Attributes:
        ends: (n, 2) m, in the plane of the LIDAR.
        distance: (n,) m.
        scan: (n,) which scan each is of.
        up: (n, 3) third row of the rotation from the base to the world.
        base: (n,) m, height of the trunk's origin.
    """

    ends: FloatArray
    distance: FloatArray
    scan: FloatArray
    up: FloatArray
    base: FloatArray


class _Fit(NamedTuple):
    """Where the least squares stand.

    Attributes:
        rotation: (3, 3) from the LIDAR to the base.
        height: m, of the LIDAR over the trunk's origin.
        covariance: (4, 4) of roll, pitch, yaw (rad) and height (m).
        misfit: spread of the heights over what noise explains.
        share: of the points near enough that lie within the band.
        points: how many do.
    """

    rotation: FloatArray
    height: float
    covariance: FloatArray
    misfit: float
    share: float
    points: int


def find_mounting(
    looks: Sequence[PosedScan], floor: Floor, mounts: SensorMounts, config: MountingConfig | None = None
) -> Mounting:
    """Roll, pitch, yaw and height of the LIDAR on the trunk, from a sweep of a flat, level floor.

    Args:
        looks: scans of the sweep with the estimated poses of the trunk.
        floor: the floor as the feet show it.
        mounts: what is believed so far; its place along x and y is kept.
        config: which points count.
    """
    config = config or MountingConfig()
    slope = math.degrees(floor.slope)
    if not (math.isfinite(floor.height) and slope <= config.max_slope_deg):
        return _refused(mounts, f"floor slopes by {slope:.1f} degrees: sweep a level one")
    rays, fault = _rays(looks, config)
    if fault:
        return _refused(mounts, fault)
    fit = _Fit(mounts.lidar_rotation, mounts.lidar[2], np.eye(4), math.nan, 1.0, 0)
    for k in range(config.rounds):
        fit = _improved(
            fit, rays, floor.height, mounts, (config, config.first_band if k < 2 else config.band)
        )
        if fit.points < config.least_points:
            return _refused(mounts, f"only {fit.points} points on the floor: sweep a free one")
    return _judged(fit, mounts, config)


def _judged(fit: _Fit, mounts: SensorMounts, config: MountingConfig) -> Mounting:
    """The result of the least squares, or why it is none."""
    roll, pitch, yaw = np.degrees(rpy_from_rotation(fit.rotation)).tolist()
    if fit.share < config.least_share or fit.misfit > config.max_misfit:
        return _refused(mounts, f"floor not flat ({fit.misfit:.1f} x noise): sweep a flat one")
    if math.hypot(roll, pitch) > config.max_angle_deg:
        return _refused(mounts, f"tilted by {math.hypot(roll, pitch):.1f} degrees: look at the sensor")
    angle = math.radians(config.pose_error_deg)
    shared = np.array((angle, angle, _YAW_SHARE * angle, config.pose_error))
    spread = np.sqrt(np.diag(fit.covariance) + shared**2)
    return Mounting(
        rpy_deg=np.array((roll, pitch, yaw)), height=fit.height, deviation_deg=np.degrees(spread[:3]),
        height_deviation=float(spread[3]), misfit=fit.misfit, points=fit.points,
    )  # fmt: skip


def _refused(mounts: SensorMounts, reason: str) -> Mounting:
    return Mounting(
        rpy_deg=np.array(mounts.lidar_rpy_deg), height=mounts.lidar[2], deviation_deg=np.full(3, math.inf),
        height_deviation=math.inf, reason=reason,
    )  # fmt: skip


def _rays(looks: Sequence[PosedScan], config: MountingConfig) -> tuple[_Rays, str]:
    """The rays that are near enough, and why they are of no use; empty where they are."""
    parts, pitches = [], []
    for number, (scan, position, quaternion) in enumerate(looks):
        distance, bearing = np.asarray(scan.distance), np.asarray(scan.bearing)
        posed = np.isfinite(position).all() and np.isfinite(quaternion).all()
        if not (scan.valid and posed and distance.shape == bearing.shape and distance.ndim == 1):
            continue
        near = (distance >= config.least_range) & (distance <= config.greatest_range) & np.isfinite(bearing)
        distance, bearing = distance[near], bearing[near]
        up = rotation_from_quaternion(quaternion)[2]
        pitches.append(math.asin(min(max(-float(up[0]), -1.0), 1.0)))
        ends = np.column_stack((distance * np.cos(bearing), distance * np.sin(bearing)))
        n = len(distance)
        parts.append(
            _Rays(ends, distance, np.full(n, float(number)), np.tile(up, (n, 1)), np.full(n, position[2]))
        )
    if len(parts) < config.least_scans:
        return _Rays(*[np.zeros(0)] * 5), f"only {len(parts)} usable scans: sweep more levels"
    span = math.degrees(max(pitches) - min(pitches))
    if span < config.least_span_deg:
        return _Rays(*[np.zeros(0)] * 5), (f"pitched through {span:.1f} degrees only: sweep further")
    return _Rays(*(np.concatenate(column) for column in zip(*parts, strict=True))), ""


def _improved(
    fit: _Fit, rays: _Rays, floor: float, mounts: SensorMounts, how: tuple[MountingConfig, float]
) -> _Fit:
    """One round of Gauss and Newton; a point counts less the further it is off the floor (Huber)."""
    config, band = how
    tilt = rays.up @ fit.rotation  # third row of the rotation from the LIDAR to the world
    x, y, _ = mounts.lidar
    place = np.array((x, y, fit.height))
    error = rays.base + rays.up @ place + (tilt[:, :2] * rays.ends).sum(axis=1) - floor
    near = np.abs(error) <= band
    if np.count_nonzero(near) < config.least_points:
        return fit._replace(points=int(np.count_nonzero(near)))
    slope = np.abs((tilt[:, :2] * rays.ends).sum(axis=1)) / rays.distance
    noise = np.maximum(config.noise, config.noise_far * rays.distance) * np.maximum(slope, 0.05)
    scaled = error[near] / noise[near]
    weight = 1.0 / np.maximum(np.abs(scaled) / 2.0, 1.0)
    # A turn (a, b, c) about the LIDAR's own axes moves an end (x, y, 0) by (-c y, c x, a y - b x).
    ahead, aside = rays.ends.T
    turned = tilt[:, 1] * ahead - tilt[:, 0] * aside
    rows = np.column_stack((tilt[:, 2] * aside, -tilt[:, 2] * ahead, turned, rays.up[:, 2]))
    rows = rows[near] / noise[near, None]
    normal = rows.T @ (weight[:, None] * rows)
    step = -np.linalg.solve(normal, rows.T @ (weight * scaled))
    return _Fit(
        rotation=fit.rotation @ rotation_from_rpy(step[:3]),
        height=fit.height + float(step[3]),
        covariance=_covariance(rows, weight * scaled, normal, rays.scan[near]),
        misfit=float(1.4826 * np.median(np.abs(scaled))),
        share=float(near.mean()),
        points=int(near.sum()),
    )


def _covariance(rows: FloatArray, errors: FloatArray, normal: FloatArray, scan: FloatArray) -> FloatArray:
    """(4, 4) of roll, pitch, yaw (rad) and height (m): points of one scan share the error of its pose."""
    number = scan.astype(np.intp)
    pull = np.zeros((int(number.max()) + 1, 4))
    np.add.at(pull, number, rows * errors[:, None])
    inverse = np.linalg.inv(normal)
    return np.asarray(inverse @ (pull.T @ pull) @ inverse)
