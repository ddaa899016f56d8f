"""Planned forces and torques against the laws that they have to obey."""

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.body_planner import BodyPlanner, BodyPlannerConfig, Surroundings
from bluefoot_mpc.control.planned_body import PlannedBody
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs
from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import Fallback, PostureReference
from bluefoot_mpc.wbc import WholeBodyModel

DT = 0.02
LEVEL = np.zeros(2)


@pytest.fixture(scope="module")
def robot():
    return load_robot()


@pytest.fixture(scope="module")
def model(robot):
    return WholeBodyModel.from_robot(robot)


class Bench:
    """A planned robot in its stance, and what is planned for it."""

    def __init__(self, robot, **config):
        stance = posture.stance(robot.parameters.stance, PostureConfig())
        self.gait = Gait(GaitConfig(), stance.feet, posture.style(stance, PostureConfig(), ServoMapConfig()))
        self.planner = BodyPlanner(robot, BodyPlannerConfig(enabled=True, **config))
        self.body = PlannedBody(robot.parameters.servo)
        self.robot, self.height = robot, stance.trunk_height

    def step(self, velocity=0.0, slope=LEVEL, com=None, rpy=(0.0, 0.0, 0.0), **around):
        output = self.gait.step(GaitInputs(velocity=np.array([velocity, 0.0])), DT)
        reference = PostureReference(
            trunk_position=np.array([0.0, 0.0, self.height]), trunk_rpy=np.array(rpy),
            foot_position=output.foot_position, swing=output.phase.swing,
        )  # fmt: skip
        self.body.step(output, reference, self.robot.stance_joints, DT)
        more = {"voltage": 12.0, "derating": 1.0, **around}
        surroundings = Surroundings(feet=self.gait.feet_ahead(), slope=np.asarray(slope), com=com, **more)
        self.output = output
        return self.planner.step(self.body, output, surroundings, DT)


class Com:
    """As much of a plan as is asked for: the centre of mass accelerates."""

    def __init__(self, acceleration):
        self.start = np.vstack([np.zeros((2, 2)), acceleration])


def test_forces_of_a_standing_robot_carry_its_weight_and_nothing_else(robot, model):
    plan = Bench(robot).step()
    assert plan.status is Fallback.SOLVED
    np.testing.assert_allclose(
        plan.foot_force.sum(axis=0), [0.0, 0.0, model.weight], atol=1e-6 * model.weight
    )
    assert np.all(plan.foot_force[:, 2] > 0.1 * model.weight)
    assert plan.residual < 1e-8


def test_torques_of_a_standing_robot_are_those_that_hold_it(robot, model):
    bench = Bench(robot)
    plan = bench.step()
    data = model.pin_model.createData()
    expected = pin.computeGeneralizedGravity(model.pin_model, data, bench.body.q)
    pin.computeJointJacobians(model.pin_model, data, bench.body.q)
    pin.updateFramePlacements(model.pin_model, data)
    for frame, force in zip(model.frames, plan.foot_force, strict=True):
        jacobian = pin.getFrameJacobian(model.pin_model, data, frame, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        expected = expected - jacobian[:3].T @ force
    np.testing.assert_allclose(plan.torque, expected[6:], atol=2e-4)


@pytest.mark.parametrize("acceleration", [(0.5, 0.0), (0.0, -0.8)])
def test_a_planned_acceleration_of_the_centre_of_mass_is_pushed_by_the_feet(robot, model, acceleration):
    plan = Bench(robot).step(com=Com(np.array(acceleration)))
    mass = model.weight / 9.80665
    np.testing.assert_allclose(
        plan.foot_force.sum(axis=0)[:2], mass * np.array(acceleration), rtol=0.03, atol=0.05
    )


def test_feet_in_the_air_carry_nothing_and_those_on_the_ground_everything(robot, model):
    bench = Bench(robot)
    seen = []
    for _ in range(150):
        plan = bench.step(velocity=0.06)
        swing = bench.output.phase.swing
        seen.append(tuple(swing.tolist()))
        np.testing.assert_array_equal(plan.foot_force[swing], 0.0)
        assert np.all(plan.foot_force[~swing, 2] >= -1e-9)
        assert np.all(
            np.hypot(*plan.foot_force[:, :2].T) <= 0.5 * np.sqrt(2.0) * plan.foot_force[:, 2] + 1e-4
        )
        assert plan.status <= Fallback.NEAREST
    assert len(set(seen)) >= 3


def test_on_a_ramp_forces_stay_in_the_cones_of_its_normal(robot, model):
    slope, wanted = np.array([0.25, 0.0]), -6.0
    normal = np.array([-0.25, 0.0, 1.0]) / np.hypot(0.25, 1.0)
    climbing, falling = (
        Bench(robot).step(slope=s, com=Com(np.array([wanted, 0.0]))) for s in (slope, -slope)
    )
    along = climbing.foot_force @ normal
    across = np.linalg.norm(climbing.foot_force - along[:, None] * normal, axis=1)
    assert np.all(across <= 0.5 * np.sqrt(2.0) * along + 1e-3)
    # The ground that leans towards the push gives more of it.
    share = [plan.foot_force[:, 0].sum() / (wanted * model.weight / 9.80665) for plan in (climbing, falling)]
    assert share[0] > share[1] + 0.2


def test_heat_and_a_low_battery_narrow_the_torque(robot):
    cool = Bench(robot).step()
    cold = Bench(robot).step(derating=0.1)
    limit = 0.1 * robot.parameters.servo.stall_torque
    assert np.abs(cool.torque).max() > limit
    assert np.abs(cold.torque).max() <= limit + 1e-3
    low = Bench(robot).step(voltage=2.0)
    assert np.abs(low.torque).max() <= robot.parameters.servo.stall_torque / 6.0 + 1e-3


def test_no_foot_on_the_ground_gives_no_force_and_no_rubbish(robot, model):
    bench = Bench(robot)
    bench.step()
    air = replace(bench.output, phase=replace(bench.output.phase, swing=np.ones(4, dtype=bool)))
    feet = bench.gait.feet_ahead()
    around = Surroundings(feet=feet, slope=LEVEL, voltage=12.0, derating=1.0, com=None)
    plan = bench.planner.step(bench.body, air, around, DT)
    np.testing.assert_array_equal(plan.foot_force, 0.0)
    assert np.isfinite(plan.torque).all()
    assert "no foot" in plan.reason


@pytest.mark.parametrize("part", ["q", "v"])
def test_a_state_that_is_not_finite_gives_the_last_plan(robot, part):
    bench = Bench(robot)
    good = bench.step()
    getattr(bench.body, part)[2] = np.nan
    around = Surroundings(feet=bench.gait.feet_ahead(), slope=LEVEL, voltage=12.0, derating=1.0, com=None)
    plan = bench.planner.step(bench.body, bench.output, around, DT)
    assert plan.status is Fallback.SHIFTED
    np.testing.assert_array_equal(plan.torque, good.torque)


def test_reset_forgets_the_last_plan_bit_for_bit(robot):
    bench, fresh = Bench(robot), Bench(robot)
    for _ in range(40):
        bench.step(velocity=0.1)
    bench.planner.reset()
    bench.gait.reset()
    bench.body.reset()
    for _ in range(40):
        one, other = bench.step(velocity=0.06), fresh.step(velocity=0.06)
        np.testing.assert_array_equal(one.torque, other.torque)
        np.testing.assert_array_equal(one.foot_force, other.foot_force)


def test_a_tilted_trunk_is_planned_as_it_is(robot, model):
    bench = Bench(robot)
    plan = bench.step(rpy=(0.05, -0.04, 0.1))
    np.testing.assert_array_equal(bench.body.q[3:7], quaternion_from_rpy(np.array([0.05, -0.04, 0.1])))
    assert plan.foot_force[:, 2].sum() == pytest.approx(model.weight, rel=1e-6)
