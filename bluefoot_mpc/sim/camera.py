"""The simulated forward camera: pictures drawn off the screen, with the errors of a cheap sensor.

A pinhole without distortion. What lies at (x, y, z) from the lens, in the
trunk's axes, is seen at column ``width / 2 - f·y / x`` and row ``height / 2 -
f·z / x``, counted from the picture's left and upper edge (the centre of the first
pixel is at 0.5), with the focal length f of `SensorMounts.focal_length`.
"""

from __future__ import annotations

import atexit
import importlib
import math
import weakref
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.sim.graphics import graphics_context
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.sim.sight_config import CameraConfig
from bluefoot_mpc.sim.terrain import WORLD_GROUPS
from bluefoot_mpc.types import CameraImage

_NEAR, _FAR = 0.02, 60.0
"""m from the lens between which things are drawn."""
_MAX_GEOMS = 4000
_EFFECTS = (
    mujoco.mjtRndFlag.mjRND_SHADOW,
    mujoco.mjtRndFlag.mjRND_REFLECTION,
    mujoco.mjtRndFlag.mjRND_HAZE,
    mujoco.mjtRndFlag.mjRND_FOG,
)
"""What costs time and shows nothing that the robot could use."""


class RenderedCamera:
    """Pictures of a MuJoCo world from the robot's trunk; the robot itself is not in them.

    Args:
        model: MuJoCo model; its quality of off-screen pictures is set.
        data: its state, kinematics up to date.
        trunk: body that carries the camera.
        mount: m, the lens in the trunk's frame; it looks along x, up is z.
        view_deg: degrees from the left edge of a picture to its right edge.
        config: size and errors.
        seed: of the run; the camera draws from a stream of its own.

    Raises:
        ConfigurationError: nothing here can draw.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        data: mujoco.MjData,
        trunk: int,
        mount: tuple[float, float, float],
        view_deg: float,
        config: CameraConfig,
        seed: int = 0,
    ) -> None:
        self._model, self._data, self._trunk = model, data, trunk
        self._mount, self._config, self._seed = np.array(mount), config, seed
        self._cv2 = importlib.import_module("cv2")
        self._half = math.tan(0.5 * math.radians(view_deg)) * config.height / config.width
        self._option, self._view = mujoco.MjvOption(), mujoco.MjvCamera()
        self._option.geomgroup[:] = WORLD_GROUPS
        self._option.sitegroup[:] = 0
        self._scene = mujoco.MjvScene(model, _MAX_GEOMS)
        for effect in _EFFECTS:
            self._scene.flags[effect] = 0
        quality, size = model.vis.quality, model.vis.global_
        quality.offsamples, quality.shadowsize = 0, 0
        size.offwidth, size.offheight = config.width, config.height
        self._rectangle = mujoco.MjrRect(0, 0, config.width, config.height)
        self._drawn = np.empty((config.height, config.width, 3), dtype=np.uint8)
        self._graphics = graphics_context(config.width, config.height)
        with self._graphics.as_current():
            self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._renderer)
        self._freed = weakref.finalize(self, _free, self._graphics, self._renderer)
        # The graphics library ends itself at exit, and wants everything back before; the last goes first.
        self._freed.atexit = False
        atexit.register(self._freed)
        self.reset()

    def reset(self) -> None:
        """Start the errors of this run again."""
        self._random = stream(self._seed, "camera")

    def picture(self, time: float) -> CameraImage:
        """A picture of the world as it is now, brighter or darker by the exposure's error.

        Args:
            time: s, of the exposure.
        """
        brightness = 1.0 + self._config.exposure * self._random.uniform(-1.0, 1.0)
        pixels = self._cv2.convertScaleAbs(self.look(), alpha=brightness)
        pixels.flags.writeable = False
        return CameraImage(time=time, pixels=pixels, valid=True)

    def look(self) -> NDArray[np.uint8]:
        """(height, width, 3) RGB, the world as it is now, without the camera's errors.

        Raises:
            RuntimeError: the camera is closed.
        """
        if not self._freed.alive:
            raise RuntimeError("the camera is closed")
        # Where the lights are; kinematics leave them where they were.
        mujoco.mj_camlight(self._model, self._data)
        everything = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(
            self._model, self._data, self._option, None, self._view, everything, self._scene
        )
        self._aim()
        # The light at the camera, where the camera is now.
        mujoco.mjv_makeLights(self._model, self._data, self._scene)
        with self._graphics.as_current():
            mujoco.mjr_render(self._rectangle, self._scene, self._renderer)
            mujoco.mjr_readPixels(self._drawn, None, self._rectangle, self._renderer)
        # The graphics library counts rows from below.
        upright: NDArray[np.uint8] = self._cv2.flip(self._drawn, 0)
        return upright

    def close(self) -> None:
        """Give the graphics memory back. Idempotent."""
        self._freed()
        atexit.unregister(self._freed)

    def _aim(self) -> None:
        """Put the eyes of the scene where the lens is: a free camera of MuJoCo's cannot roll."""
        rotation = self._data.xmat[self._trunk].reshape(3, 3)
        lens = self._data.xpos[self._trunk] + rotation @ self._mount
        for eye in self._scene.camera:
            eye.pos[:], eye.forward[:], eye.up[:] = lens, rotation[:, 0], rotation[:, 2]
            eye.frustum_near, eye.frustum_far = _NEAR, _FAR
            eye.frustum_bottom, eye.frustum_top = -_NEAR * self._half, _NEAR * self._half
            eye.frustum_center = eye.frustum_width = 0.0


def _free(graphics: Any, renderer: mujoco.MjrContext) -> None:
    with graphics.as_current():
        renderer.free()
    graphics.free()
