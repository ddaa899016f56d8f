import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.gait_sway import GaitSway, SwayConfig
from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.control.servo_map import ServoMapConfig
from bluefoot_mpc.control.sway import Sway
from bluefoot_mpc.control.targets import JointTargets
from bluefoot_mpc.control.trunk import Footing, TrunkPlanner
from bluefoot_mpc.gait.gait import Gait, GaitConfig, GaitInputs
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import AnkleConfig
from bluefoot_mpc.model.robot import RobotModel, load_robot
from bluefoot_mpc.types import BodyState, MotionCommand, TrunkPose
from bluefoot_mpc.zmp.placement import PlacementConfig

DT = 0.02
STILL = PlacementConfig(enabled=False)
UNTRIMMED = PostureConfig(level_gain=0.0)


@pytest.fixture(scope="module")
def robot():
    return load_robot()


class Bench:
    """A trunk planner over a standing or walking gait, whose legs follow without error."""

    def __init__(self, robot, zmp=STILL, config=None):
        config = config or PostureConfig()
        stance = posture.stance(robot.parameters.stance, config)
        self.targets = JointTargets(robot.geometry, AnkleConfig())
        masses = LegMasses(robot.parameters)
        self.trunk = TrunkPlanner(
            stance,
            config,
            lambda joints: GaitSway(SwayConfig(), Sway(masses, zmp, joints), None),
            self.targets.reach,
        )
        self.gait = Gait(GaitConfig(), stance.feet, posture.style(stance, config, ServoMapConfig()))
        self.joints = robot.stance_joints
        self.estimate = BodyState(
            time=0.0, position=np.zeros(3), quaternion=np.array([0.0, 0.0, 0.0, 1.0]), rpy=np.zeros(3),
            linear_velocity=np.zeros(3), angular_velocity=np.zeros(3), joint_position=self.joints,
            joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool),
            foot_position_in_base=np.zeros((4, 3)), height=0.115,
        )  # fmt: skip

    def run(self, seconds, motion=None, sit_level=0.0, velocity=0.0, gait="trot", **estimate):
        motion = motion or MotionCommand()
        for _ in range(round(seconds / DT)):
            inputs = GaitInputs(velocity=np.array([velocity, 0.0]), gait=gait)
            seen = replace(self.estimate, joint_position=self.joints, **estimate)
            self.output = self.gait.step(inputs, DT)
            footing = Footing(sit_level=sit_level, joints=self.joints)
            self.reference, self.zmp, events = self.trunk.step(self.output, motion, seen, footing, DT)
            self.joints = self.targets.reach(self.reference).joints
            yield events


def settle(bench, seconds, **more):
    return [event for events in bench.run(seconds, **more) for event in events]


def pose(x=0.0, y=0.0, z=0.0, roll=0.0, pitch=0.0, yaw=0.0):
    return MotionCommand(trunk=TrunkPose(position=np.array([x, y, z]), rpy=np.array([roll, pitch, yaw])))


def test_a_commanded_pose_is_the_reference_over_the_neutral_place(robot):
    bench = Bench(robot, config=PostureConfig(trunk_forward=0.01))
    settle(bench, 2.0, motion=pose(0.02, -0.03, 0.01, 0.1, -0.05, 0.2))
    np.testing.assert_allclose(bench.reference.trunk_position, [0.03, -0.03, 0.125], atol=1e-12)
    assert bench.trunk.yaw == pytest.approx(0.2)
    np.testing.assert_array_equal(bench.trunk.position, bench.reference.trunk_position)


def test_the_level_trim_leans_against_a_tilt_that_was_not_commanded(robot):
    bench = Bench(robot)
    tilt = np.array([0.03, -0.02, 0.0])
    settle(bench, 1.0, rpy=tilt)
    expected = -PostureConfig().level_gain * tilt[:2]
    np.testing.assert_allclose(bench.reference.trunk_rpy[:2], expected, rtol=1e-6)


def test_a_commanded_tilt_is_no_error(robot):
    bench = Bench(robot)
    settle(bench, 1.0, motion=pose(roll=0.1))
    before = bench.reference.trunk_rpy[0]
    settle(bench, 2.0, motion=pose(roll=0.1), rpy=np.array([0.1, 0.0, 0.0]))
    assert bench.reference.trunk_rpy[0] == pytest.approx(before, abs=1e-12)


@pytest.mark.parametrize("more", [{"healthy": False}, {"sit_level": 0.3}])
def test_the_trim_rests_while_blind_or_not_standing(robot, more):
    bench = Bench(robot)
    settle(bench, 1.0, rpy=np.array([0.05, 0.05, 0.0]), **more)
    np.testing.assert_array_equal(bench.reference.trunk_rpy, 0.0)


@pytest.mark.parametrize("yaw", [0.0, 0.3])
def test_the_commanded_rate_is_the_horizontal_angular_velocity(robot, yaw):
    bench = Bench(robot, config=UNTRIMMED)
    settle(bench, 2.0, motion=pose(yaw=yaw, pitch=0.1))
    np.testing.assert_array_equal(bench.trunk.tilt_rate, 0.0)
    list(bench.run(0.1, motion=pose(roll=0.1, pitch=-0.1, yaw=yaw)))
    before = rotation_from_rpy(bench.reference.trunk_rpy)
    list(bench.run(DT, motion=pose(roll=0.1, pitch=-0.1, yaw=yaw)))
    after = rotation_from_rpy(bench.reference.trunk_rpy)
    turn = (after - before) @ after.T / DT
    np.testing.assert_allclose(bench.trunk.tilt_rate, [turn[2, 1], turn[0, 2]], atol=0.005)
    assert np.hypot(*bench.trunk.tilt_rate) == pytest.approx(math.hypot(0.6, 0.6), rel=0.03)


def test_a_pose_out_of_reach_is_followed_as_far_as_the_legs_hold_it_and_said_once(robot):
    bench = Bench(robot)
    events = settle(bench, 3.0, motion=pose(x=0.12))
    assert len(events) == 1
    assert "out of reach" in events[0]
    stopped = bench.reference.trunk_position[0]
    assert 0.08 < stopped < 0.12
    assert bench.targets.reach(bench.reference).feasible
    assert not settle(bench, 3.0, motion=pose(x=0.0))
    assert bench.reference.trunk_position[0] == 0.0


def test_a_pose_within_reach_is_gone_to_through_poses_that_are_not(robot):
    bench = Bench(robot)
    settle(bench, 2.0, motion=pose(x=0.09))
    settle(bench, 1.0, motion=pose(x=0.09), sit_level=-0.25)
    assert not bench.targets.reach(bench.reference).feasible
    # Farther from neutral on the whole than before, but held by the legs where it ends.
    settle(bench, 4.0, motion=pose(x=0.02, roll=0.1), sit_level=-0.25)
    assert bench.targets.reach(bench.reference).feasible
    np.testing.assert_allclose(bench.reference.trunk_rpy, (0.1, 0.0, 0.0), atol=1e-9)


def test_the_way_back_is_open_even_where_the_legs_no_longer_reach(robot):
    bench = Bench(robot)
    settle(bench, 2.0, motion=pose(x=0.09))
    settle(bench, 1.0, motion=pose(x=0.09), sit_level=-0.25)  # the trunk rises: too far for the hind legs
    assert not bench.targets.reach(bench.reference).feasible
    settle(bench, 2.0, motion=pose(x=0.0), sit_level=-0.25)
    assert bench.reference.trunk_position[0] == 0.0


@pytest.mark.parametrize(
    "command", [pose(x=0.05), pose(y=-0.04), pose(roll=0.25), pose(pitch=-0.2), pose(x=0.03, yaw=0.3)]
)
def test_the_placement_law_leaves_a_commanded_pose_alone(robot, command):
    bench = Bench(robot, zmp=PlacementConfig(), config=UNTRIMMED)
    settle(bench, 3.0)
    neutral = bench.reference.trunk_position
    settle(bench, 15.0, motion=command)
    moved = bench.reference.trunk_position - neutral
    np.testing.assert_allclose(moved, command.trunk.position, atol=1e-3)


def test_the_trunk_leans_away_from_the_leg_that_will_swing(robot):
    law = PlacementConfig(lead=0.2)
    bench = Bench(robot, zmp=law)
    leaning = np.zeros((4, 2))
    for _ in range(400):
        list(bench.run(DT, velocity=0.04, gait="walk"))
        ahead = (
            bench.output.phase.phase + law.lead / bench.output.cycle_time
        ) % 1.0 < bench.output.swing_share
        if ahead.sum() == 1:
            shift = bench.zmp - bench.reference.trunk_position[:2]
            leaning[np.flatnonzero(ahead)[0]] += shift
    outward = np.array([[1, 1], [1, -1], [-1, 1], [-1, -1]])
    assert np.all(leaning * outward < 0.0)


def test_the_lean_turns_with_the_feet_and_not_with_the_trunk(robot):
    """The leg in the air is in the same place of b' whether the trunk looks that way or not."""
    shifts = []
    for yaw in (0.0, 0.3):
        bench = Bench(robot, zmp=PlacementConfig(lead=0.0), config=UNTRIMMED)
        settle(bench, 3.0, motion=pose(yaw=yaw))
        settle(bench, 0.16, motion=pose(yaw=yaw), velocity=0.04, gait="walk")
        assert bench.output.phase.swing.sum() == 1
        shifts.append(bench.zmp - bench.reference.trunk_position[:2])
    assert np.hypot(*shifts[0]) > 0.01
    np.testing.assert_allclose(shifts[1], shifts[0], atol=0.002)


def test_a_robot_whose_mass_lies_aside_keeps_its_commanded_pose_too(robot):
    parts = [
        replace(part, position=(part.position[0] + 0.01, *part.position[1:]))
        if "battery" in part.name
        else part
        for part in robot.parameters.parts
    ]
    lopsided = RobotModel(replace(robot.parameters, parts=tuple(parts)))
    bench = Bench(lopsided, zmp=PlacementConfig(gain=1.0), config=UNTRIMMED)
    settle(bench, 40.0)
    neutral = bench.reference.trunk_position
    assert neutral[0] > 0.005
    settle(bench, 40.0, motion=pose(y=0.04))
    np.testing.assert_allclose(bench.reference.trunk_position - neutral, [0.0, 0.04, 0.0], atol=1e-3)


def test_the_assumed_zmp_is_told_in_the_virtual_robots_frame(robot):
    bench = Bench(robot, zmp=PlacementConfig())
    settle(bench, 15.0, motion=pose(x=0.05))
    # Standing on four feet it lies under the centre of mass, near the trunk.
    np.testing.assert_allclose(bench.zmp, bench.reference.trunk_position[:2], atol=0.015)
    assert bench.zmp[0] > 0.03


def test_the_law_switched_off_tells_no_zmp(robot):
    bench = Bench(robot)
    settle(bench, 0.1, velocity=0.05)
    assert np.isnan(bench.zmp).all()
    np.testing.assert_array_equal(bench.reference.trunk_position[:2], 0.0)


def test_sitting_lowers_the_trunk_by_its_share(robot):
    bench = Bench(robot)
    for level in (0.0, 0.5, 1.0):
        settle(bench, DT, sit_level=level)
        share = 1.0 - level * (1.0 - PostureConfig().sit_height_share)
        assert bench.reference.trunk_position[2] == pytest.approx(0.115 * share)
        assert bench.targets.reach(bench.reference).feasible


def test_reset_gives_the_first_state_back(robot):
    bench, fresh = Bench(robot, zmp=PlacementConfig()), Bench(robot, zmp=PlacementConfig())
    settle(bench, 2.0, motion=pose(x=0.03, yaw=0.2, roll=0.1), rpy=np.array([0.1, 0.0, 0.0]))
    bench.trunk.reset()
    bench.gait.reset()
    bench.joints = robot.stance_joints
    for one, two in zip(bench.run(1.0, velocity=0.05), fresh.run(1.0, velocity=0.05), strict=True):
        assert one == two
        np.testing.assert_array_equal(bench.reference.trunk_position, fresh.reference.trunk_position)
        np.testing.assert_array_equal(bench.trunk.position, fresh.trunk.position)
