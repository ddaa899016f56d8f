"""From a LIDAR sweep to what stands around the robot, in the levelled robot frame.

The LIDAR is fixed to the trunk, so its plane tilts with it: with the nose down a
ray meets the floor ahead, which is nothing to avoid. The levelled robot frame has
its origin at the trunk's, x along the heading, z up.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.types import BodyState, BoolArray, FloatArray, LidarScan


@dataclass(frozen=True, kw_only=True, slots=True)
class ScanConfig:
    """What is made of a sweep, and which sweeps are of use."""

    greatest_range: float = 5.6  # m; a ray without an echo counts as this far (URG-04LX)
    least_range: float = 0.02  # m; nearer values are the sensor's error codes
    floor_height: float = 0.06  # m above the feet; lower echoes are the floor
    floor_slope: float = 0.012  # added to it per metre of range: errors of the tilt grow with it
    stale_after: float = 0.5  # s without a new sweep: the robot stands
    ahead: float = 0.05  # s that a time stamp may lie ahead of the frame's
    vanishing_range: float = 4.0  # m; what was nearer cannot all be gone in the next sweep
    vanishing_rays: int = 5  # that must have met it
    edge_deg: float = 20.0  # degrees at either edge of the view, where things leave it as the robot turns
    open_share: float = 0.05  # of the rays; where fewer meet a thing the ground counts as open
    open_speed: float = 0.10  # m/s, at most, on open ground
    least_rays: int = 40  # in a sweep that is of use
    least_view_deg: float = 60.0  # degrees that it must cover to either side of forward
    greatest_gap_deg: float = 3.0  # degrees between neighbouring rays, at most

    def __post_init__(self) -> None:
        require_positive(
            greatest_range=self.greatest_range, stale_after=self.stale_after, least_rays=self.least_rays,
            greatest_gap_deg=self.greatest_gap_deg, vanishing_range=self.vanishing_range,
            open_speed=self.open_speed, vanishing_rays=self.vanishing_rays,
        )  # fmt: skip
        require_nonnegative(
            least_range=self.least_range,
            floor_height=self.floor_height,
            floor_slope=self.floor_slope,
            ahead=self.ahead,
        )
        require_range(1.0, 180.0, least_view_deg=self.least_view_deg)
        require_range(0.0, 90.0, edge_deg=self.edge_deg)
        require_range(0.0, 1.0, open_share=self.open_share)


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelScan:
    """A usable sweep.

    Attributes:
        time: s, end of the sweep.
        bearing: (n,) rad from forward in the LIDAR's plane, rising, left positive.
        distance: (n,) m; where nothing came back the greatest range.
        points: (n, 2) m, ends of the rays in the levelled robot frame.
        hit: (n,) True where the ray ended at a thing: neither on the floor nor nowhere.
        origin: (2,) m, the LIDAR in the levelled robot frame.
    """

    time: float
    bearing: FloatArray
    distance: FloatArray
    points: FloatArray
    hit: BoolArray
    origin: FloatArray


class ScanReader:
    """Makes sweeps level; keeps what depends on the bearings alone.

    Args:
        config: which sweeps are of use.
        mounts: where the LIDAR is.
    """

    def __init__(self, config: ScanConfig, mounts: SensorMounts) -> None:
        self._config = config
        self._mount = mounts.lidar
        self._turn = mounts.lidar_rotation if any(mounts.lidar_rpy_deg) else None
        self._bearing = self._newest = np.zeros(0)
        self._directions = np.zeros((0, 2))
        self._fault = "no rays"

    def read(self, scan: LidarScan, estimate: BodyState) -> LevelScan | str:
        """The levelled sweep, or why it is of no use, in few words.

        Args:
            scan: as it came from the sensor.
            estimate: the robot at the time of the sweep; its tilt and height count.
        """
        fault = self._unusable(scan)
        if fault:
            return fault
        config = self._config
        raw = np.asarray(scan.distance, dtype=np.float64)
        echo = (raw >= config.least_range) & (raw <= config.greatest_range)
        distance = np.where(echo, raw, config.greatest_range)
        level, rise, origin, lift = self._tilted(estimate)
        points = (self._directions @ level) * distance[:, None]
        points += origin
        return LevelScan(
            time=scan.time, bearing=self._bearing, distance=distance, points=points,
            hit=echo & np.logical_not(self._on_the_floor(distance, rise, lift)), origin=origin,
        )  # fmt: skip

    def _tilted(self, estimate: BodyState) -> tuple[FloatArray, FloatArray, FloatArray, float]:
        """How the tilt turns the sensor's plane.

        Returns:
            (2, 2) from directions in the plane to the level, (2,) their rise per metre, (2,) the LIDAR in the
            robot frame (m), and its height above the feet (m).
        """
        roll, pitch, _ = estimate.rpy.tolist()
        cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
        x, y, z = self._mount
        origin = np.array((cp * x + sp * (sr * y + cr * z), cr * y - sr * z))
        lift = -sp * x + cp * (sr * y + cr * z) + estimate.height
        level = np.array(((cp, 0.0), (sp * sr, cr)))
        rise = np.array((-sp, cp * sr))
        if self._turn is not None:
            # The sensor's own tilt in the trunk comes first.
            tilt = np.array(((cp, sp * sr, sp * cr), (0.0, cr, -sr), (-sp, cp * sr, cp * cr))) @ self._turn
            level, rise = tilt[:2, :2].T, tilt[2, :2]
        return level, rise, origin, lift

    def _on_the_floor(self, distance: FloatArray, rise: FloatArray, lift: float) -> BoolArray | bool:
        """(n,) True where a ray ends so low that it must have met the floor; False where none can."""
        config = self._config
        steepest = math.hypot(*rise.tolist()) + config.floor_slope
        if lift - config.greatest_range * steepest > config.floor_height:
            return False
        return np.asarray(
            lift + distance * (self._directions @ rise - config.floor_slope) < config.floor_height
        )

    def _unusable(self, scan: LidarScan) -> str:
        """Why the sweep is of no use; empty where it is."""
        if not scan.valid:
            return "sweep marked as invalid"
        if scan.bearing.shape != scan.distance.shape or scan.bearing.ndim != 1:
            return "bearings and distances do not match"
        if scan.bearing is not self._newest and not np.array_equal(scan.bearing, self._bearing):
            self._take_bearings(np.array(scan.bearing, dtype=np.float64))
        self._newest = scan.bearing
        return self._fault

    def _take_bearings(self, bearing: FloatArray) -> None:
        self._bearing = bearing
        self._directions = np.column_stack((np.cos(bearing), np.sin(bearing)))
        self._fault = self._unusable_bearings(bearing)

    def _unusable_bearings(self, bearing: FloatArray) -> str:
        if not np.isfinite(bearing).all():
            return "bearings are not numbers"
        if bearing.size < self._config.least_rays:
            return f"only {bearing.size} rays"
        steps = np.diff(bearing)
        if steps.min() <= 0.0:
            return "bearings do not rise from right to left"
        if steps.max() > math.radians(self._config.greatest_gap_deg):
            return "gaps between the rays"
        if min(-bearing[0], bearing[-1]) < math.radians(self._config.least_view_deg):
            return "the sweep does not reach far enough to both sides"
        return ""
