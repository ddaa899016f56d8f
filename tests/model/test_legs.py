import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.geometry import rotation_z
from bluefoot_mpc.model.legs import (
    LegGeometry,
    feet_in_base,
    foot_jacobians_in_base,
    joint_positions_in_base,
    leg_jacobian,
    link_midpoints,
    to_leg_frame,
)
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.robot import load_robot
from tests.model.leg_samples import random_joints, uneven_geometry


@pytest.fixture(scope="module")
def bluefoot():
    return LegGeometry.from_parameters(load_parameters())


@pytest.fixture(params=["bluefoot", "uneven"])
def geometry(request, bluefoot):
    return bluefoot if request.param == "bluefoot" else uneven_geometry()


def test_stretched_legs_point_outward_along_their_azimuths(bluefoot):
    feet = feet_in_base(bluefoot, np.zeros(16))
    reach = 0.09215 + 4 * 0.065
    expected = reach * np.array([[1, 1, 0], [1, -1, 0], [-1, 1, 0], [-1, -1, 0]]) / np.sqrt(2.0)
    np.testing.assert_allclose(feet, expected, atol=1e-15)


def test_positive_angles_turn_left_and_raise_the_outer_link(bluefoot):
    rest = to_leg_frame(bluefoot, feet_in_base(bluefoot, np.zeros(16)))
    for joint in range(4):
        joints = np.zeros(16)
        joints[joint::4] = 0.1
        moved = to_leg_frame(bluefoot, feet_in_base(bluefoot, joints)) - rest
        assert (moved[:, 1 if joint == 0 else 2] > 0.005).all()


def test_foot_is_the_printed_closed_form_in_the_leg_frame(geometry):
    rng = np.random.default_rng(1)
    a1, a2, a3, a4 = geometry.link_lengths
    for joints in random_joints(geometry, rng, 20):
        q1, q2, q3, q4 = joints.reshape(4, 4).T
        r = a1 + a2 * np.cos(q2) + a3 * np.cos(q2 + q3) + a4 * np.cos(q2 + q3 + q4)
        z = a2 * np.sin(q2) + a3 * np.sin(q2 + q3) + a4 * np.sin(q2 + q3 + q4)
        expected = np.column_stack([np.cos(q1) * r, np.sin(q1) * r, z])
        np.testing.assert_allclose(
            to_leg_frame(geometry, feet_in_base(geometry, joints)), expected, atol=1e-15
        )


def test_feet_joints_and_jacobians_agree_with_pinocchio():
    robot = load_robot()
    model, data = robot.pin_model, robot.pin_data
    rng = np.random.default_rng(2)
    for joints in random_joints(robot.geometry, rng, 50):
        q = np.concatenate([[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], joints])
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        feet = np.array([data.oMf[i].translation for i in robot.foot_frame_ids])
        np.testing.assert_allclose(feet_in_base(robot.geometry, joints), feet, atol=1e-12)
        origins = np.array([data.oMi[i].translation for i in range(2, 18)]).reshape(4, 4, 3)
        np.testing.assert_allclose(
            joint_positions_in_base(robot.geometry, joints)[:, :4], origins, atol=1e-12
        )
        jacobians = foot_jacobians_in_base(robot.geometry, joints)
        for leg, frame in enumerate(robot.foot_frame_ids):
            full = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            columns = slice(6 + 4 * leg, 10 + 4 * leg)
            np.testing.assert_allclose(jacobians[leg], full[:3, columns], atol=1e-12)
            turn = np.kron(np.eye(2), rotation_z(robot.geometry.hip_azimuth[leg]))
            in_base = turn @ leg_jacobian(robot.geometry, joints[4 * leg : 4 * leg + 4])
            np.testing.assert_allclose(in_base, full[:, columns], atol=1e-12)


def test_jacobians_are_the_finite_differences_of_the_feet(geometry):
    rng = np.random.default_rng(3)
    step = 1e-6
    for joints in random_joints(geometry, rng, 20):
        jacobians = foot_jacobians_in_base(geometry, joints)
        for leg in range(4):
            for joint in range(4):
                change = np.zeros(16)
                change[4 * leg + joint] = step
                difference = feet_in_base(geometry, joints + change) - feet_in_base(geometry, joints - change)
                np.testing.assert_allclose(jacobians[leg][:, joint], difference[leg] / (2 * step), atol=1e-7)
                others = np.delete(difference, leg, axis=0)
                np.testing.assert_array_equal(others, 0.0)


def test_chain_starts_at_the_hip_keeps_its_lengths_and_ends_at_the_foot(geometry):
    rng = np.random.default_rng(4)
    for joints in random_joints(geometry, rng, 20):
        points = joint_positions_in_base(geometry, joints)
        np.testing.assert_array_equal(points[:, 0], geometry.hip_position)
        np.testing.assert_allclose(points[:, -1], feet_in_base(geometry, joints), atol=1e-15)
        lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
        np.testing.assert_allclose(lengths, np.tile(geometry.link_lengths, (4, 1)), atol=1e-15)
        middles = link_midpoints(points)
        np.testing.assert_allclose(middles[:, 3], 0.5 * (points[:, 3] + points[:, 4]), atol=1e-15)


def test_stacks_and_single_legs_give_the_numbers_of_single_postures(geometry):
    rng = np.random.default_rng(5)
    joints = random_joints(geometry, rng, 6).reshape(2, 3, 16)
    for function in (feet_in_base, joint_positions_in_base, foot_jacobians_in_base):
        stacked = function(geometry, joints)
        for index in np.ndindex(2, 3):
            single = function(geometry, joints[index])
            np.testing.assert_allclose(stacked[index], single, atol=1e-15)
            legs = (3, 1)
            some = function(geometry, np.concatenate([joints[index][12:], joints[index][4:8]]), legs)
            np.testing.assert_array_equal(some, single[list(legs)])


def test_wrong_number_of_angles_is_refused(bluefoot):
    with pytest.raises(ValueError, match="4 legs take 16 angles, not 15"):
        feet_in_base(bluefoot, np.zeros(15))


def test_geometry_cannot_be_changed(bluefoot):
    with pytest.raises(ValueError, match="read-only"):
        bluefoot.lower[0] = 0.0
