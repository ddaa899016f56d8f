"""The simulated LIDAR: one ray a step from its mounting point into the world, with the sensor's errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.io.lidar.geometry import GREATEST_RANGE, LEAST_RANGE, POINTS, bearings
from bluefoot_mpc.settings import require_nonnegative, require_range
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.types import FloatArray

NO_ECHO = 0
"""mm; what the sensor reports where nothing came back: an error code."""

_MILLIMETERS = 1000.0
_GREATEST = GREATEST_RANGE / _MILLIMETERS
_SKIN = 1e-4
"""m behind a surface of the robot at which a ray goes on."""
_SURFACES = 32
"""Surfaces of the robot that a ray may pass; behind more there is nothing to see."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarErrors:
    """Errors of the LIDAR: assumptions, in the range of the data sheet."""

    noise_near: float = 0.010  # m, standard deviation below near_range
    near_range: float = 1.0  # m
    noise_far: float = 0.01  # of the range, standard deviation beyond near_range
    dropouts: float = 0.005  # share of rays without an echo
    jitter_deg: float = 0.05  # degrees, standard deviation of a ray's bearing

    def __post_init__(self) -> None:
        require_nonnegative(
            noise_near=self.noise_near, near_range=self.near_range, noise_far=self.noise_far,
            jitter_deg=self.jitter_deg,
        )  # fmt: skip
        require_range(0.0, 1.0, dropouts=self.dropouts)


class RaycastLidar:
    """What the LIDAR measures in a MuJoCo world. All rays of a scan are cast at one moment.

    Args:
        model: MuJoCo model.
        data: its state, kinematics up to date.
        trunk: body that carries the sensor.
        mount: m, mounting point in the trunk's frame; the scan plane is the trunk's x-y plane there.
        errors: of the sensor.
        seed: of the run; the LIDAR draws from a stream of its own.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        trunk: int,
        mount: tuple[float, float, float],
        errors: LidarErrors | None = None,
        seed: int = 0,
    ) -> None:
        self._model, self._data, self._trunk = model, data, trunk
        self._mount = np.array(mount)
        self._errors, self._seed = errors or LidarErrors(), seed
        self._bearing = bearings()
        self._is_robot = model.body_rootid[model.geom_bodyid] == model.body_rootid[trunk]
        self._rays = np.zeros((POINTS, 3))
        self._distance = np.zeros(POINTS)
        self._geom = np.zeros(POINTS, dtype=np.int32)
        self.reset()

    def reset(self) -> None:
        """Start the errors of this run again."""
        self._random = stream(self._seed, "lidar")

    def scan(self, time: float) -> NDArray[np.int64]:
        """(682,) mm, right to left; `NO_ECHO` where none came back. What there is to see is seen now.

        Args:
            time: s, end of the sweep; not needed, the world is as it is.
        """
        del time
        errors, draw = self._errors, self._random.standard_normal((2, POINTS))
        lost = self._random.random(POINTS) < errors.dropouts
        distance = self.look(self._bearing + math.radians(errors.jitter_deg) * draw[0])
        is_near = distance < errors.near_range
        sigma = np.where(is_near, errors.noise_near, errors.noise_far * distance)
        # NaN (no echo) stays NaN through all of this.
        measured = np.rint((distance + sigma * draw[1]) * _MILLIMETERS)
        seen = ~lost & (measured >= LEAST_RANGE) & (measured <= GREATEST_RANGE)
        return np.where(seen, measured, NO_ECHO).astype(np.int64)

    def look(self, bearing: FloatArray) -> FloatArray:
        """(682,) m, true distances to the world along the rays; NaN beyond the range. The robot is invisible.

        Args:
            bearing: (682,) rad from forward, left positive.
        """
        rotation = self._data.xmat[self._trunk].reshape(3, 3)
        origin = self._data.xpos[self._trunk] + rotation @ self._mount
        self._rays[:] = np.cos(bearing)[:, None] * rotation[:, 0] + np.sin(bearing)[:, None] * rotation[:, 1]
        mujoco.mj_multiRay(
            self._model, self._data, origin, self._rays.reshape(-1), None, True, self._trunk,
            self._geom, self._distance, None, POINTS, _GREATEST,
        )  # fmt: skip
        distance = np.where(self._geom < 0, np.nan, self._distance)
        # One body alone can be left out of the cast; rays that met a leg are cast on from behind it.
        for ray in np.flatnonzero((self._geom >= 0) & self._is_robot[self._geom]):
            distance[ray] = self._beyond(origin, self._rays[ray], float(distance[ray]))
        distance[distance > _GREATEST] = np.nan
        return distance

    def _beyond(self, origin: FloatArray, ray: FloatArray, reach: float) -> float:
        geom = np.zeros(1, dtype=np.int32)
        for _ in range(_SURFACES):
            reach += _SKIN
            further = mujoco.mj_ray(
                self._model, self._data, origin + reach * ray, ray, None, True, self._trunk, geom
            )
            if geom[0] < 0:
                break
            reach += further
            if not self._is_robot[geom[0]]:
                return reach
        return math.nan
