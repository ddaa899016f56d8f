import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import (
    WORLDS,
    PushConfig,
    RandomizationConfig,
    SensorConfig,
    SimConfig,
    WorldConfig,
)
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.sim.terrain import rough_heights
from bluefoot_mpc.types import JointCommand

BOX_WORLD = """
<mujoco model="two boxes">
  <worldbody>
    <geom name="ground" type="plane" size="0 0 1"/>
    <geom name="curb" type="box" size="0.5 0.5 0.05" pos="1 0 0.05"/>
    <body name="ball" pos="0 2 0.1"><freejoint/><geom type="sphere" size="0.1" mass="0.2"/></body>
  </worldbody>
</mujoco>
"""


@pytest.fixture(scope="module")
def model():
    return load_robot()


def hold(robot, model, frames):
    for _ in range(frames):
        robot.step(JointCommand(position=model.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16)))
    return robot.truth()


@pytest.mark.parametrize("name", WORLDS)
def test_robot_stands_in_every_world(model, name):
    truth = hold(SimRobot(model, SimConfig(world=WorldConfig(name=name))), model, 25)
    assert truth.touching == ()
    assert (truth.foot_force[:, 2] > 1.0).all()
    assert np.abs(truth.foot_height).max() < 3e-4


def test_things_of_a_user_s_world_are_told_from_its_ground(model, tmp_path):
    file = tmp_path / "boxes.xml"
    file.write_text(BOX_WORLD)
    robot = SimRobot(model, SimConfig(world=WorldConfig(name=str(file))))
    groups = {name: robot.model.geom(f"world_{name}").group[0] for name in ("ground", "curb")}
    assert groups == {"ground": 0, "curb": 1}
    truth = robot.truth()
    # The curb's near face is half a metre ahead, and the knees reach farther out than the feet.
    front = truth.foot_position[:, 0].max()
    assert 0.5 - front - 0.05 < truth.clearance < 0.5 - front
    assert truth.collisions == ()


def test_flat_ground_is_at_zero(model):
    ground = SimRobot(model, SimConfig()).ground
    assert ground.height(3.0, -2.0) == 0.0
    assert ground.clearance(np.array([[1.0, 2.0, 0.05]]), 0.008) == pytest.approx([0.042])


def test_slope_climbs_along_x(model):
    ground = SimRobot(model, SimConfig(world=WorldConfig(slope_deg=10.0))).ground
    assert ground.height(1.0, 5.0) == pytest.approx(math.tan(math.radians(10.0)))
    point = np.array([[1.0, 0.0, math.tan(math.radians(10.0)) + 0.1]])
    assert ground.clearance(point, 0.0) == pytest.approx([0.1 * math.cos(math.radians(10.0))])


def test_named_slope_has_a_default_and_ray_agrees_with_formula(model):
    config = WorldConfig(name="slope")
    assert math.degrees(config.slope) == pytest.approx(5.0)
    robot = SimRobot(model, SimConfig(world=config))
    formula = robot.ground.height(0.7, 0.1)
    robot.ground._plane = False
    assert robot.ground.height(0.7, 0.1) == pytest.approx(formula, abs=1e-9)


def test_steps_go_up_and_down_again(model):
    config = WorldConfig(name="steps", step_height=0.02, step_depth=0.2, step_count=3, step_start=0.4)
    ground = SimRobot(model, SimConfig(world=config)).ground
    heights = [ground.height(x, 0.0) for x in (0.3, 0.5, 0.7, 0.9, 1.1, 1.3, 1.5)]
    assert heights == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.04, 0.02, 0.0], abs=1e-9)


def test_rough_ground_is_flat_at_the_start_and_as_rough_as_asked(model):
    config = WorldConfig(name="rough", rough_height=0.02)
    ground = SimRobot(model, SimConfig(world=config)).ground
    assert [ground.height(x, y) for x, y in ((0.0, 0.0), (0.16, 0.16), (-0.2, 0.1))] == pytest.approx(
        [0.0] * 3, abs=1e-6
    )
    field = [ground.height(x, y) for x in np.linspace(0.6, 3.5, 30) for y in np.linspace(-3.0, 3.0, 30)]
    assert -0.0101 < min(field) < -0.005
    assert 0.005 < max(field) < 0.0101
    assert math.isfinite(ground.height(9.0, 0.0))


def test_rough_ground_comes_from_its_own_seed():
    one = rough_heights(WorldConfig(name="rough", rough_seed=1))
    assert np.array_equal(one, rough_heights(WorldConfig(name="rough", rough_seed=1)))
    assert not np.array_equal(one, rough_heights(WorldConfig(name="rough", rough_seed=2)))
    assert one.min() == 0.0
    assert one.max() == 1.0


def test_world_from_a_file(model, tmp_path):
    file = tmp_path / "boxes.xml"
    file.write_text(BOX_WORLD)
    robot = SimRobot(model, SimConfig(world=WorldConfig(name=str(file))))
    assert robot.ground.height(1.0, 0.0) == pytest.approx(0.1)
    assert robot.ground.height(0.1, 0.0) == pytest.approx(0.0)
    truth = hold(robot, model, 10)
    assert (truth.foot_force[:, 2] > 1.0).all()
    # The ball moves on its own; what the robot weighs does not count it.
    assert truth.momentum == pytest.approx(np.zeros(6), abs=1e-2)


def test_world_file_that_is_no_model_is_refused(model, tmp_path):
    file = tmp_path / "broken.xml"
    file.write_text("<mujoco><nonsense/></mujoco>")
    with pytest.raises(ConfigurationError, match=r"broken\.xml"):
        SimRobot(model, SimConfig(world=WorldConfig(name=str(file))))


def test_unknown_world_names_the_valid_ones():
    with pytest.raises(UnknownNameError, match=r"Did you mean 'slope'.*arena, .*maze, .*slope, steps"):
        WorldConfig(name="slopes")
    with pytest.raises(ConfigurationError, match=r"no world file 'none\.xml'.*a plan .*flat, rough"):
        WorldConfig(name="none.xml")


@pytest.mark.parametrize(
    ("cls", "table"),
    [
        (WorldConfig, {"friction": -0.1}),
        (WorldConfig, {"slope_deg": 80.0}),
        (WorldConfig, {"payload": [-0.1, 0.0, 0.0, 0.0]}),
        (WorldConfig, {"payload": [0.1, 0.0]}),
        (WorldConfig, {"step_count": 0}),
        (PushConfig, {"time": -1.0, "impulse": 1.0}),
        (PushConfig, {"time": 1.0, "impulse": 1.0, "duration": 0.0}),
        (SensorConfig, {"gyro_noise": -1.0}),
        (SensorConfig, {"switch_chatter": 1.5}),
        (RandomizationConfig, {"preset": "wild"}),
        (RandomizationConfig, {"friction": [1.0, 0.5]}),
        (RandomizationConfig, {"mass": 1.0}),
        (SimConfig, {"command_period": 0.0205}),
        (SimConfig, {"command_period": 0.0}),
        (SimConfig, {"physics_period": 0.01}),
        (SimConfig, {"latency": -0.01}),
        (SimConfig, {"backlash_deg": 50.0}),
    ],
)
def test_impossible_values_are_refused(cls, table):
    with pytest.raises(ConfigurationError):
        build(cls, table)
