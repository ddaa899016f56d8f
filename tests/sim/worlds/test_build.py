"""What MuJoCo has of a plan is what the plan says."""

import math

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.worlds.build import FLOOR_GROUP, MARKER_GEOM, THING_GROUP, add_plan
from bluefoot_mpc.sim.worlds.make import KINDS, make_plan


def compiled(plan):
    spec = mujoco.MjSpec()
    add_plan(spec, plan)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


@pytest.mark.parametrize("kind", KINDS)
def test_geoms_equal_the_plan(kind):
    plan = make_plan(kind, 11)
    model, data = compiled(plan)
    assert model.ngeom == len(plan.solids) + (2 if plan.marker else 0)
    assert set(model.geom_group) == {THING_GROUP}
    for solid in plan.solids:
        geom = model.geom(solid.name)
        assert data.geom_xpos[geom.id] == pytest.approx([solid.x, solid.y, solid.z])
        along = data.geom_xmat[geom.id].reshape(3, 3)[:, 0]
        assert along == pytest.approx([math.cos(solid.yaw), math.sin(solid.yaw), 0.0], abs=1e-9)
        half = 0.5 * np.array(solid.size)
        if solid.shape == "box":
            assert geom.type[0] == mujoco.mjtGeom.mjGEOM_BOX
            assert geom.size == pytest.approx(half)
        else:
            assert geom.type[0] == mujoco.mjtGeom.mjGEOM_CYLINDER
            assert geom.size[:2] == pytest.approx(half[[0, 2]])
        assert geom.rgba[:3] == pytest.approx(solid.colour)


def test_marker_is_a_ball_on_a_post():
    plan = make_plan("hidden", 1)
    model, _ = compiled(plan)
    ball = model.geom(MARKER_GEOM)
    assert ball.type[0] == mujoco.mjtGeom.mjGEOM_SPHERE
    assert ball.pos == pytest.approx([plan.marker.x, plan.marker.y, 0.20])
    assert ball.size[0] == 0.06
    assert model.geom("marker_post").size[0] < 0.01


@pytest.mark.parametrize("kind", KINDS)
def test_robot_stands_in_every_kind(kind):
    robot = SimRobot(load_robot(), SimConfig(world=WorldConfig(name=kind)), seed=3)
    assert robot.plan == make_plan(kind, 3)
    assert robot.ground.is_plane
    model, truth = robot.model, robot.truth()
    assert model.geom("floor").group[0] == FLOOR_GROUP
    assert all(model.geom(solid.name).group[0] == THING_GROUP for solid in robot.plan.solids)
    assert truth.touching == truth.collisions == ()
    assert truth.clearance > 0.25
    assert np.abs(truth.foot_height).max() < 3e-4
    marker = robot.plan.marker
    assert np.isnan(truth.marker).all() if marker is None else truth.marker[0] == pytest.approx(marker.x)


def test_layouts_follow_the_run_s_seed():
    robots = [SimRobot(load_robot(), SimConfig(world=WorldConfig(name="room")), seed=seed) for seed in (1, 2)]
    assert robots[0].plan != robots[1].plan
