import mujoco
import numpy as np
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.camera import RenderedCamera
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.sight_config import CameraConfig
from bluefoot_mpc.sim.world import build_world
from bluefoot_mpc.sim.worlds.make import world_plan
from tests.graphics import needs_graphics

SMALL = CameraConfig(enabled=True, width=160, height=120, exposure=0.0)
OWN = """<mujoco>
<asset>
<texture name="sky" type="skybox" builtin="flat" rgb1="0 0 1" rgb2="0 0 1" width="8" height="48"/>
</asset>
<worldbody><geom type="plane" size="9 9 .1" rgba="0 1 0 1"/></worldbody></mujoco>"""


@pytest.fixture(scope="module")
def robot():
    return load_robot()


def made(robot, name, camera):
    config = SimConfig(world=WorldConfig(name=name), camera=camera)
    return build_world(robot, config, draw(config, 0), world_plan(config.world, 0))


def picture(robot, world):
    mounts = robot.parameters.sensors
    world.data.qpos[world.q : world.q + 7] = (0.0, 0.0, 0.12, 1.0, 0.0, 0.0, 0.0)
    mujoco.mj_kinematics(world.model, world.data)
    camera = RenderedCamera(
        world.model, world.data, world.trunk, mounts.camera, mounts.camera_view_deg, SMALL
    )
    pixels = camera.look().astype(int)
    camera.close()
    return pixels


def test_runs_without_a_camera_have_no_scenery(robot):
    plain, seen = made(robot, "room", CameraConfig()).model, made(robot, "room", SMALL).model
    assert plain.ntex == 0
    assert seen.ntex == 2
    for name in ("ngeom", "nbody", "nq", "nv"):
        assert getattr(plain, name) == getattr(seen, name)
    np.testing.assert_array_equal(plain.geom_size, seen.geom_size)
    np.testing.assert_array_equal(plain.geom_friction, seen.geom_friction)


@needs_graphics
def test_a_room_is_bright_its_floor_tiled_and_its_background_no_hole(robot):
    pixels = picture(robot, made(robot, "room", SMALL))
    assert pixels[:10].min() > 150, "there is a hole above the walls"
    floor = pixels[90:]
    assert floor.min() > 100
    assert floor.max() < 232, "with +10 % of exposure the floor would be white"
    assert 4.0 < floor.std() < 25.0, "no joints between tiles, or nothing else"


@needs_graphics
def test_a_users_file_keeps_its_colours(robot, tmp_path):
    path = tmp_path / "own.xml"
    path.write_text(OWN)
    pixels = picture(robot, made(robot, str(path), SMALL))
    assert (pixels[:10, :, 2] > 200).all()
    assert (pixels[:10, :, :2] < 20).all()
    assert (pixels[100:, :, 1] > 50).all()
    assert (pixels[100:, :, [0, 2]] < 20).all()
