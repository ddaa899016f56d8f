"""Heights of the ground by geometry are those that MuJoCo's rays find, and its contacts agree."""

import math

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.sim.config import TERRAIN_WORLDS, SimConfig, WorldConfig
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.terrain import WORLD_GROUPS, Ground, add_ground
from bluefoot_mpc.sim.worlds.build import FLOOR_GROUP, add_plan
from bluefoot_mpc.sim.worlds.heights import Relief, heights
from bluefoot_mpc.sim.worlds.make import make_plan, world_plan
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import JointCommand

RADIUS = 0.008
BOUNDS = (-1.0, -1.0, 3.0, 1.0)


def compiled(plan, extra=None):
    spec = mujoco.MjSpec()
    add_ground(spec, WorldConfig(), plan.floor)
    add_plan(spec, plan)
    if extra is not None:
        extra(spec)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data


def looked_down(model, data, places):
    hit = np.zeros(1, dtype=np.int32)
    down = np.array([0.0, 0.0, -1.0])
    starts = [np.array([x, y, 0.39]) for x, y in places]
    return [0.39 - mujoco.mj_ray(model, data, s, down, WORLD_GROUPS, True, -1, hit) for s in starts]


def piece(name, x, size, **changes):
    values = {"name": name, "shape": "box", "x": x, "y": 0.0, "z": 0.5 * size[2], "size": size}
    return Solid(**{"is_ground": True, **values, **changes})


def plan_with(*solids, floor=0.0):
    return WorldPlan(name="own", seed=0, bounds=BOUNDS, solids=solids, floor=floor)


LEANING = (
    piece("up", 0.5, (0.3, 0.2, 0.05), yaw=0.4, pitch=-0.3, z=0.06),
    piece("down", 1.1, (0.3, 0.2, 0.05), y=0.2, yaw=-2.0, pitch=0.5, z=0.08),
    piece("post", 1.5, (0.1, 0.1, 0.06), shape="cylinder"),
    piece("thing", -0.3, (0.1, 0.2, 0.3), is_ground=False, yaw=1.0),
    piece("shelf", 2.0, (0.5, 0.5, 0.02), is_ground=False, z=0.45),
)


@pytest.mark.parametrize(
    "plan",
    [*(world_plan(WorldConfig(name=kind), 3) for kind in TERRAIN_WORLDS), plan_with(*LEANING, floor=-0.02)],
    ids=[*TERRAIN_WORLDS, "leaning"],
)
def test_heights_are_those_that_rays_find(plan):
    places = np.random.default_rng(1).uniform((-0.5, -1.1), (2.5, 1.1), (400, 2))
    found = heights(plan, places)
    assert found == pytest.approx(looked_down(*compiled(plan), places), abs=1e-9)
    assert len(np.unique(np.round(found, 4))) > 1


def test_heights_keep_the_shape_of_what_is_asked_for():
    plan = plan_with(piece("step", 1.0, (0.4, 0.4, 0.05)))
    grid = np.stack(np.meshgrid(np.linspace(0.0, 2.0, 5), np.linspace(-0.1, 0.1, 3)), axis=-1)
    assert heights(plan, grid).shape == (3, 5)
    assert heights(plan, np.array([1.0, 0.0])) == pytest.approx(0.05)
    assert heights(plan, np.zeros((0, 2))).shape == (0,)
    assert heights(plan_with(), np.array([[1.0, 0.0]])) == pytest.approx([0.0])
    assert np.isnan(heights(plan, np.array([[math.nan, 0.0], [1.0, 0.0]]))).tolist() == [True, False]


def test_a_ball_sinks_until_it_touches():
    step = piece("step", 1.0, (0.4, 0.4, 0.05))
    relief = Relief([step], -0.02)
    edge, lean = 0.8, 0.006
    over_edge = 0.05 + math.sqrt(RADIUS**2 - lean**2)
    points = np.array(
        [
            [1.0, 0.0, 0.07],  # over the step
            [0.5, 0.0, 0.07],  # over the floor
            [edge - lean, 0.0, 0.05 + RADIUS],  # its middle beside the edge, still over it
            [edge - lean, 0.0, over_edge],  # on the edge
            [edge - RADIUS + 1e-5, 0.0, 0.0],  # beside the step, against its side
            [1.0, 0.0, 0.05 + RADIUS - 1e-4],  # pressed into the step
        ]
    )
    wanted = [0.012, 0.082, RADIUS - math.sqrt(RADIUS**2 - lean**2), 0.0, 0.012, -1e-4]
    assert relief.clearance(points, RADIUS) == pytest.approx(wanted, abs=1e-9)


def test_a_ball_on_a_tilted_piece_touches_it_where_mujoco_says():
    ramp = piece("ramp", 0.5, (0.4, 0.4, 0.05), yaw=0.3, pitch=-0.25, z=0.03)
    plan = plan_with(ramp)

    def add_ball(spec):
        body = spec.worldbody.add_body(name="ball", mocap=True)
        body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS, 0.0, 0.0])

    model, data = compiled(plan, add_ball)
    ball, geom = model.body("ball").geomadr[0], model.geom("ramp").id
    point = np.array([[0.52, 0.02, 0.12]])
    clearance = Relief(plan.solids, plan.floor).clearance(point, RADIUS)[0]
    data.mocap_pos[0] = point[0] - [0.0, 0.0, clearance]
    mujoco.mj_kinematics(model, data)
    assert mujoco.mj_geomDistance(model, data, ball, geom, 0.1, None) == pytest.approx(0.0, abs=1e-9)


def test_a_sliding_ball_does_not_catch_on_seams():
    tiles = [piece(f"tile{k}", 0.05 + 0.1 * k, (0.1, 0.2, 0.02)) for k in range(8)]
    over_tiles, over_one = slid(tiles), slid([piece("slab", 0.4, (0.8, 0.2, 0.02))])
    assert over_tiles[-1, 0] > 0.35
    assert np.abs(over_tiles - over_one).max() < 1e-3
    assert over_tiles[:, 1].max() < 4e-4


def slid(pieces):
    """Way and rise (n, 2), m, of a ball with the foot's contact that is pushed over pieces 2 cm high."""

    def add_ball(spec):
        body = spec.worldbody.add_body(name="ball", pos=[0.05, 0.0, 0.02 + RADIUS])
        for axis in ([1, 0, 0], [0, 0, 1]):
            body.add_joint(type=mujoco.mjtJoint.mjJNT_SLIDE, axis=axis)
        geom = body.add_geom(type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[RADIUS, 0.0, 0.0], mass=0.5)
        geom.priority, geom.friction, geom.solref = 1, [0.3, 0.005, 0.0001], [0.004, 1.0]

    model, data = compiled(plan_with(*pieces), add_ball)
    model.opt.timestep = 0.001
    way = np.zeros((1500, 2))
    for k in range(len(way)):
        # Little more than what friction holds back, so that a seam that held more would slow it.
        data.qfrc_applied[0] = 0.3 * 0.5 * 9.81 + 3.0 * (0.3 - data.qvel[0])
        mujoco.mj_step(model, data)
        way[k] = data.qpos
    return way


@pytest.mark.parametrize("kind", ["rubble", "stones"])
def test_pieces_are_ground_to_the_simulator(kind):
    robot = SimRobot(load_robot(), SimConfig(world=WorldConfig(name=kind), settle_time=0.2), seed=1)
    assert {int(robot.model.geom(solid.name).group[0]) for solid in robot.plan.solids} == {FLOOR_GROUP}
    assert not robot.ground.is_plane
    truth = robot.truth()
    assert math.isnan(truth.clearance)
    assert truth.collisions == truth.touching == ()
    assert np.abs(truth.foot_height).max() < 3e-4
    places = np.array([[0.7, 0.1], [1.1, -0.3], [1.4, 0.2]])
    assert [robot.ground.height(x, y) for x, y in places] == pytest.approx(heights(robot.plan, places))


def test_a_link_on_a_piece_of_ground_is_a_touch_and_no_collision():
    # A rail under the trunk, higher than the trunk's underside.
    rail = piece("rail", 0.0, (0.05, 0.1, 0.10))
    robot = standing_over(plan_with(rail))
    truth = robot.truth()
    assert truth.touching == ("trunk",)
    assert truth.collisions == ()
    assert robot.ground.height(0.0, 0.0) == pytest.approx(0.10)


def standing_over(plan):
    """A robot that stands in the world of a plan that no file could have."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bluefoot_mpc.sim.body.world_plan", lambda config, seed: plan)
        robot = SimRobot(load_robot(), SimConfig(settle_time=0.1))
    stance = load_robot().stance_joints
    for _ in range(5):
        robot.step(JointCommand(position=stance, speed=np.zeros(16), torque_limit=np.ones(16)))
    return robot


def test_planned_worlds_without_rough_ground_are_planes():
    plan = make_plan("room", 1)
    assert plan.is_even
    assert Ground(WorldConfig(name="room"), None, None, plan).is_plane
    assert not Ground(WorldConfig(name="kerb"), None, None, plan_with(LEANING[0])).is_plane
