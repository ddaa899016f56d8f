"""Distances to what stands about, against distances by hand and by trying all pairs; touches."""

import math

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.clearance import REACH, Surroundings
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.build import THING_GROUP, add_plan
from bluefoot_mpc.sim.worlds.make import make_plan
from bluefoot_mpc.types import JointCommand

BALL = 0.10  # m


@pytest.fixture(scope="module")
def robot_model():
    return load_robot()


def ball_in(plan):
    """A robot that is a ball, at the height of things' middles, among a plan's solids."""
    spec = mujoco.MjSpec()
    trunk = spec.worldbody.add_body(name="trunk", pos=[0.0, 0.0, 0.25])
    trunk.add_freejoint()
    trunk.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[BALL, 0.0, 0.0])
    other = spec.worldbody.add_body(name="leader", pos=[50.0, 0.0, 0.25])
    other.add_freejoint()
    other.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.2, 0.0, 0.0], group=THING_GROUP)
    add_plan(spec, plan)
    model = spec.compile()
    data = mujoco.MjData(model)
    return data, model, Surroundings(model, data, model.body("trunk").id)


def test_distances_equal_those_in_the_plane():
    plan = make_plan("room", 5)
    data, model, surroundings = ball_in(plan)
    rng = np.random.default_rng(0)
    x0, y0, x1, y1 = plan.bounds
    solids = footprint.crossing(plan.solids, 0.25)
    for _ in range(100):
        data.qpos[:2] = rng.uniform((x0, y0), (x1, y1))
        mujoco.mj_kinematics(model, data)
        wanted = footprint.nearest(data.qpos[None, :2], solids)[0] - BALL
        if wanted > 0.0:
            found = surroundings.clearance()
            assert found == pytest.approx(wanted, abs=1e-6) if wanted < REACH else math.isinf(found)


def test_a_thing_that_moves_is_followed():
    data, model, surroundings = ball_in(make_plan("arena", 0))
    mujoco.mj_kinematics(model, data)
    assert surroundings.clearance() > 0.9
    data.qpos[7:9] = (0.0, 0.6)
    mujoco.mj_kinematics(model, data)
    assert surroundings.clearance() == pytest.approx(0.6 - 0.2 - BALL)


def test_nothing_near_is_infinite_and_nothing_at_all_is_not_a_number(robot_model):
    data, model, surroundings = ball_in(make_plan("room", 0))
    data.qpos[:2] = (40.0, 40.0)
    mujoco.mj_kinematics(model, data)
    assert surroundings.clearance() == math.inf
    flat = SimRobot(robot_model, SimConfig()).truth()
    assert math.isnan(flat.clearance)
    assert flat.collisions == ()
    assert np.isnan(flat.marker).all()


@pytest.mark.parametrize("kind", ["chairs", "maze"])
def test_short_way_finds_what_trying_all_pairs_finds(robot_model, kind):
    robot = SimRobot(robot_model, SimConfig(world=WorldConfig(name=kind)), seed=1)
    model, data = robot.model, robot.data
    surroundings = Surroundings(model, data, model.body("trunk").id)
    start, rng = data.qpos.copy(), np.random.default_rng(1)
    x0, y0, x1, y1 = robot.plan.bounds
    things = [geom for geom in range(model.ngeom) if model.geom_group[geom] == THING_GROUP]
    parts = [geom for geom in range(model.ngeom) if model.geom_group[geom] == 3]
    for _ in range(25):
        half = rng.uniform(-math.pi, math.pi)
        data.qpos[:] = start
        data.qpos[:2] = rng.uniform((x0, y0), (x1, y1))
        data.qpos[3:7] = (math.cos(half), 0.0, 0.0, math.sin(half))
        data.qpos[7:] += rng.uniform(-0.3, 0.3, 16)
        mujoco.mj_kinematics(model, data)
        wanted = min(
            mujoco.mj_geomDistance(model, data, part, thing, REACH, None)
            for part in parts
            for thing in things
        )
        found = surroundings.clearance()
        if wanted > 0.0:
            assert found == pytest.approx(wanted, abs=1e-6)
        else:
            assert found <= 0.0


def stand(robot, model, frames=4):
    for _ in range(frames):
        robot.step(JointCommand(position=model.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16)))
    return robot.truth()


def test_a_foot_at_a_wall_is_a_collision_and_no_fall(robot_model):
    robot = SimRobot(robot_model, SimConfig(world=WorldConfig(name="room")), seed=0)
    foot = robot.truth().foot_position[:, 0].max()
    # The feet's balls reach 3 mm into the wall; trunk and links above the foot stay clear.
    robot.data.qpos[0] += robot.plan.bounds[2] - foot - 0.005
    truth = stand(robot, robot_model, 1)
    assert "wall_front" in truth.collisions
    assert truth.clearance < 0.005


def test_the_trunk_at_a_wall_is_a_collision_and_touches(robot_model):
    robot = SimRobot(robot_model, SimConfig(world=WorldConfig(name="room")), seed=0)
    robot.data.qpos[0] += robot.plan.bounds[2] - 0.06
    truth = stand(robot, robot_model, 1)
    assert truth.collisions == ("wall_front",)
    assert truth.clearance < 0.0
    assert "trunk" in truth.touching


def test_standing_free_touches_nothing(robot_model):
    robot = SimRobot(robot_model, SimConfig(world=WorldConfig(name="maze")), seed=0)
    truth = stand(robot, robot_model)
    assert truth.collisions == truth.touching == ()
    assert truth.clearance > 0.3


def test_touches_are_looked_for_in_every_step_where_things_are_close(robot_model):
    robot = SimRobot(robot_model, SimConfig(world=WorldConfig(name="room")), seed=0)
    reader = robot._truth
    assert robot.truth().clearance > 0.15
    assert not reader.is_close
    front = robot.data.geom_xpos[:, 0][robot.model.geom_group == 3].max()
    robot.data.qpos[0] += robot.plan.bounds[2] - front - 0.12
    assert 0.0 < robot.truth().clearance < 0.15
    assert reader.is_close
    looks = []
    reader.look_for_collisions = lambda: looks.append(1)
    stand(robot, robot_model, 1)
    assert len(looks) == 20
    assert not SimRobot(robot_model, SimConfig())._truth.is_close
