"""The marker in rendered pictures of the worlds: where geometry says, and nowhere else."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.navigation.marker import MarkerConfig, MarkerFinder
from bluefoot_mpc.sim.camera import RenderedCamera
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.sight_config import CameraConfig
from bluefoot_mpc.sim.world import World, build_world
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.types import FloatArray
from tests.graphics import needs_graphics

pytestmark = needs_graphics

ROBOT = load_robot()
MOUNTS = ROBOT.parameters.sensors
FOCAL = MOUNTS.focal_length(640)


@contextmanager
def stage(name: str, seed: int) -> Iterator[tuple[World, RenderedCamera]]:
    camera = CameraConfig(enabled=True)
    config = SimConfig(world=WorldConfig(name=name), camera=camera)
    world = build_world(ROBOT, config, draw(config, seed), world_plan(config.world, seed))
    lens = RenderedCamera(
        world.model, world.data, world.trunk, MOUNTS.camera, MOUNTS.camera_view_deg, camera, seed
    )
    try:
        yield world, lens
    finally:
        lens.close()


def put(world: World, x: float, y: float, rpy: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Put the trunk somewhere; (3,) place and (3, 3) rotation of the camera."""
    data = world.data
    data.qpos[world.q : world.q + 3] = (x, y, 0.12)
    mujoco.mju_mat2Quat(data.qpos[world.q + 3 : world.q + 7], rotation_from_rpy(rpy).ravel())
    mujoco.mj_kinematics(world.model, data)
    rotation = data.xmat[world.trunk].reshape(3, 3).copy()
    return data.xpos[world.trunk] + rotation @ np.array(MOUNTS.camera), rotation


def in_sight(world: World, camera: FloatArray, ball: FloatArray) -> bool:
    """True where nothing stands between the camera and the ball's rim."""
    way = (ball - camera) / np.linalg.norm(ball - camera)
    side = np.cross(way, (0.0, 0.0, 1.0))
    up = np.cross(side, way)
    for angle in np.linspace(0.0, 2.0 * math.pi, 8, endpoint=False):
        point = ball + 0.058 * (math.cos(angle) * side + math.sin(angle) * up) - camera
        far, hit = float(np.linalg.norm(point)), np.zeros(1, dtype=np.int32)
        groups = np.array([1, 1, 0, 0, 0, 0], dtype=np.uint8)
        free = mujoco.mj_ray(world.model, world.data, camera, point / far, groups, 1, -1, hit)
        if 0.0 <= free < far - 0.08:
            return False
    return True


def test_where_geometry_says() -> None:
    finder, rng, seen = MarkerFinder(MarkerConfig(), MOUNTS.camera_view_deg), np.random.default_rng(0), 0
    with stage("hidden", 100) as (world, lens):
        sphere = int(mujoco.mjtGeom.mjGEOM_SPHERE)
        ball = next(
            world.data.geom_xpos[k].copy()
            for k in range(world.model.ngeom)
            if world.model.geom_type[k] == sphere and "marker" in world.model.geom(k).name
        )
        while seen < 12:
            away, sight = rng.uniform(0.4, 3.5), rng.uniform(-math.pi, math.pi)
            heading = sight + rng.uniform(-0.4, 0.4)
            rpy = np.array([*rng.normal(0.0, 0.03, 2), heading])
            camera, rotation = put(
                world, ball[0] - away * math.cos(sight), ball[1] - away * math.sin(sight), rpy
            )
            forward, left, up = rotation.T @ (ball - camera)
            far = math.hypot(forward, left, up)
            radius = FOCAL * math.tan(math.asin(0.06 / far))
            column, row = 320.0 - FOCAL * left / forward, 240.0 - FOCAL * up / forward
            whole = 1.3 * radius < column < 640.0 - 1.3 * radius and forward > 0.25
            if not whole or not in_sight(world, camera, ball):
                continue
            sighting = finder.find(lens.picture(0.0))
            assert sighting is not None, f"{far:.2f} m away: {finder.reason}"
            assert math.hypot(sighting.column - column, sighting.row - row) <= 1.0
            assert sighting.radius == pytest.approx(radius, rel=0.03)
            seen += 1


@pytest.mark.parametrize(
    ("names", "count"),
    [
        (("arena",), 20),
        pytest.param(("arena", "room", "corridors", "chairs", "maze"), 40, marks=pytest.mark.slow),
    ],
)
def test_nowhere_else(names: tuple[str, ...], count: int) -> None:
    """The arena has a wall nearly of the marker's colour, and without a leader no marker."""
    finder, rng, false = MarkerFinder(MarkerConfig(), MOUNTS.camera_view_deg), np.random.default_rng(1), []
    for name in names:
        with stage(name, 100) as (world, lens):
            for k in range(count):
                x, y = rng.uniform(-1.2, 1.2, 2)
                put(world, x, y, np.array([*rng.normal(0.0, 0.03, 2), rng.uniform(-3.0, 3.0)]))
                if finder.find(lens.picture(0.0)) is not None:
                    false.append((name, k))
    assert false == []
