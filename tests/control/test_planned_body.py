"""The planned velocity against finite differences of a motion in the world, and Pinocchio's feet."""

from types import SimpleNamespace

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.control.planned_body import PlannedBody
from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy, rotation_z
from bluefoot_mpc.model.legs import inverse
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import PostureReference
from bluefoot_mpc.wbc import WholeBodyModel

ANKLE = np.full(4, np.radians(-99.0))


@pytest.fixture(scope="module")
def robot():
    return load_robot()


class Motion:
    """b' that moves and turns over the ground, a trunk that sways and tilts in it, feet that stand still."""

    def __init__(self, robot, *, velocity=(0.2, -0.05), rate=0.6, tilt=1.0):
        self.robot, self.velocity, self.rate, self.tilt = robot, np.array(velocity), rate, tilt
        self.feet = robot.parameters.stance.foot_position + np.array([0.01, -0.005, 0.0])

    def frame(self, time):
        """Rotation (3, 3) and place (3,) of b' in the world, in closed form."""
        angle = self.rate * time
        if self.rate == 0.0:
            x, y = self.velocity * time
        else:
            s, c = np.sin(angle) / self.rate, (1.0 - np.cos(angle)) / self.rate
            x, y = self.velocity[0] * s - self.velocity[1] * c, self.velocity[0] * c + self.velocity[1] * s
        return rotation_z(angle), np.array([x, y, 0.0])

    def reference(self, time):
        rotation, place = self.frame(time)
        trunk = np.array(
            [0.01 * np.sin(3 * time), 0.012 * np.cos(4 * time), 0.115 + 0.004 * np.sin(5 * time)]
        )
        rpy = self.tilt * np.array(
            [0.03 * np.sin(4 * time), 0.02 * np.cos(3 * time), 0.05 * np.sin(2 * time)]
        )
        feet = (self.feet - place) @ rotation  # they stand in the world
        return PostureReference(
            trunk_position=trunk, trunk_rpy=rpy, foot_position=feet, swing=np.zeros(4, dtype=bool)
        )

    def joints(self, time):
        reference = self.reference(time)
        tilt = rotation_from_rpy(reference.trunk_rpy)
        return inverse(
            self.robot.geometry, (reference.foot_position - reference.trunk_position) @ tilt, ANKLE
        ).joints

    def planned(self, time, dt):
        body = PlannedBody(self.robot.parameters.servo)
        gait = SimpleNamespace(velocity=self.velocity, yaw_rate=self.rate)
        for now in (time - dt, time):
            body.step(gait, self.reference(now), self.joints(now), dt)
        return body

    def in_world(self, time):
        rotation, place = self.frame(time)
        reference = self.reference(time)
        return place + rotation @ reference.trunk_position, rotation @ rotation_from_rpy(reference.trunk_rpy)


def world_twist(motion, time, step=1e-5):
    """(6,) the trunk's twist over the ground in its own axes, by central differences."""
    (before, tilt_before), (after, tilt_after) = motion.in_world(time - step), motion.in_world(time + step)
    _, rotation = motion.in_world(time)
    linear = rotation.T @ (after - before) / (2.0 * step)
    return np.concatenate([linear, pin.log3(tilt_before.T @ tilt_after) / (2.0 * step)])


@pytest.mark.parametrize("rate", [0.0, 0.6, -0.8])
@pytest.mark.parametrize("time", [0.1, 0.37, 0.9])
def test_the_planned_twist_is_that_over_the_ground(robot, rate, time):
    motion = Motion(robot, rate=rate)
    body = motion.planned(time, 1e-4)
    expected = world_twist(motion, time)
    np.testing.assert_allclose(body.v[:3], expected[:3], atol=3e-4)
    # Rates of the angles stand for the angular velocity: exact for an upright trunk, else to their product.
    np.testing.assert_allclose(body.v[3:6], expected[3:], atol=0.012)


@pytest.mark.parametrize("rate", [0.0, 0.6])
def test_the_angular_velocity_is_exact_to_first_order_in_the_tilt(robot, rate):
    errors = []
    for tilt in (1.0, 0.5, 0.25):
        motion = Motion(robot, rate=rate, tilt=tilt)
        errors.append(np.abs(motion.planned(0.37, 1e-6).v[3:6] - world_twist(motion, 0.37)[3:]).max())
    assert errors[1] < 0.6 * errors[0]
    assert errors[2] < 0.6 * errors[1]


@pytest.mark.parametrize("rate", [0.0, 0.6, -0.8])
def test_feet_that_stand_are_at_rest_to_first_order(robot, rate):
    model = WholeBodyModel.from_robot(robot)
    data = model.pin_model.createData()
    worst = []
    for dt in (0.02, 0.01):
        body = Motion(robot, rate=rate, tilt=0.3).planned(0.1, dt)  # later the legs do not reach
        pin.forwardKinematics(model.pin_model, data, body.q, body.v)
        world = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
        speeds = [pin.getFrameVelocity(model.pin_model, data, frame, world).linear for frame in model.frames]
        worst.append(np.abs(speeds).max())
    # The feet themselves would have 0.2 m/s if b' were taken for the ground.
    assert worst[0] < 0.012
    assert worst[1] < 0.65 * worst[0]


def test_q_is_the_reference(robot):
    motion = Motion(robot)
    body = motion.planned(0.2, 0.02)
    reference = motion.reference(0.2)
    np.testing.assert_array_equal(body.q[:3], reference.trunk_position)
    np.testing.assert_array_equal(body.q[3:7], quaternion_from_rpy(reference.trunk_rpy))
    np.testing.assert_array_equal(body.q[7:], motion.joints(0.2))


def test_joint_speeds_are_differences_that_the_servos_can_follow(robot):
    body = PlannedBody(robot.parameters.servo)
    gait, reference = SimpleNamespace(velocity=np.zeros(2), yaw_rate=0.0), Motion(robot).reference(0.0)
    fastest = robot.parameters.servo.no_load_speed
    body.step(gait, reference, np.zeros(16), 0.02)
    np.testing.assert_array_equal(body.v, 0.0)
    body.step(gait, reference, np.linspace(-0.3, 0.3, 16), 0.02)
    expected = np.clip(np.linspace(-15.0, 15.0, 16), -fastest, fastest)
    np.testing.assert_allclose(body.joint_speed, expected)
    assert np.abs(body.joint_speed).max() == fastest


def test_reset_is_the_state_after_init(robot):
    body = Motion(robot).planned(0.2, 0.02)
    body.reset()
    fresh = PlannedBody(robot.parameters.servo)
    np.testing.assert_array_equal(body.q, fresh.q)
    np.testing.assert_array_equal(body.v, fresh.v)
    motion = Motion(robot)
    gait = SimpleNamespace(velocity=motion.velocity, yaw_rate=motion.rate)
    body.step(gait, motion.reference(0.5), motion.joints(0.5), 0.02)
    np.testing.assert_array_equal(body.v, 0.0)  # nothing to differentiate yet
