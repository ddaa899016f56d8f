"""When the simulated robot looks: scans and pictures at their rates, each at its own physics step."""

from __future__ import annotations

from collections import deque

import mujoco

from bluefoot_mpc.io.lidar.geometry import SCAN_PERIOD
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.sim.body import NEVER
from bluefoot_mpc.sim.camera import RenderedCamera
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.lidar import RaycastLidar
from bluefoot_mpc.sim.world import World
from bluefoot_mpc.types import CameraImage, LidarScan


class Sight:
    """LIDAR and camera of a simulated robot, as far as its configuration has them.

    A scan is of the world at the end of its sweep and arrives at once. A picture
    is of the world at its exposure and arrives when the next one is exposed.

    Attributes:
        due: physics step at which somebody looks next; `NEVER` without sensors.

    Args:
        world: compiled model and state.
        mounts: where the sensors are on the trunk.
        config: the simulation.
        seed: of the run.

    Raises:
        ConfigurationError: a camera is asked for and nothing here can draw its pictures.
    """

    def __init__(self, world: World, mounts: SensorMounts, config: SimConfig, seed: int) -> None:
        self._world, self._dt = world, config.physics_period
        body = (world.model, world.data, world.trunk)
        self._lidar = RaycastLidar(*body, mounts, config.lidar, seed) if config.lidar.enabled else None
        self._camera = None
        if config.camera.enabled:
            self._camera = RenderedCamera(*body, mounts.camera, mounts.camera_view_deg, config.camera, seed)
        self._picture_steps = config.camera.period / self._dt
        self._scan_steps = SCAN_PERIOD / self._dt
        self.reset()

    def reset(self) -> None:
        """Begin the run again: the first scan and exposure are at step zero."""
        self._scan: LidarScan | None = None
        self._arriving: deque[tuple[int, CameraImage]] = deque()
        self._scans = self._pictures = 0
        for sensor in (self._lidar, self._camera):
            if sensor is not None:
                sensor.reset()
        self._plan()

    def look(self, step: int) -> None:
        """Do what is due at a physics step; the state is that step's.

        Args:
            step: of the simulation.
        """
        # Positions are those of the step before until somebody works them out.
        mujoco.mj_kinematics(self._world.model, self._world.data)
        time = step * self._dt
        if self._lidar is not None and step >= self._scan_due:
            self._scan = self._lidar.measure(time)
            self._scans += 1
        if self._camera is not None and step >= self._picture_due:
            self._pictures += 1
            arrival = round(self._pictures * self._picture_steps)
            self._arriving.append((arrival, self._camera.picture(time)))
        self._plan()

    def take(self, step: int) -> tuple[LidarScan | None, CameraImage | None]:
        """What has arrived up to a step since the last call: the newest of each kind."""
        scan, self._scan = self._scan, None
        image = None
        while self._arriving and self._arriving[0][0] <= step:
            image = self._arriving.popleft()[1]
        return scan, image

    @property
    def has_news(self) -> bool:
        """True where something has been seen that no frame has yet."""
        return self._scan is not None or bool(self._arriving)

    def close(self) -> None:
        """Give the graphics memory back; there are no more pictures. Idempotent."""
        if self._camera is not None:
            self._camera.close()
            self._camera = None
            self._plan()

    def _plan(self) -> None:
        self._scan_due = round(self._scans * self._scan_steps) if self._lidar is not None else NEVER
        self._picture_due = round(self._pictures * self._picture_steps) if self._camera is not None else NEVER
        self.due = min(self._scan_due, self._picture_due)
