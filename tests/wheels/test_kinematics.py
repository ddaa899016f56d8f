import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.constraints import free_twists, rolling_matrix, sliding_matrix
from bluefoot_mpc.wheels.formulas import (
    MECANUM_DIRECTIONS,
    ackermann_angles,
    differential_twist,
    mecanum_forward,
    mecanum_inverse,
    radians_per_second,
)
from bluefoot_mpc.wheels.frames import twist_in_world
from bluefoot_mpc.wheels.kinematics import forward, inverse
from bluefoot_mpc.wheels.ready import (
    READY,
    ackermann,
    castor,
    differential,
    forward_wheel,
    mecanum,
    omni,
    tricycle,
)
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

SIDEWAYS = np.array([0.0, 0.1, 0.0])


def permitted(robot, rng):
    """A random twist that the robot can follow with some steering."""
    free = free_twists(sliding_matrix(robot, kinds=("fixed",)), robot.size)
    return free @ rng.normal(size=free.shape[1])


@pytest.mark.parametrize("name", READY)
def test_forward_of_inverse_is_the_identity(name):
    robot, rng = READY[name](), np.random.default_rng(7)
    for _ in range(200):
        twist = permitted(robot, rng)
        command = inverse(robot, twist)
        motion = forward(robot, command.speeds, command.steering)
        assert command.consistent
        assert motion.consistent
        assert motion.determined
        np.testing.assert_allclose(motion.twist, twist, rtol=0, atol=1e-12 * max(1.0, np.abs(twist).max()))


@pytest.mark.parametrize("name", ["differential", "omni", "mecanum", "balancing"])
def test_inverse_of_forward_is_the_identity_for_wheels_that_agree(name):
    robot, rng = READY[name](), np.random.default_rng(8)
    for _ in range(50):
        speeds = inverse(robot, permitted(robot, rng)).speeds
        again = inverse(robot, forward(robot, speeds).twist).speeds
        np.testing.assert_allclose(again, speeds, rtol=0, atol=1e-11)


def test_random_wheels_random_places():
    rng = np.random.default_rng(9)
    for _ in range(100):
        wheels = [
            Wheel(
                kind="swedish", alpha=rng.uniform(-3, 3), beta=rng.uniform(-3, 3), gamma=rng.uniform(-1, 1),
                length=rng.uniform(0.05, 0.5), radius=rng.uniform(0.02, 0.1),
            )
            for _ in range(rng.integers(4, 7))
        ]  # fmt: skip
        robot = WheeledRobot(name="random", wheels=(*wheels, castor(0.1, 0.2)))
        twist, steering = rng.normal(size=3), np.append(np.zeros(len(wheels)), rng.uniform(-3, 3))
        command = inverse(robot, twist, steering)
        condition = np.linalg.cond(rolling_matrix(robot, steering))
        np.testing.assert_allclose(
            forward(robot, command.speeds, steering).twist, twist, rtol=0, atol=1e-13 * condition
        )


def test_differential_drive_in_the_world_as_in_the_document():
    length, radius, theta = 0.3, 0.05, 0.9
    left, right = 4.0, -1.5
    motion = forward(differential(length, radius), np.array([left, right]))
    expected = [
        radius / 2 * (right + left) * math.cos(theta),
        radius / 2 * (right + left) * math.sin(theta),
        radius / (2 * length) * (right - left),
    ]
    np.testing.assert_allclose(twist_in_world(motion.twist, theta), expected, atol=1e-15)
    np.testing.assert_allclose(differential_twist(radius, length, (left, right), theta), expected, atol=1e-15)


def test_omni_is_the_inverse_of_the_documents_matrix():
    length, radius = 0.2, 0.04
    a = math.sqrt(3) / 2
    matrix = np.array([[a, -0.5, -length], [0, 1, -length], [-a, -0.5, -length]])
    speeds = np.array([3.0, -1.0, 2.0])
    expected = np.linalg.solve(matrix, radius * speeds)
    np.testing.assert_allclose(forward(omni(length, radius), speeds).twist, expected, atol=1e-15)


def test_mecanum_forward_and_inverse_as_in_the_document():
    """The document's wheel speeds are in turns per second, hence its factor of 2 pi r."""
    l1, l2, radius = 0.3, 0.5, 0.07
    robot = mecanum(track=l1, wheelbase=l2, radius=radius)
    turns = np.array([0.4, -1.0, 2.0, 0.7])
    k = 1 / (2 * (l1 + l2))
    printed = np.array([[0.25, 0.25, 0.25, 0.25], [-0.25, 0.25, 0.25, -0.25], [-k, k, -k, k]])
    expected = 2 * math.pi * radius * printed @ turns
    np.testing.assert_allclose(forward(robot, radians_per_second(1.0) * turns).twist, expected, atol=1e-14)
    np.testing.assert_allclose(mecanum_forward(radius, l1, l2) * 2 * math.pi, 2 * math.pi * radius * printed)
    s = (l1 + l2) / 2
    back = np.array([[1, -1, -s], [1, 1, s], [1, 1, -s], [1, -1, s]]) / (2 * math.pi * radius)
    twist = np.array([0.2, -0.3, 0.8])
    np.testing.assert_allclose(inverse(robot, twist).speeds / (2 * math.pi), back @ twist, atol=1e-14)
    np.testing.assert_allclose(mecanum_inverse(radius, l1, l2) / (2 * math.pi), back)
    np.testing.assert_allclose(printed @ (back * 2 * math.pi * radius), np.eye(3), atol=1e-15)


@pytest.mark.parametrize(
    ("motion", "twist"),
    [
        ("forward", (1, 0, 0)), ("backward", (-1, 0, 0)), ("left", (0, 1, 0)), ("right", (0, -1, 0)),
        ("clockwise", (0, 0, -1)), ("counter-clockwise", (0, 0, 1)),
    ],
)  # fmt: skip
def test_mecanum_directions_as_in_the_documents_table(motion, twist):
    speeds = inverse(mecanum(), np.array(twist, dtype=float)).speeds
    assert tuple(np.sign(speeds).astype(int)) == MECANUM_DIRECTIONS[motion]


def test_mecanum_rollers_stand_still_straight_ahead_and_spin_sideways():
    ahead = inverse(mecanum(), np.array([0.2, 0.0, 0.0]))
    np.testing.assert_allclose(ahead.roller_speeds, 0.0, atol=1e-12)
    aside = inverse(mecanum(), np.array([0.0, 0.2, 0.0]))
    assert np.all(np.abs(aside.roller_speeds) > 1.0)


def test_ackermann_in_the_documents_notation():
    """Yaw rate 2 pi r n sin(alpha) / L2 with n turns per second of the front wheel."""
    radius, wheelbase, turns, angle = 0.03, 0.16, 0.8, 0.35
    robot = tricycle(wheelbase=wheelbase, radius=radius)
    steering = np.array([0.0, 0.0, angle])
    speed = 2 * math.pi * radius * turns
    twist = forward(robot, np.array([0, 0, 2 * math.pi * turns]), steering, known=[2]).twist
    expected = [speed * math.cos(angle), 0.0, speed * math.sin(angle) / wheelbase]
    np.testing.assert_allclose(twist, expected, atol=1e-15)
    assert twist[2] == pytest.approx(twist[0] * math.tan(angle) / wheelbase)


def test_a_cars_front_wheels_take_the_two_ackermann_angles():
    robot = ackermann(wheelbase=0.2, track=0.12)
    radius = 0.5
    command = inverse(robot, np.array([0.1, 0.0, 0.1 / radius]))
    left, right = math.atan2(0.2, radius - 0.06), math.atan2(0.2, radius + 0.06)
    np.testing.assert_allclose(command.steering, [0, 0, left, right], atol=1e-15)
    np.testing.assert_allclose(
        ackermann_angles(0.2, 0.12, math.atan2(0.2, radius)), (left, right), atol=1e-15
    )
    # Wheel paths of different lengths: each wheel turns in proportion to its own radius.
    radii = [radius - 0.06, radius + 0.06, math.hypot(0.2, radius - 0.06), math.hypot(0.2, radius + 0.06)]
    np.testing.assert_allclose(command.speeds * 0.03, np.array(radii) * 0.1 / radius, atol=1e-15)


def test_without_a_difference_of_speeds_the_rear_wheels_of_a_turning_car_skid():
    command = inverse(ackermann(), np.array([0.1, 0.0, 0.3]))
    single_axle = command.speeds.copy()
    single_axle[:2] = single_axle[:2].mean()
    motion = forward(ackermann(), single_axle, command.steering)
    assert not motion.consistent
    assert motion.residual > 1e-3


def test_wheel_speeds_that_contradict_each_other_give_the_nearest_motion_and_say_so():
    robot = mecanum()
    rng = np.random.default_rng(3)
    speeds = rng.normal(size=4)
    motion = forward(robot, speeds)
    assert not motion.consistent
    rows, right = rolling_matrix(robot), np.array([w.drive_radius for w in robot.wheels]) * speeds
    assert motion.residual == pytest.approx(np.linalg.norm(rows @ motion.twist - right))
    for change in 1e-4 * rng.normal(size=(20, 3)):
        assert np.linalg.norm(rows @ (motion.twist + change) - right) > motion.residual


@pytest.mark.parametrize("name", ["differential", "tricycle", "ackermann", "bicycle", "balancing"])
def test_a_motion_that_the_wheels_forbid_is_inconsistent(name):
    command = inverse(READY[name](), SIDEWAYS)
    assert not command.consistent
    assert command.residual > 0.05


def test_too_few_known_wheels_leave_a_motion_open():
    motion = forward(mecanum(), np.ones(4), known=[0, 1])
    assert motion.rank == 2
    assert not motion.determined
    np.testing.assert_allclose(rolling_matrix(mecanum())[:2] @ motion.free, 0.0, atol=1e-12)


def test_wheels_that_cannot_move_give_zero_for_zero_and_a_contradiction_for_more():
    wheels = tuple(forward_wheel("fixed", x, y) for x, y in ((0.1, 0.1), (-0.1, 0.0)))
    crossed = (*wheels, Wheel(kind="fixed", alpha=math.pi / 2, beta=-math.pi / 2, length=0.1))
    robot = WheeledRobot(name="stuck", wheels=crossed)
    still = forward(robot, np.zeros(3))
    np.testing.assert_array_equal(still.twist, 0.0)
    assert still.consistent
    assert not forward(robot, np.ones(3)).consistent
    assert not inverse(robot, np.array([0.1, 0.0, 0.0])).consistent


def test_castor_rates_come_with_given_angles_and_are_zero_when_it_trails():
    robot = READY["two_steer"]()
    twist = np.array([0.1, 0.0, 0.3])
    trailing = inverse(robot, twist)
    np.testing.assert_allclose(trailing.castor_rates, 0.0, atol=1e-12)
    steering = trailing.steering + np.array([0.0, 0.0, 0.3, -0.3])
    rates = inverse(robot, twist, steering).castor_rates
    assert rates[2] < -0.1  # back towards where it trails
    assert rates[3] > 0.1
    assert rates[0] == rates[1] == 0.0


@pytest.mark.parametrize(
    "bad", [np.array([1.0, np.nan]), np.array([np.inf, 0.0]), np.zeros(3), np.zeros((2, 1))]
)
def test_wheel_speeds_that_are_no_two_numbers_are_refused(bad):
    with pytest.raises(ConfigurationError, match=r"wheel speeds of robot 'differential'.*rad/s"):
        forward(differential(), bad)


def test_other_bad_input_is_refused():
    with pytest.raises(ConfigurationError, match="twist"):
        inverse(differential(), np.array([0.1, np.nan, 0.0]))
    with pytest.raises(ConfigurationError, match=r"known = \[2\]"):
        forward(differential(), np.zeros(2), known=[2])
