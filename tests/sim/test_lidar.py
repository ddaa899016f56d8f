"""The simulated LIDAR in a room whose walls are known."""

import math
from dataclasses import replace

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.lidar.geometry import (
    FIRST_STEP,
    FRONT_STEP,
    GREATEST_RANGE,
    LEAST_RANGE,
    POINTS,
    bearings,
)
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.sim.lidar import NO_ECHO, RaycastLidar
from bluefoot_mpc.sim.randomization import draw
from bluefoot_mpc.sim.sight_config import LidarConfig
from bluefoot_mpc.sim.world import build_world

ROOM = """<mujoco><worldbody>
<geom type="plane" size="9 9 .1"/>
<geom type="box" size=".1 3 1" pos="2.1 0 1"/>
<geom type="box" size="3 .1 1" pos="0 1.1 1"/>
<geom type="box" size="3 .1 1" pos="0 -5.4 1"/>
</worldbody></mujoco>"""
"""Walls 2 m in front, 1 m to the left and 5.3 m to the right."""

FRONT = FRONT_STEP - FIRST_STEP
QUARTER = 256
PERFECT = LidarConfig(noise_near=0.0, noise_far=0.0, dropouts=0.0, jitter_deg=0.0)


@pytest.fixture(scope="module")
def robot():
    return load_robot()


@pytest.fixture(scope="module")
def world(robot, tmp_path_factory):
    path = tmp_path_factory.mktemp("world") / "room.xml"
    path.write_text(ROOM)
    config = SimConfig(world=WorldConfig(name=str(path)))
    return build_world(robot, config, draw(config, 0))


def place(world, x=0.0, yaw=0.0, pitch_legs=0.0):
    data = world.data
    data.qpos[world.q : world.q + 7] = (x, 0, 0.25, math.cos(yaw / 2), 0, 0, math.sin(yaw / 2))
    data.qpos[world.q + 7 : world.q + 23] = np.tile([0.0, pitch_legs, 0.0, 0.0], 4)
    mujoco.mj_kinematics(world.model, data)


def lidar(world, robot, errors=None, seed=0):
    return RaycastLidar(world.model, world.data, world.trunk, robot.parameters.sensors, errors, seed)


def test_walls_are_where_they_are(world, robot):
    place(world)
    mount = robot.parameters.sensors.lidar[0]
    scan = lidar(world, robot, PERFECT).scan(0.0)
    assert scan.shape == (POINTS,)
    assert scan[FRONT] == round(1000 * (2.0 - mount))
    assert scan[FRONT + QUARTER] == 1000
    assert scan[FRONT - QUARTER] == 5300
    # Behind there is nothing, and to the rear right the wall is out of reach.
    assert scan[0] == NO_ECHO
    corner = FRONT + 40
    angle = bearings()[corner]
    assert scan[corner] == pytest.approx(
        1000 * min((2 - mount) / math.cos(angle), 1 / math.sin(angle)), abs=0.51
    )


def test_the_scan_turns_and_moves_with_the_robot(world, robot):
    place(world, x=0.5, yaw=math.pi / 2)
    mount = robot.parameters.sensors.lidar[0]
    scan = lidar(world, robot, PERFECT).scan(0.0)
    assert scan[FRONT] == round(1000 * (1.0 - mount))
    assert scan[FRONT - QUARTER] == 1500


@pytest.mark.parametrize("pitch", [0.12, 0.2, 0.3])
def test_a_nose_down_trunk_looks_at_the_floor(world, robot, pitch):
    place(world)
    data, mount = world.data, np.array(robot.parameters.sensors.lidar)
    data.qpos[world.q + 3 : world.q + 7] = (math.cos(pitch / 2), 0, math.sin(pitch / 2), 0)
    mujoco.mj_kinematics(world.model, data)
    sensor = lidar(world, robot, PERFECT)
    seen = sensor.look(bearings())
    # Nose down, a lens ahead of the centre comes down, too.
    height = 0.25 + mount[2] * math.cos(pitch) - mount[0] * math.sin(pitch)
    ahead = mount[0] * math.cos(pitch) + mount[2] * math.sin(pitch)
    to_floor, to_wall = height / math.sin(pitch), (2.0 - ahead) / math.cos(pitch)
    assert to_floor < to_wall or pitch == 0.12
    assert seen[FRONT] == pytest.approx(min(to_floor, to_wall), abs=1e-9)
    # Sideways the plane is level: the wall on the left is where it was.
    assert seen[FRONT + QUARTER] == pytest.approx(1.0, abs=1e-9)
    # A ray at a bearing b drops by sin(pitch) cos(b).
    slanted = FRONT + 60
    drop = math.sin(pitch) * math.cos(bearings()[slanted])
    if height / drop < 1.0 / math.sin(bearings()[slanted]) and pitch > 0.12:
        assert seen[slanted] == pytest.approx(height / drop, abs=1e-9)


def test_a_leader_is_seen(robot):
    config = SimConfig(leader=LeaderConfig(kind="differential", distance=0.9))
    world = build_world(robot, config, draw(config, 0))
    data = world.data
    data.qpos[world.q : world.q + 7] = (0, 0, 0.12, 1, 0, 0, 0)
    mujoco.mj_kinematics(world.model, data)
    seen = lidar(world, robot, PERFECT).look(bearings())
    hits = np.flatnonzero(~np.isnan(seen))
    assert hits.size > 3, "nothing but the leader stands on the floor"
    body = world.model.geom_bodyid[lidar_geoms(world, robot, hits)]
    assert {world.model.body_rootid[b] for b in body}.isdisjoint({0, world.model.body_rootid[world.trunk]})
    place_of_leader = data.geom_xpos[world.model.geom("marker").id]
    angle = bearings()[hits]
    points = np.array([0.04, 0.0]) + seen[hits, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    assert (np.hypot(*(points - place_of_leader[:2]).T) < 0.25).all()


def lidar_geoms(world, robot, hits):
    """Geoms that these rays of a level LIDAR meet."""
    sensor = lidar(world, robot, PERFECT)
    sensor.look(bearings())
    return sensor._geom[hits]


def a_leg_is_in_the_way(world, robot):
    """Whether a ray of the scan meets the robot where every group is looked at."""
    data, geom, distance = world.data, np.zeros(POINTS, dtype=np.int32), np.zeros(POINTS)
    rays = np.column_stack([np.cos(bearings()), np.sin(bearings()), np.zeros(POINTS)]).ravel()
    origin = data.xpos[world.trunk] + robot.parameters.sensors.lidar
    mujoco.mj_multiRay(
        world.model, data, origin, rays, None, True, world.trunk, geom, distance, None, POINTS, 5.6
    )
    bodies = world.model.geom_bodyid[geom[geom >= 0]]
    return (world.model.body_rootid[bodies] == world.trunk).any()


def test_the_robot_does_not_see_itself(world, robot):
    place(world)
    free = lidar(world, robot, PERFECT).look(bearings())
    place(world, pitch_legs=1.5)
    raised = lidar(world, robot, PERFECT).look(bearings())
    assert a_leg_is_in_the_way(world, robot), "the test shows nothing"
    np.testing.assert_allclose(raised, free, atol=1e-6)


def test_errors_have_the_sizes_that_are_asked_for(world, robot):
    place(world)
    sensor = lidar(world, robot, LidarConfig(jitter_deg=0.0))
    true = sensor.look(bearings())
    scans = np.array([sensor.scan(0.1 * k) for k in range(400)]) * 0.001
    seen = ~np.isnan(true)
    # The walls that are near the end of the range come and go with the noise.
    inside = seen & (true < 5.2)
    assert np.mean(scans[:, inside] == NO_ECHO) == pytest.approx(0.005, abs=0.0005)
    error = np.where(scans > 0.0, scans - true, np.nan)
    for ray in (FRONT, FRONT + QUARTER + 20, FRONT - QUARTER + 60):
        if inside[ray]:
            wanted = 0.010 if true[ray] < 1.0 else 0.01 * true[ray]
            assert np.nanstd(error[:, ray]) == pytest.approx(wanted, rel=0.15)
            assert abs(np.nanmean(error[:, ray])) < 0.2 * wanted
    assert (scans[:, ~seen] == NO_ECHO).all()


def test_jitter_turns_the_rays(world, robot):
    place(world)
    sensor = lidar(world, robot, LidarConfig(noise_near=0.0, noise_far=0.0, dropouts=0.0, jitter_deg=0.5))
    slanted = FRONT + 60
    scans = np.array([sensor.scan(0.0)[slanted] for _ in range(300)])
    angle = bearings()[slanted]
    slope = scans.mean() * math.tan(angle)
    assert scans.std() == pytest.approx(slope * math.radians(0.5), rel=0.2)


def test_a_scan_is_what_the_driver_would_make_of_the_sensors_bytes(world, robot):
    place(world)
    raw, scan = lidar(world, robot, seed=3).scan(0.0), lidar(world, robot, seed=3).measure(0.25)
    assert scan.time == 0.25
    outside = (raw < LEAST_RANGE) | (raw > GREATEST_RANGE)
    np.testing.assert_array_equal(scan.distance, np.where(outside, np.nan, raw * 0.001))
    assert outside.any()
    assert scan.bearing is lidar(world, robot).measure(0.0).bearing


def test_the_seed_decides_and_reset_begins_anew(world, robot):
    place(world)
    first, same, other = (lidar(world, robot, seed=seed) for seed in (1, 1, 2))
    scans = [sensor.scan(0.0) for sensor in (first, same, other)]
    assert (scans[0] == scans[1]).all()
    assert (scans[0] != scans[2]).any()
    assert (first.scan(0.1) != scans[0]).any()
    first.reset()
    assert (first.scan(0.0) == scans[0]).all()


def test_impossible_errors_are_refused():
    with pytest.raises(ConfigurationError, match="dropouts"):
        LidarConfig(dropouts=1.5)


def test_a_sensor_that_is_mounted_askew_looks_where_it_is_turned(world, robot):
    place(world)
    turned = replace(PERFECT, mount_error_deg=(0.0, 12.0, 0.0))
    body = (world.model, world.data, world.trunk)
    by_error = RaycastLidar(*body, robot.parameters.sensors, turned).look(bearings())
    told = replace(robot.parameters.sensors, lidar_rpy_deg=(0.0, 12.0, 0.0))
    by_parameter = RaycastLidar(*body, told, PERFECT).look(bearings())
    np.testing.assert_allclose(by_error, by_parameter, atol=1e-9)
    lens = 0.25 + robot.parameters.sensors.lidar[2]
    assert by_error[FRONT] == pytest.approx(lens / math.sin(math.radians(12.0)), abs=1e-9)


def test_a_sensor_that_sits_higher_looks_from_there(world, robot):
    place(world)
    raised = replace(PERFECT, mount_error_deg=(0.0, 12.0, 0.0), mount_error_m=(0.0, 0.0, 0.01))
    found = RaycastLidar(world.model, world.data, world.trunk, robot.parameters.sensors, raised)
    lens = 0.26 + robot.parameters.sensors.lidar[2]
    assert found.look(bearings())[FRONT] == pytest.approx(lens / math.sin(math.radians(12.0)), abs=1e-9)
    with pytest.raises(ConfigurationError, match="mount_error_m"):
        LidarConfig(mount_error_m=(0.0, 0.0, 0.2))


@pytest.mark.parametrize("wrong", [(0.0, 40.0, 0.0), (math.nan, 0.0, 0.0)])
def test_impossible_mountings_are_refused(robot, wrong):
    with pytest.raises(ConfigurationError, match="mount_error_deg"):
        LidarConfig(mount_error_deg=wrong)
    with pytest.raises(ConfigurationError, match="lidar_rpy_deg"):
        replace(robot.parameters.sensors, lidar_rpy_deg=wrong)
