"""The leader with the robot: truth, reset, and that they can touch."""

from __future__ import annotations

import math

import mujoco
import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.sim.leader import LeaderConfig
from bluefoot_mpc.sim.plant import SimPlant
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import JointCommand, TruthSample


@pytest.fixture(scope="module")
def model() -> RobotModel:
    return load_robot()


def stand(robot: SimRobot, model: RobotModel, seconds: float) -> TruthSample:
    hold = JointCommand(position=model.stance_joints, speed=np.zeros(16), torque_limit=np.ones(16))
    for _ in range(round(seconds / robot.period)):
        robot.step(hold)
    return robot.truth()


def with_leader(world: str = "flat", **values: object) -> SimConfig:
    leader = LeaderConfig(**{"kind": "differential", "delay": 0.0, **values})  # type: ignore[arg-type]
    return SimConfig(world=WorldConfig(name=world), leader=leader)


@pytest.mark.parametrize("world", ["flat", "arena"])
def test_truth_of_the_leader(model, world) -> None:
    robot = SimRobot(model, with_leader(world), seed=2)
    start = robot.truth()
    assert start.leader == pytest.approx([0.9, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], abs=1e-6)
    assert start.marker == pytest.approx([0.9, 0.0, 0.2], abs=1e-6)
    assert start.leader_wheels.tolist() == [0.0, 0.0]
    truth = stand(robot, model, 4.0)
    x, y, z = truth.leader[:3]
    # Up to speed in half a second, then along a circle of 0.85 m to the left.
    way = 4.0 * 0.10 - 0.03
    assert x - 0.9 == pytest.approx(0.85 * math.sin(way / 0.85), abs=0.03)
    assert y == pytest.approx(0.85 * (1.0 - math.cos(way / 0.85)), abs=0.02)
    assert z == 0.0
    assert 2.0 * math.atan2(truth.leader[5], truth.leader[6]) == pytest.approx(way / 0.85, abs=0.1)
    assert truth.marker == pytest.approx([x, y, 0.2], abs=1e-6)
    assert truth.leader_wheels == pytest.approx(
        [0.1 * (1.0 - s * 0.08 / 0.85) / 0.035 for s in (1, -1)], rel=0.1
    )
    assert truth.touching == truth.collisions == ()


def test_reset_brings_the_same_run_again(model) -> None:
    robot = SimRobot(model, with_leader(kind="two_steer"), seed=4)
    first = stand(robot, model, 1.5)
    robot.reset()
    again = stand(robot, model, 1.5)
    assert np.array_equal(first.leader, again.leader)
    assert np.array_equal(first.leader_wheels, again.leader_wheels)
    assert np.array_equal(first.q, again.q)


def test_without_a_leader_there_is_nothing_of_it(model) -> None:
    truth = stand(SimRobot(model, SimConfig()), model, 0.1)
    assert np.isnan(truth.leader).all()
    assert np.isnan(truth.marker).all()
    assert truth.leader_wheels.size == 0


def test_the_robot_is_not_disturbed_by_a_leader_elsewhere(model) -> None:
    alone = stand(SimRobot(model, SimConfig(), seed=1), model, 1.0)
    led = stand(SimRobot(model, with_leader(), seed=1), model, 1.0)
    assert led.q == pytest.approx(alone.q, abs=1e-6)


def test_robot_and_leader_collide(model) -> None:
    robot = SimRobot(model, with_leader(distance=1.0, speed=0.0), seed=1)
    data, joint = robot.data, robot.model.joint("leader_x")
    # Somebody pushes the leader into the robot.
    data.xfrc_applied[robot.model.body("leader").id, 0] = -8.0
    touched: set[str] = set()
    for _ in range(100):
        touched.update(stand(robot, model, 0.02).collisions)
    assert touched
    assert all(name.startswith("leader") or name == "marker" for name in touched)
    apart = 1.0 + float(data.qpos[joint.qposadr[0]]) - robot.truth().q[0]
    assert 0.15 < apart < 0.5  # ball against trunk, at the nearest


def test_a_leader_waits_for_a_robot_in_its_way(model) -> None:
    # A circle of 0.5 m comes back past the start, 0.5 m in front of the robot, heading away from it;
    # its far left is at (0.0, 0.5) heading for the robot's side.
    robot = SimRobot(model, with_leader(distance=0.5, radius=0.5, path="circle", speed=0.3), seed=1)
    truth = stand(robot, model, 14.0)
    assert truth.collisions == ()
    assert np.hypot(*truth.leader[:2]) > 0.4
    assert np.abs(truth.leader_wheels).max() < 0.1


def test_no_leader_where_a_marker_stands(model) -> None:
    with pytest.raises(ConfigurationError, match="marker of its own"):
        SimRobot(model, with_leader("hidden"))


def test_the_emulated_robots_body_has_it_too(model) -> None:
    posture = Posture(joints=model.stance_joints, height=float(model.default_stance()[2]))
    plant = SimPlant(model, with_leader(), posture, seed=2)
    plant.advance(2.0)
    truth = plant.truth()
    assert truth.leader[0] > 1.0
    assert np.array_equal(truth.marker[:2], truth.leader[:2])


def test_leaders_shapes_are_things_and_robots_shapes_stay(model) -> None:
    alone, led = SimRobot(model, SimConfig()).model, SimRobot(model, with_leader(kind="two_steer")).model
    for geom in range(led.ngeom):
        body = led.body(led.geom_bodyid[geom]).name
        assert (led.geom_group[geom] == 1) == body.startswith("leader")
    names = {alone.body(i).name for i in range(alone.nbody)}
    assert {led.body(i).name for i in range(led.nbody) if not led.body(i).name.startswith("leader")} == names
    assert mujoco.mj_name2id(led, mujoco.mjtObj.mjOBJ_JOINT, "leader_yaw") >= 0
