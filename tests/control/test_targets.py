from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.targets import START_TIME, JointTargets
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import AnkleConfig, feet_in_base
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import PostureReference
from tests.io.safety.scripted import make_frame

DT = 0.02


@pytest.fixture(scope="module")
def robot():
    return load_robot()


def reference(robot, position=(0.0, 0.0, 0.0), rpy=(0.0, 0.0, 0.0)):
    return PostureReference(
        trunk_position=np.array([0.0, 0.0, 0.115]) + position, trunk_rpy=np.array(rpy),
        foot_position=robot.parameters.stance.foot_position, swing=np.zeros(4, dtype=bool),
    )  # fmt: skip


@pytest.mark.parametrize("policy", ["fixed", "ground", "margin"])
def test_the_joints_put_the_feet_where_the_reference_wants_them(robot, policy):
    targets = JointTargets(robot.geometry, AnkleConfig(policy=policy))
    wanted = reference(robot, (0.005, -0.003, 0.002), (0.06, -0.04, 0.1))
    result = targets.reach(wanted)
    feet = feet_in_base(robot.geometry, result.joints) @ rotation_from_rpy(wanted.trunk_rpy).T
    np.testing.assert_allclose(feet + wanted.trunk_position, wanted.foot_position, atol=1e-12)


def test_the_ground_policy_keeps_the_last_links_upright_under_a_tilted_trunk(robot):
    targets = JointTargets(robot.geometry, AnkleConfig(policy="ground", direction_deg=-99.0))
    for rpy in ((0.1, 0.0, 0.0), (0.0, 0.1, 0.0)):
        joints = targets.reach(reference(robot, rpy=rpy)).joints
        rotation = rotation_from_rpy(np.array(rpy))
        for leg in range(4):
            yaw = robot.geometry.hip_azimuth[leg] + joints[4 * leg]
            direction = joints[4 * leg + 1 : 4 * leg + 4].sum()
            link = np.array(
                [np.cos(yaw) * np.cos(direction), np.sin(yaw) * np.cos(direction), np.sin(direction)]
            )
            plane = np.array([np.cos(yaw), np.sin(yaw), 0.0])
            up = rotation[2] - (rotation[2] @ [-plane[1], plane[0], 0.0]) * np.array(
                [-plane[1], plane[0], 0.0]
            )
            angle = np.degrees(np.arccos(link @ up / np.linalg.norm(up)))
            assert angle == pytest.approx(90.0 + 99.0 - 2 * 9.0, abs=1e-6)  # 9° beyond straight down


def test_the_start_goes_softly_from_where_the_joints_are_found(robot):
    targets = JointTargets(robot.geometry, AnkleConfig())
    found = robot.stance_joints + 0.3
    goals = []
    for _ in range(round(START_TIME / DT) + 5):
        assert targets.started == (len(goals) * DT >= START_TIME - 1e-9)
        goals.append(targets.step(reference(robot), make_frame(joint_position=found), DT)[0])
    wanted = targets.reach(reference(robot)).joints
    assert np.abs(goals[0] - found).max() < 0.01
    np.testing.assert_array_equal(goals[-1], wanted)
    steps = np.abs(np.diff(goals, axis=0)).max()
    assert steps < 2.0 * np.abs(found - wanted).max() * DT / START_TIME
    middle = goals[round(0.5 * START_TIME / DT) - 1]
    np.testing.assert_allclose(middle, 0.5 * (found + wanted), atol=1e-9)


def test_only_the_first_frame_tells_where_the_joints_were_found(robot):
    one, two = (JointTargets(robot.geometry, AnkleConfig()) for _ in range(2))
    first = make_frame(joint_position=robot.stance_joints + 0.2)
    one.step(reference(robot), first, DT)
    two.step(reference(robot), first, DT)
    later = replace(first, joint_position=robot.stance_joints - 0.2)
    np.testing.assert_array_equal(
        one.step(reference(robot), first, DT)[0], two.step(reference(robot), later, DT)[0]
    )


def test_a_joint_that_did_not_answer_starts_where_it_is_wanted(robot):
    targets = JointTargets(robot.geometry, AnkleConfig())
    position, valid = robot.stance_joints + 0.2, np.ones(16, dtype=bool)
    position[3], valid[[7, 8]] = np.nan, False
    # One has been silent for a while, the other was not asked in this period alone.
    read = np.zeros(16)
    read[7], read[8] = -1.0, -0.03
    frame = make_frame(joint_position=position, joint_valid=valid, joint_time=read)
    goal, _ = targets.step(reference(robot), frame, DT)
    wanted = targets.reach(reference(robot)).joints
    np.testing.assert_array_equal(goal[[3, 7]], wanted[[3, 7]])
    assert np.abs(goal[[0, 8]] - position[[0, 8]]).max() < 0.01


def test_limits_cut_the_goals_and_each_is_told_when_it_begins_to(robot):
    targets = JointTargets(robot.geometry, AnkleConfig())
    far = reference(robot, (0.13, 0.0, 0.0))
    frame = make_frame(joint_position=robot.stance_joints)
    told = [targets.step(far, frame, DT)[1] for _ in range(60)]
    assert told[0]
    assert all("passes its limit" in event for event in told[0])
    assert not any(told[1:])
    goal, _ = targets.step(far, frame, DT)
    assert np.all(goal >= robot.lower)
    assert np.all(goal <= robot.upper)
    assert not targets.step(reference(robot), frame, DT)[1]
    assert targets.step(far, frame, DT)[1]  # and again
