"""What the robot knows of its surroundings: newest sweep, points out of sight, coarse map.

A tick that brings a sweep sees its points; memory and map can follow on the next
tick, so that no tick has to do everything.
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.grid import MapGrid
from bluefoot_mpc.navigation.memory import PointMemory, nearest
from bluefoot_mpc.navigation.pose import Pose, PoseHistory, pose_of
from bluefoot_mpc.navigation.scan import LevelScan, ScanReader
from bluefoot_mpc.types import BodyState, FloatArray, LidarScan, SensorFrame

_NO_SWEEP = "no sweep of the LIDAR yet"


class Surroundings:
    """Gathers what stands around the robot.

    Attributes:
        pose: of the robot now.
        scan: newest usable sweep; None before the first.
        grid: coarse map.

    Args:
        config: of each part.
        mounts: where the sensors are.
    """

    def __init__(self, config: NavigationConfig, mounts: SensorMounts) -> None:
        self._config = config
        self._reader = ScanReader(config.scan, mounts)
        self._history = PoseHistory()
        self._memory = PointMemory(config.memory)
        self.grid = MapGrid(config.grid)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._history.reset()
        self._memory.reset()
        self.grid.reset()
        self.pose = Pose(0.0, 0.0, 0.0)
        self.scan: LevelScan | None = None
        self._pending: tuple[LevelScan, Pose] | None = None
        self._fresh: FloatArray | None = None
        self._fault = _NO_SWEEP
        self._lost = False

    def step(self, frame: SensorFrame, estimate: BodyState) -> bool:
        """Take in a frame; True where it brought a usable sweep."""
        pose = pose_of(estimate)
        self._lost = not all(map(math.isfinite, pose))
        if self._lost:
            return False
        self.pose = pose
        self._history.add(estimate)
        return frame.lidar is not None and self._take(frame.lidar, frame.time)

    def settle(self) -> bool:
        """Put the newest sweep into memory and map; False where that had been done."""
        if self._pending is None:
            return False
        self._memory.step(*self._pending)
        self.grid.step(*self._pending)
        self._pending = self._fresh = None
        return True

    def points(self) -> FloatArray:
        """(n, 2) m in the robot frame: the nearest things around it, out of sight ones too."""
        known = self.pose.to_robot(self._memory.points)
        return known if self._fresh is None else np.concatenate((self._fresh, known))

    def blind(self, time: float) -> str:
        """Why the robot cannot see at a time (s); empty while it can."""
        if self._lost:
            return "the estimated place of the robot is not a number"
        if self.scan is None:
            return self._fault
        age = time - self.scan.time
        if age <= self._config.scan.stale_after:
            return ""
        return f"no usable sweep of the LIDAR for {age:.1f} s" + (f": {self._fault}" if self._fault else "")

    @property
    def open_ground(self) -> bool:
        """True where the newest sweep met hardly anything."""
        return self.scan is not None and float(self.scan.hit.mean()) < self._config.scan.open_share

    def openness(self) -> float:
        """Mean range to the left less that to the right (m): positive where the left is more open."""
        if self.scan is None:
            return 0.0
        left = self.scan.bearing > 0.0
        distance = self.scan.distance
        return float(np.mean(distance[left]) - np.mean(distance[~left]))

    def _take(self, sweep: LidarScan, now: float) -> bool:
        config = self._config.scan
        if not -config.stale_after <= sweep.time - now <= config.ahead:
            self._fault = f"the sweep's time stamp, {sweep.time:.2f} s, is not that of a sweep of now"
            return False
        state = self._history.at(sweep.time)
        result = self._reader.read(sweep, state)
        if isinstance(result, str):
            self._fault = result
            return False
        if self.scan is not None and not result.time > self.scan.time:
            self._fault = "the sweep is not newer than the last one"
            return False
        if self._all_gone(result):
            self._fault = "no echo in the whole sweep, though things were near: is the LIDAR covered?"
            return False
        self.settle()
        self._fault = ""
        self.scan = result
        pose = pose_of(state)
        self._pending = (result, pose)
        self._fresh = nearest(result, self._config.memory)
        if pose != self.pose:
            self._fresh = self.pose.to_robot(pose.to_odometry(self._fresh))
        return True

    def _all_gone(self, sweep: LevelScan) -> bool:
        """True where a sweep without any echo follows one with things near and well inside the view.

        Such things do not vanish; what was at the edge of the view may just have left it.
        """
        if self.scan is None or sweep.hit.any():
            return False
        config, last = self._config.scan, self.scan
        near = last.hit & (last.distance < config.vanishing_range)
        inside = np.abs(last.bearing) < np.abs(last.bearing).max() - math.radians(config.edge_deg)
        return int(np.count_nonzero(near & inside)) >= config.vanishing_rays
