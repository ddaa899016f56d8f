import math
from concurrent.futures import ThreadPoolExecutor

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.camera import RenderedCamera
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.sight_config import CameraConfig
from bluefoot_mpc.sim.world import build_world
from tests.graphics import needs_graphics

pytestmark = needs_graphics

RADIUS = 0.02
HALL = """<mujoco><worldbody>
<light dir="0.3 0.2 -1" type="directional"/>
<geom type="plane" size="9 9 .1" rgba=".6 .6 .6 1"/>
<body name="ball" mocap="true" pos="9 9 1"><geom type="sphere" size="0.02" rgba="1 0 0 1"/></body>
</worldbody></mujoco>"""
"""A gray floor, and a red ball of 2 cm radius that the tests put somewhere."""
CONFIG = CameraConfig(enabled=True)


@pytest.fixture(scope="module")
def robot():
    return load_robot()


@pytest.fixture(scope="module")
def world(robot, tmp_path_factory):
    path = tmp_path_factory.mktemp("world") / "hall.xml"
    path.write_text(HALL)
    config = SimConfig(world=WorldConfig(name=str(path)), camera=CONFIG)
    return build_world(robot, config, draw(config, 0))


@pytest.fixture(scope="module")
def lens(world, robot):
    """A perfect camera; graphics contexts are dear."""
    camera = make(world, robot, CameraConfig(enabled=True, exposure=0.0))
    yield camera
    camera.close()


def make(world, robot, config=CONFIG, seed=0):
    mounts = robot.parameters.sensors
    return RenderedCamera(
        world.model, world.data, world.trunk, mounts.camera, mounts.camera_view_deg, config, seed
    )


def place(world, rpy=(0.0, 0.0, 0.0), height=0.3, ball=(9.0, 9.0, 1.0)):
    data = world.data
    data.qpos[world.q : world.q + 3] = (0.0, 0.0, height)
    mujoco.mju_mat2Quat(data.qpos[world.q + 3 : world.q + 7], rotation_from_rpy(np.array(rpy)).ravel())
    data.mocap_pos[0] = ball
    mujoco.mj_kinematics(world.model, data)
    return data.xpos[world.trunk].copy(), data.xmat[world.trunk].reshape(3, 3).copy()


def centre(pixels):
    """Column and row of the red spot's middle, from the picture's left and upper edge."""
    red = pixels[:, :, 0].astype(int) - pixels[:, :, 1:].max(axis=2) > 60
    rows, columns = np.nonzero(red)
    assert rows.size > 20, "the ball is not in the picture"
    return columns.mean() + 0.5, rows.mean() + 0.5


@pytest.mark.parametrize("rpy", [(0.0, 0.0, 0.0), (0.2, 0.0, 0.0), (0.0, 0.15, 0.0), (-0.15, -0.1, 0.7)])
@pytest.mark.parametrize(
    "place_of_ball", [(1.2, 0.0, 0.0), (0.9, 0.35, 0.15), (1.5, -0.6, -0.3), (0.5, 0.2, 0.1)]
)
def test_a_ball_is_seen_where_a_pinhole_shows_it(world, robot, lens, rpy, place_of_ball):
    """The camera model that finding the marker relies on: the lens, its axes and its focal length."""
    mounts = robot.parameters.sensors
    origin, rotation = place(world, rpy, height=1.0)
    place(world, rpy, height=1.0, ball=origin + rotation @ (np.array(mounts.camera) + place_of_ball))
    focal = mounts.focal_length(640)
    x, y, z = place_of_ball
    column, row = centre(lens.look())
    assert column == pytest.approx(320.0 - focal * y / x, abs=1.0)
    assert row == pytest.approx(240.0 - focal * z / x, abs=1.0)


def test_the_view_is_as_wide_as_the_parameters_say(world, robot, lens):
    mounts = robot.parameters.sensors
    half = 0.5 * math.radians(mounts.camera_view_deg)
    origin, _ = place(world, height=1.0)
    for angle, is_seen in ((half - 0.03, True), (half + 0.03, False)):
        place(
            world, height=1.0, ball=origin + mounts.camera + np.array([math.cos(angle), math.sin(angle), 0.0])
        )
        red = lens.look()[:, :, 0].astype(int) - lens.look()[:, :, 1] > 60
        assert red.any() == is_seen


def test_a_ball_is_as_large_as_it_should_be(world, robot, lens):
    mounts = robot.parameters.sensors
    origin, _ = place(world, height=1.0)
    place(world, height=1.0, ball=origin + mounts.camera + np.array([0.5, 0.0, 0.0]))
    pixels = lens.look()
    area = np.count_nonzero(pixels[:, :, 0].astype(int) - pixels[:, :, 1] > 60)
    tangent = math.tan(math.asin(RADIUS / 0.5))
    assert area == pytest.approx(math.pi * (mounts.focal_length(640) * tangent) ** 2, rel=0.05)


def test_the_robot_is_not_in_its_own_pictures(world, robot, lens):
    place(world)
    free = lens.look().copy()
    # The left front leg turned in before the lens.
    world.data.qpos[world.q + 7 : world.q + 23] = np.tile([-1.0, 0.0, 1.2, 0.0], 4)
    mujoco.mj_kinematics(world.model, world.data)
    np.testing.assert_array_equal(lens.look(), free)
    lens._option.geomgroup[3] = 1
    assert (lens.look() != free).any(), "no leg is in the way: the test shows nothing"
    lens._option.geomgroup[3] = 0
    world.data.qpos[world.q + 7 : world.q + 23] = 0.0


def test_exposure_changes_brightness_and_nothing_else(world, robot):
    place(world, ball=(1.0, 0.0, 0.3))
    camera = make(world, robot, CameraConfig(enabled=True, width=160, height=120, exposure=0.10), seed=3)
    plain = camera.look().astype(float)
    shares = []
    for k in range(60):
        image = camera.picture(0.1 * k)
        assert image.time == 0.1 * k
        assert image.valid
        assert not image.pixels.flags.writeable
        share = float(np.median(image.pixels[plain > 50] / plain[plain > 50]))
        np.testing.assert_allclose(image.pixels, np.minimum(plain * share, 255.0), atol=2.0)
        shares.append(share)
    assert 0.89 < min(shares) < 0.93
    assert 1.07 < max(shares) < 1.11
    assert abs(np.mean(shares) - 1.0) < 0.03
    camera.close()


def test_the_seed_decides_and_reset_begins_anew(world, robot):
    place(world)
    first, same, other = (make(world, robot, seed=seed) for seed in (1, 1, 2))
    pictures = [camera.picture(0.0).pixels for camera in (first, same, other)]
    np.testing.assert_array_equal(pictures[0], pictures[1])
    assert (pictures[0] != pictures[2]).any()
    assert (first.picture(0.1).pixels != pictures[0]).any()
    first.reset()
    np.testing.assert_array_equal(first.picture(0.0).pixels, pictures[0])
    for camera in (first, same, other):
        camera.close()


@pytest.mark.parametrize("size", [(320, 240), (160, 90)])
def test_other_sizes(world, robot, size):
    mounts, (width, height) = robot.parameters.sensors, size
    camera = make(world, robot, CameraConfig(enabled=True, width=width, height=height, exposure=0.0))
    origin, _ = place(world, height=1.0)
    place(world, height=1.0, ball=origin + mounts.camera + np.array([0.5, 0.1, 0.03]))
    pixels = camera.look()
    assert pixels.shape == (height, width, 3)
    column, row = centre(pixels)
    focal = mounts.focal_length(width)
    assert column == pytest.approx(0.5 * width - focal * 0.2, abs=1.0)
    assert row == pytest.approx(0.5 * height - focal * 0.06, abs=1.0)
    camera.close()
    camera.close()
    with pytest.raises(RuntimeError, match="closed"):
        camera.look()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"rate": 0.0}, "rate"),
        ({"rate": 100.0}, "rate"),
        ({"width": 0}, "width"),
        ({"exposure": 1.5}, "exposure"),
    ],
)
def test_impossible_cameras_are_refused(changes, message):
    with pytest.raises(ConfigurationError, match=message):
        CameraConfig(**changes)


def test_pictures_can_be_taken_in_another_thread(world, robot, lens):
    """A robot may be made in one thread and stepped, or left to the garbage, in another."""
    place(world)
    here = lens.look()
    with ThreadPoolExecutor(1) as pool:
        there = pool.submit(lens.look).result()
        other = pool.submit(make, world, robot).result()
        pool.submit(other.close).result()
    np.testing.assert_array_equal(here, there)
    np.testing.assert_array_equal(lens.look(), here)
