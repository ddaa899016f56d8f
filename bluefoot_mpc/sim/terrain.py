"""Ground shapes of the worlds that ship, and the height of the ground under a point."""

from __future__ import annotations

import math
from typing import Any

import mujoco
import numpy as np
from scipy.ndimage import gaussian_filter

from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.heights import Relief
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import FloatArray

WORLD_GROUPS = np.array([1, 1, 0, 0, 0, 0], dtype=np.uint8)
"""MuJoCo geom groups of the ground; the robot's shapes are in groups 2 and 3."""

_ROUGH_HALF = 4.0
_ROUGH_CELL = 0.025
_FLAT_RADIUS = 0.30
_BLEND = 0.20
_STAIRS_HALF_WIDTH = 1.0
_GROUND_RGBA = (0.82, 0.80, 0.74, 1.0)
_STEP_RGBA = (0.70, 0.66, 0.58, 1.0)


def add_ground(spec: mujoco.MjSpec, config: WorldConfig, floor: float = 0.0) -> None:
    """Add a shipped world's ground to the world body, tilted by the slope about the origin.

    Args:
        spec: to add to.
        config: of the world.
        floor: m, height of the plane.
    """
    half = -0.5 * config.slope
    frame = spec.worldbody.add_frame(quat=[math.cos(half), 0.0, math.sin(half), 0.0])
    if config.name == "rough":
        _add_rough(spec, frame, config)
    else:
        _add_plane(spec, frame, floor)
    if config.name == "steps":
        _add_steps(spec, frame, config)


def rough_heights(config: WorldConfig) -> FloatArray:
    """(rows along y, columns along x) terrain heights in 0..1, 0.5 around the origin."""
    count = 2 * round(_ROUGH_HALF / _ROUGH_CELL) + 1
    rng = np.random.default_rng(config.rough_seed)
    sigma = config.rough_wavelength / (2.0 * math.pi * _ROUGH_CELL) * math.sqrt(2.0)
    noise = gaussian_filter(rng.standard_normal((count, count)), sigma, mode="wrap")
    noise = 0.5 + 0.5 * noise / np.abs(noise).max()
    axis = np.linspace(-_ROUGH_HALF, _ROUGH_HALF, count)
    radius = np.hypot(axis[:, None], axis[None, :])
    share = np.clip((radius - _FLAT_RADIUS) / _BLEND, 0.0, 1.0)
    heights = np.asarray(0.5 + share**2 * (3.0 - 2.0 * share) * (noise - 0.5))
    # MuJoCo stretches any field to 0..1: two far corners keep this one as it is.
    heights[0, 0], heights[-1, -1] = 0.0, 1.0
    return heights


class Ground:
    """Height of the ground, by formula where it is a plane or pieces of a plan, by a ray elsewhere.

    Attributes:
        is_plane: True where nothing rises from the plane that is ground.

    Args:
        config: of the world.
        model: MuJoCo model.
        data: its state.
        plan: of the world, where there is one.
    """

    def __init__(
        self, config: WorldConfig, model: mujoco.MjModel, data: mujoco.MjData, plan: WorldPlan | None = None
    ) -> None:
        self._model, self._data = model, data
        self._relief = None
        if plan is not None and not plan.is_even:
            self._relief = Relief((solid for solid in plan.solids if solid.is_ground), plan.floor)
        self.is_plane = self._relief is None and (config.name in {"flat", "slope"} or plan is not None)
        self._tilt = math.tan(config.slope)
        self._cosine = math.cos(config.slope)
        self._hit = np.zeros(1, dtype=np.int32)
        self._down = np.array([0.0, 0.0, -1.0])

    def height(self, x: float, y: float, above: float = 2.0) -> float:
        """Height of the ground at (x, y), m in world; NaN where there is none.

        Args:
            x: m in world.
            y: m in world.
            above: m, height to look down from: what hangs higher is no ground. A plan's ground hangs nowhere.
        """
        if self.is_plane:
            return x * self._tilt
        if self._relief is not None:
            return float(self._relief.height(np.array([x, y])))
        start = np.array([x, y, above])
        distance = mujoco.mj_ray(
            self._model, self._data, start, self._down, WORLD_GROUPS, True, -1, self._hit
        )
        return above - distance if distance >= 0.0 else math.nan

    def clearance(self, points: FloatArray, radius: float) -> FloatArray:
        """Distance of balls to the ground (n,), m: normal to a plane, vertical elsewhere.

        On the ground of a plan it is how far a ball can sink until it touches something, be it an edge.

        Args:
            points: (n, 3) m, centres in world.
            radius: m.
        """
        if self.is_plane:
            return np.asarray(self.plane_clearance(points[:, 0], points[:, 2], radius))
        if self._relief is not None:
            return self._relief.clearance(points, radius)
        ground = [self.height(p[0], p[1], p[2]) for p in points.tolist()]
        return np.asarray(points[:, 2] - ground - radius)

    def plane_clearance(self, x: Any, z: Any, radius: float) -> Any:
        """Distance of balls to the plane, m, from coordinates of their centres: arrays or symbols."""
        return (z - x * self._tilt) * self._cosine - radius


def _add_plane(spec: mujoco.MjSpec, frame: mujoco.MjsFrame, height: float) -> None:
    geom = spec.worldbody.add_geom(
        name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 0.05], pos=[0.0, 0.0, height]
    )
    geom.rgba = _GROUND_RGBA
    geom.set_frame(frame)


def _add_steps(spec: mujoco.MjSpec, frame: mujoco.MjsFrame, config: WorldConfig) -> None:
    levels = [*range(1, config.step_count + 1), *range(config.step_count - 1, 0, -1)]
    for index, level in enumerate(levels):
        half = 0.5 * level * config.step_height
        geom = spec.worldbody.add_geom(
            name=f"step{index + 1}",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=[0.5 * config.step_depth, _STAIRS_HALF_WIDTH, half],
            pos=[config.step_start + (index + 0.5) * config.step_depth, 0.0, half],
        )
        geom.rgba = _STEP_RGBA
        geom.set_frame(frame)


def _add_rough(spec: mujoco.MjSpec, frame: mujoco.MjsFrame, config: WorldConfig) -> None:
    heights = rough_heights(config)
    spec.add_hfield(
        name="rough",
        size=[_ROUGH_HALF, _ROUGH_HALF, config.rough_height, 0.1],
        nrow=heights.shape[0],
        ncol=heights.shape[1],
        userdata=heights.ravel(),
    )
    geom = spec.worldbody.add_geom(
        name="rough",
        type=mujoco.mjtGeom.mjGEOM_HFIELD,
        hfieldname="rough",
        pos=[0.0, 0.0, -0.5 * config.rough_height],
    )
    geom.rgba = _GROUND_RGBA
    geom.set_frame(frame)
    # The ground goes on, at its lowest, beyond the field.
    _add_plane(spec, frame, -0.5 * config.rough_height - 1e-3)
