"""What stood around the robot a moment ago and is out of the LIDAR's sight now.

The LIDAR does not see the 120 degrees behind, and thin legs drop out of single
sweeps. So the nearest points of past sweeps are kept in the odometry frame until
a newer sweep shows them again or looks through them, or until they are too old
or too far for the odometry to be trusted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.navigation.scan import LevelScan
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class MemoryConfig:
    """How much is kept, and for how long."""

    reach: float = 1.5  # m around the robot within which points are kept
    rays: int = 7  # neighbours of which the nearest is kept: 2.5 degrees of the URG-04LX
    capacity: int = 400  # points, at most
    age: float = 40.0  # s after which a point out of sight is forgotten
    travel: float = 5.0  # m after which it is
    same: float = 0.10  # m, a sweep's range differs less where it shows a point again
    misses: int = 3  # sweeps that look through a point until it is gone
    no_echo: float = 0.25  # of such a sweep, where the ray met nothing at all
    cell: float = 0.03  # m, of points in one such square one is kept
    thin_every: int = 10  # sweeps after which they are thinned out so

    def __post_init__(self) -> None:
        require_positive(
            reach=self.reach, rays=self.rays, capacity=self.capacity, age=self.age, travel=self.travel,
            misses=self.misses, cell=self.cell, thin_every=self.thin_every, no_echo=self.no_echo,
        )  # fmt: skip
        require_nonnegative(same=self.same)


class PointMemory:
    """Points around the robot, those of the newest sweep last.

    Args:
        config: how much is kept.
    """

    def __init__(self, config: MemoryConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._points = np.zeros((0, 2))
        self._seen = np.zeros((0, 3))  # time (s), travel (m), sweeps that looked through it
        self._travel = 0.0
        self._pose: Pose | None = None
        self._sweeps = 0

    @property
    def points(self) -> FloatArray:
        """(n, 2) m, in the odometry frame."""
        return self._points

    def step(self, scan: LevelScan, pose: Pose) -> None:
        """Take in a sweep.

        Args:
            scan: the newest sweep.
            pose: of the robot at the time of the sweep.
        """
        config = self._config
        if self._pose is not None:
            self._travel += math.hypot(pose.x - self._pose.x, pose.y - self._pose.y)
        self._pose = pose
        self._sweeps += 1
        keep = self._kept(scan, pose)
        fresh = pose.to_odometry(nearest(scan, config))
        now = np.broadcast_to(np.array((scan.time, self._travel, 0.0)), (len(fresh), 3))
        self._points = np.concatenate((self._points[keep], fresh))[-config.capacity :]
        self._seen = np.concatenate((self._seen[keep], now))[-config.capacity :]
        if self._sweeps % config.thin_every == 0:
            self._thin_out()

    def _kept(self, scan: LevelScan, pose: Pose) -> BoolArray:
        """(n,) True for the points that the sweep neither shows again nor refutes."""
        config = self._config
        rel = pose.to_robot(self._points) - scan.origin
        far = np.hypot(rel[:, 0], rel[:, 1])
        bearing = np.arctan2(rel[:, 1], rel[:, 0])
        last = scan.bearing.size - 1
        ray = np.searchsorted(scan.bearing, bearing)
        inside = (ray > 0) & (ray <= last)
        np.clip(ray, 1, last, out=ray)
        # The nearest of the rays to both sides: what is thin may be met by one alone.
        range_ = np.minimum(scan.distance[ray], scan.distance[ray - 1])
        shown = inside & (np.abs(range_ - far) <= config.same)
        through = inside & (range_ > far + config.same)
        # A ray that met nothing is a weak proof: glass and black things send nothing back either.
        proof = np.where(scan.hit[ray] & scan.hit[ray - 1], 1.0, config.no_echo)
        self._seen[:, 2] += proof * through
        young = (self._seen[:, 0] > scan.time - config.age) & (
            self._seen[:, 1] > self._travel - config.travel
        )
        return np.asarray(
            ~shown & young & (self._seen[:, 2] < config.misses) & (far < config.reach + config.same)
        )

    def _thin_out(self) -> None:
        """Keep the newest point of each small square."""
        cells = np.floor(self._points / self._config.cell).astype(np.int64)
        key = (cells[:, 0] << 32) + cells[:, 1]
        _, newest = np.unique(key[::-1], return_index=True)
        keep = np.sort(len(key) - 1 - newest)
        self._points, self._seen = self._points[keep], self._seen[keep]


def nearest(scan: LevelScan, config: MemoryConfig) -> FloatArray:
    """(m, 2) m, in the robot frame: of each few rays the nearest end that is a thing within reach."""
    count = scan.distance.size // config.rays * config.rays
    skip = (scan.distance.size - count) // 2
    distance = np.where(scan.hit, scan.distance, np.inf)[skip : skip + count].reshape(-1, config.rays)
    ray = distance.argmin(axis=1)
    ray += np.arange(skip, skip + count, config.rays)
    return np.asarray(scan.points[ray[scan.hit[ray] & (scan.distance[ray] < config.reach)]])
