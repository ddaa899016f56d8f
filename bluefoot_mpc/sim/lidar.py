"""The simulated LIDAR: one ray a step from its mounting point into the world, with the sensor's errors."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.io.lidar.geometry import GREATEST_RANGE, LEAST_RANGE, POINTS, bearings
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.sim.sight_config import LidarConfig
from bluefoot_mpc.sim.terrain import WORLD_GROUPS
from bluefoot_mpc.types import FloatArray, LidarScan

NO_ECHO = 0
"""mm; what the sensor reports where nothing came back: an error code."""

_MILLIMETERS = 1000.0
_GREATEST = GREATEST_RANGE / _MILLIMETERS
_BEARING = bearings()
_BEARING.flags.writeable = False


class RaycastLidar:
    """What the LIDAR measures in a MuJoCo world. All rays of a scan are cast at one moment.

    It sees the geoms of the groups of floor and things; the robot's own are in
    others, so that its legs are invisible (on the real robot the head is above them).

    Args:
        model: MuJoCo model.
        data: its state, kinematics up to date.
        trunk: body that carries the sensor.
        mounts: where the sensor is on the trunk, and how its scan plane is turned there.
        config: errors of the sensor.
        seed: of the run; the LIDAR draws from a stream of its own.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        trunk: int,
        mounts: SensorMounts,
        config: LidarConfig | None = None,
        seed: int = 0,
    ) -> None:
        self._model, self._data, self._trunk = model, data, trunk
        self._config, self._seed = config or LidarConfig(), seed
        self._mount = np.array(mounts.lidar) + self._config.mount_error_m
        error = rotation_from_rpy(np.radians(self._config.mount_error_deg))
        self._turn = mounts.lidar_rotation @ error
        self._plane = np.zeros((POINTS, 2))
        self._rays = np.zeros((POINTS, 3))
        self._distance = np.zeros(POINTS)
        self._geom = np.zeros(POINTS, dtype=np.int32)
        self.reset()

    def reset(self) -> None:
        """Start the errors of this run again."""
        self._random = stream(self._seed, "lidar")

    def measure(self, time: float) -> LidarScan:
        """A scan as the driver of a real sensor gives it. What there is to see is seen now.

        Args:
            time: s, end of the sweep.
        """
        measured = self._measured()
        measured *= 1.0 / _MILLIMETERS
        return LidarScan(time=time, bearing=_BEARING, distance=measured, valid=True)

    def scan(self, time: float) -> NDArray[np.int64]:
        """(682,) mm, right to left, as the sensor sends them; `NO_ECHO` where none came back.

        Args:
            time: s, end of the sweep; not needed, the world is as it is.
        """
        del time
        return np.nan_to_num(self._measured(), nan=NO_ECHO).astype(np.int64)

    def look(self, bearing: FloatArray) -> FloatArray:
        """(682,) m, true distances to the world along the rays; NaN beyond the range.

        Args:
            bearing: (682,) rad from forward, left positive.
        """
        rotation = self._data.xmat[self._trunk].reshape(3, 3)
        origin = self._data.xpos[self._trunk] + rotation @ self._mount
        np.cos(bearing, out=self._plane[:, 0])
        np.sin(bearing, out=self._plane[:, 1])
        np.matmul(self._plane, (rotation @ self._turn)[:, :2].T, out=self._rays)
        # Bodies of the robot are among those that are looked at: the groups leave them out.
        mujoco.mj_multiRay(
            self._model, self._data, origin, self._rays.reshape(-1), WORLD_GROUPS, True, self._trunk,
            self._geom, self._distance, None, POINTS, _GREATEST,
        )  # fmt: skip
        missed = (self._geom < 0) | (self._distance > _GREATEST)
        return np.where(missed, np.nan, self._distance)

    def _measured(self) -> FloatArray:
        """(682,) whole mm with the sensor's errors; NaN where no echo came back."""
        config = self._config
        turn, error = self._random.standard_normal((2, POINTS))
        lost = self._random.random(POINTS) < config.dropouts
        turn *= math.radians(config.jitter_deg)
        turn += _BEARING
        distance = self.look(turn)
        # NaN (no echo) stays NaN through all of this.
        error *= np.where(distance < config.near_range, config.noise_near, config.noise_far * distance)
        distance += error
        distance *= _MILLIMETERS
        np.rint(distance, out=distance)
        lost |= (distance < LEAST_RANGE) | (distance > GREATEST_RANGE)
        distance[lost] = np.nan
        return distance
