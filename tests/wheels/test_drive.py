import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.constraints import radius_matrix, rolling_matrix, sliding_matrix
from bluefoot_mpc.wheels.drive import DriveLimits, WheelDrive
from bluefoot_mpc.wheels.frames import moved
from bluefoot_mpc.wheels.ready import (
    READY,
    ackermann,
    castor,
    differential,
    forward_wheel,
    mecanum,
    omni_steer,
    tricycle,
)
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

SWERVE = WheeledRobot(
    name="swerve",
    wheels=tuple(forward_wheel("steered", x, y) for x in (0.1, -0.1) for y in (0.08, -0.08)),
    steering_limit=math.pi,
)
FIXED_AND_STEERED = WheeledRobot(
    name="rail",
    wheels=(
        forward_wheel("fixed", 0.1, 0.0),
        forward_wheel("fixed", -0.1, 0.0),
        forward_wheel("steered", 0.0, 0.1),
    ),
)
NARROW = WheeledRobot(name="narrow", wheels=SWERVE.wheels, steering_limit=math.pi / 2)
STIFF = WheeledRobot(name="stiff", wheels=SWERVE.wheels, steering_limit=0.3)
PUSHED = WheeledRobot(
    name="linked alone",
    wheels=(forward_wheel("steered", 0.1, 0.08), forward_wheel("steered", 0.1, -0.08), castor(-0.1, 0.0)),
    linked=((0, 1),),
)
ROBOTS = [READY[name]() for name in READY if name != "balancing"] + [SWERVE, NARROW, FIXED_AND_STEERED]
DT = 0.02


def settled(drive, wanted, steps=200):
    for _ in range(steps):
        state = drive.step(np.array(wanted, dtype=float), DT)
    return state


@pytest.mark.parametrize("robot", [*ROBOTS, STIFF, PUSHED], ids=lambda robot: robot.name)
def test_every_motion_fulfils_the_wheels_constraints_within_the_limits(robot):
    rng, limits = np.random.default_rng(5), DriveLimits()
    drive = WheelDrive(robot, limits)
    driven = np.array([wheel.driven for wheel in robot.wheels])
    leads = [i for i in robot.indices("steered") if i not in {j for g in robot.linked for j in g}]
    before = drive.state
    for _ in range(40):
        wanted = rng.normal(size=3) * [0.4, 0.4, 3.0]
        for _ in range(int(rng.integers(1, 25))):
            state = drive.step(wanted, DT)
            rolled = rolling_matrix(robot, state.steering) @ state.twist
            np.testing.assert_allclose(rolled, radius_matrix(robot) @ state.wheel_speed, atol=1e-12)
            np.testing.assert_allclose(sliding_matrix(robot, state.steering) @ state.twist, 0.0, atol=1e-12)
            assert np.abs(state.wheel_speed[driven]).max() <= limits.wheel_speed * (1 + 1e-12)
            assert np.abs(state.steering[leads]).max(initial=0) <= robot.steering_limit + 1e-8
            turned = np.abs(state.steering - before.steering)
            assert (
                turned[list(robot.indices("steered"))].max(initial=0) <= 2 * limits.steering_rate * DT + 1e-9
            )
            assert turned[leads].max(initial=0) <= limits.steering_rate * DT + 1e-9
            mean = 0.5 * (before.wheel_speed + state.wheel_speed)
            np.testing.assert_allclose(state.wheel_angle - before.wheel_angle, DT * mean, atol=1e-12)
            before = state


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_a_motion_that_the_robot_can_follow_is_reached_from_any_other(robot):
    rng, drive = np.random.default_rng(6), WheelDrive(robot)
    sideways = (
        0.1 if robot.name in {"omni", "mecanum", "omni_steer", "two_steer", "swerve", "narrow"} else 0.0
    )
    turning = 0.0 if robot is FIXED_AND_STEERED else 0.35
    for _ in range(6):
        signs = rng.choice([-1.0, 1.0], size=3)
        wanted = signs * [0.12, sideways, turning] * rng.uniform(0.4, 1.0)
        np.testing.assert_allclose(settled(drive, wanted).twist, wanted, atol=1e-8)


def test_motors_lag_with_their_time_constant():
    limits = DriveLimits(time_constant=0.1, wheel_acceleration=1e6)
    drive = WheelDrive(differential(), limits)
    for _ in range(10):
        state = drive.step(np.array([0.1, 0.0, 0.5]), 0.01)
    share = 1 - math.exp(-1)
    np.testing.assert_allclose(state.twist, share * np.array([0.1, 0.0, 0.5]), atol=1e-12)
    at_once = WheelDrive(differential(), DriveLimits(time_constant=0.0, wheel_acceleration=1e6))
    np.testing.assert_allclose(
        at_once.step(np.array([0.1, 0.0, 0.5]), 0.01).twist, [0.1, 0.0, 0.5], atol=1e-12
    )


@pytest.mark.parametrize(
    "robot", [differential(), mecanum(), omni_steer(), tricycle()], ids=lambda robot: robot.name
)
def test_too_fast_is_slowed_down_in_the_same_direction(robot):
    limits = DriveLimits(wheel_speed=4.0)
    wanted = np.array([3.0, 2.0 if robot.name == "mecanum" else 0.0, 9.0])
    state = settled(WheelDrive(robot, limits), wanted)
    driven = [abs(s) for s, w in zip(state.wheel_speed, robot.wheels, strict=True) if w.driven]
    assert max(driven) == pytest.approx(4.0)
    np.testing.assert_allclose(
        state.twist / np.linalg.norm(state.twist), wanted / np.linalg.norm(wanted), atol=1e-9
    )


def test_wheels_gain_speed_no_faster_than_their_motors_can():
    drive = WheelDrive(differential(), DriveLimits(time_constant=0.0, wheel_acceleration=10.0))
    state = drive.step(np.array([1.0, 0.0, 0.0]), DT)
    np.testing.assert_allclose(state.wheel_speed, 10.0 * DT, atol=1e-12)


def test_wheels_that_cannot_turn_far_enough_go_as_far_as_they_can():
    drive = WheelDrive(STIFF)
    np.testing.assert_allclose(settled(drive, [0.1, 0.0, 0.2]).twist, [0.1, 0.0, 0.2], atol=1e-8)
    state = settled(drive, [0.0, 0.0, 1.0])
    assert abs(state.twist[2]) > 0.05
    assert 0.29 < np.abs(state.steering).max() <= 0.3 + 1e-8
    np.testing.assert_allclose(settled(drive, [0.1, 0.0, -0.2]).twist, [0.1, 0.0, -0.2], atol=1e-8)


@pytest.mark.parametrize(
    "robot", [tricycle(), ackermann(), READY["two_steer"](), SWERVE], ids=lambda robot: robot.name
)
def test_back_along_the_same_way_needs_no_steering(robot):
    drive, wanted, steered = WheelDrive(robot), np.array([0.1, 0.0, 0.3]), list(robot.indices("steered"))
    ahead = settled(drive, wanted)
    back = drive.step(-wanted, DT)
    np.testing.assert_allclose(back.steering[steered], ahead.steering[steered], atol=1e-12)
    np.testing.assert_allclose(settled(drive, -wanted).twist, -wanted, atol=1e-8)


def test_steering_takes_its_time():
    drive = WheelDrive(tricycle(), DriveLimits(steering_rate=1.0))
    angles = [drive.step(np.array([0.1, 0.0, 0.625]), DT).steering[2] for _ in range(60)]
    np.testing.assert_allclose(np.diff(angles[:30]), DT, atol=1e-12)
    assert angles[-1] == pytest.approx(math.pi / 4)


def test_a_car_asked_to_turn_in_place_turns_as_tightly_as_it_can():
    robot = ackermann()
    state = settled(WheelDrive(robot), [0.0, 0.0, 1.0])
    tightest = 0.18 / math.tan(robot.steering_limit)
    assert abs(state.twist[0] / state.twist[2]) == pytest.approx(tightest)
    assert state.twist[2] > 0.0
    assert settled(WheelDrive(tricycle()), [0.0, 0.0, 1.0]).twist[2] == pytest.approx(1.0)


def test_what_the_wheels_forbid_is_left_out():
    np.testing.assert_allclose(
        settled(WheelDrive(differential()), [0.1, 0.3, 0.2]).twist, [0.1, 0.0, 0.2], atol=1e-9
    )


def test_wheels_keep_their_direction_when_nothing_is_wanted():
    drive = WheelDrive(tricycle())
    turned = settled(drive, [0.1, 0.0, 0.4]).steering
    np.testing.assert_array_equal(settled(drive, [0.0, 0.0, 0.0]).steering, turned)
    np.testing.assert_allclose(drive.state.twist, 0.0, atol=1e-9)


def test_castors_swing_until_they_trail():
    drive = WheelDrive(READY["two_steer"]())
    state = settled(drive, [0.0, 0.1, 0.0])
    np.testing.assert_allclose([math.sin(a) for a in state.steering[2:]], 1.0, atol=1e-6)
    state = settled(drive, [-0.1, 0.0, 0.0])
    np.testing.assert_allclose([math.cos(a) for a in state.steering[2:]], -1.0, atol=1e-6)


def test_an_ackermann_car_drives_a_circle_that_closes():
    drive, pose = WheelDrive(ackermann()), np.zeros(3)
    settled(drive, [0.1, 0.0, 0.25])
    for _ in range(round(2 * math.pi / 0.25 / DT)):
        pose = moved(pose, drive.step(np.array([0.1, 0.0, 0.25]), DT).twist, DT)
    np.testing.assert_allclose(pose[:2], 0.0, atol=2e-3)


def test_reset_gives_the_same_run_again():
    drive = WheelDrive(READY["two_steer"]())
    first = [settled(drive, w, 10).wheel_angle for w in ([0.1, 0, 0.5], [0, 0.1, 0])]
    drive.reset()
    again = [settled(drive, w, 10).wheel_angle for w in ([0.1, 0, 0.5], [0, 0.1, 0])]
    np.testing.assert_array_equal(first, again)


def test_robots_that_cannot_move_are_refused_with_the_way_out():
    crossed = Wheel(kind="fixed", alpha=math.pi / 2, beta=-math.pi / 2, length=0.1)
    wheels = (forward_wheel("fixed", 0.1, 0.1), forward_wheel("fixed", -0.1, 0.0), crossed)
    with pytest.raises(ConfigurationError, match=r"cannot move.*rank of C1 is 3.*one axle"):
        WheelDrive(WheeledRobot(name="stuck", wheels=wheels))
    with pytest.raises(ConfigurationError, match="no driven wheel"):
        WheelDrive(WheeledRobot(name="pushed", wheels=(forward_wheel("fixed", 0.0, 0.0, driven=False),)))


@pytest.mark.parametrize(
    ("wanted", "dt"),
    [(np.array([np.nan, 0, 0]), DT), (np.zeros(2), DT), (np.zeros(3), 0.0), (np.zeros(3), math.nan)],
)
def test_bad_steps_are_refused_and_change_nothing(wanted, dt):
    drive = WheelDrive(differential())
    before = settled(drive, [0.1, 0.0, 0.0], 5)
    with pytest.raises(ConfigurationError):
        drive.step(wanted, dt)
    assert drive.state is before


@pytest.mark.parametrize(
    "changes", [{"time_constant": -1.0}, {"wheel_speed": 0.0}, {"steering_rate": math.inf}]
)
def test_impossible_limits_are_refused(changes):
    with pytest.raises(ConfigurationError):
        DriveLimits(**changes)
