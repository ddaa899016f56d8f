import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.wheels.constraints import rank_of, sliding_matrix
from bluefoot_mpc.wheels.kinematics import inverse
from bluefoot_mpc.wheels.mobility import (
    delta_M,
    delta_m,
    delta_s,
    holonomic,
    icr,
    icr_of,
    omnidirectional,
    workspace_dof,
    zero_motion_lines,
)
from bluefoot_mpc.wheels.ready import READY, ackermann, castor, forward_wheel, tricycle
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.wheel import Wheel

STUCK = WheeledRobot(
    name="stuck",
    wheels=(
        forward_wheel("fixed", 0.1, 0.1),
        forward_wheel("fixed", -0.1, 0.0),
        Wheel(kind="fixed", alpha=math.pi / 2, beta=-math.pi / 2, length=0.1),
    ),
)
FIXED_BICYCLE = WheeledRobot(
    name="fixed bicycle",
    wheels=tuple(Wheel(kind="fixed", alpha=a, beta=math.pi / 2, length=0.2) for a in (0.0, math.pi)),
)
ARC_BICYCLE = WheeledRobot(
    name="arc",
    wheels=(forward_wheel("fixed", -0.1, 0.0), Wheel(kind="fixed", alpha=0.0, beta=2.0, length=0.1)),
)
SWERVE = WheeledRobot(
    name="swerve", wheels=tuple(forward_wheel("steered", x, y) for x in (0.1, -0.1) for y in (0.1, -0.1))
)


@pytest.mark.parametrize(
    ("name", "manoeuvrability", "mobility", "steerability"),
    [
        ("omni", 3, 3, 0),
        ("differential", 2, 2, 0),
        ("omni_steer", 3, 2, 1),
        ("tricycle", 2, 1, 1),
        ("two_steer", 3, 1, 2),
    ],
)
def test_the_documents_table_of_five_robots(name, manoeuvrability, mobility, steerability):
    robot = READY[name]()
    for twist in ((0.1, 0.0, 0.0), (0.1, 0.0, 0.4), (0.05, 0.0, -0.9)):
        steering = inverse(robot, np.array(twist)).steering
        assert delta_M(robot, steering) == manoeuvrability
        assert delta_m(robot, steering) == mobility
        assert delta_s(robot, steering) == steerability


@pytest.mark.parametrize("turn", [0.0, 0.3, -0.8])
def test_the_documents_auto(turn):
    robot = ackermann()
    steering = inverse(robot, np.array([0.2, 0.0, turn])).steering
    assert len(robot.indices("fixed")) == len(robot.indices("steered")) == 2
    assert rank_of(sliding_matrix(robot, kinds=("fixed",)), robot.size) == 1
    assert rank_of(sliding_matrix(robot, steering), robot.size) == 2
    assert (delta_m(robot, steering), delta_s(robot, steering), delta_M(robot, steering)) == (1, 1, 2)


def test_linked_wheels_of_a_turned_car_would_count_as_two_were_they_not_linked():
    robot = ackermann()
    steering = inverse(robot, np.array([0.2, 0.0, 0.5])).steering
    unlinked = WheeledRobot(name="unlinked", wheels=robot.wheels)
    assert delta_s(unlinked, steering) == 2


def test_a_car_whose_front_wheels_stay_parallel_in_a_turn_cannot_move():
    assert delta_m(ackermann(), np.array([0.0, 0.0, 0.3, 0.3])) == 0
    assert icr(ackermann(), np.array([0.0, 0.0, 0.3, 0.3])).kind == "none"


def test_fixed_bicycle_and_differential_drive_have_the_documents_ranks():
    assert delta_m(FIXED_BICYCLE) == 1
    assert delta_s(FIXED_BICYCLE) == 0
    assert delta_m(READY["differential"]()) == 2


@pytest.mark.parametrize(
    ("robot", "dof", "is_holonomic", "is_omnidirectional"),
    [
        (READY["omni"](), 3, True, True),
        (READY["mecanum"](), 3, True, True),
        (READY["differential"](), 3, False, False),
        (READY["tricycle"](), 3, False, False),
        (READY["omni_steer"](), 3, False, False),
        (READY["two_steer"](), 3, False, False),
        (SWERVE, 3, False, False),
        (FIXED_BICYCLE, 1, True, False),
        (ARC_BICYCLE, 1, True, False),
        (STUCK, 0, True, False),
        (WheeledRobot(name="castors", wheels=(castor(0.1, 0.0), castor(-0.1, 0.0))), 3, True, True),
        (WheeledRobot(name="one wheel", wheels=(forward_wheel("fixed", 0.0, 0.0),)), 3, False, False),
    ],
    ids=lambda value: value.name if isinstance(value, WheeledRobot) else None,
)
def test_holonomy(robot, dof, is_holonomic, is_omnidirectional):
    assert workspace_dof(robot) == dof
    assert holonomic(robot) is is_holonomic
    assert omnidirectional(robot) is is_omnidirectional


@pytest.mark.parametrize("name", ["tricycle", "ackermann", "bicycle", "two_steer"])
@pytest.mark.parametrize("radius", [0.3, -0.8, 20.0])
def test_icr_of_a_steered_robot_is_where_it_turns_about(name, radius):
    robot = READY[name]()
    command = inverse(robot, np.array([0.1, 0.0, 0.1 / radius]))
    centre = icr(robot, command.steering)
    assert centre.kind == "point"
    np.testing.assert_allclose(centre.point, [0.0, radius], atol=1e-9)
    for point, direction in zero_motion_lines(robot, command.steering):
        away = centre.point - point
        assert direction[0] * away[1] - direction[1] * away[0] == pytest.approx(0.0, abs=1e-9)


def test_icr_lies_infinitely_far_across_the_motion_of_a_straight_car():
    centre = icr(ackermann())
    assert centre.kind == "infinity"
    np.testing.assert_allclose(np.abs(centre.direction), [0, 1], atol=1e-12)
    assert np.isnan(centre.point).all()


def test_icr_of_a_differential_drive_lies_anywhere_on_its_axle():
    centre = icr(READY["differential"]())
    assert centre.kind == "line"
    assert centre.point[0] == pytest.approx(0.0, abs=1e-12)
    np.testing.assert_allclose(np.abs(centre.direction), [0, 1], atol=1e-12)


def test_the_line_of_centres_need_not_pass_through_the_origin():
    robot = READY["omni_steer"]()
    centre = icr(robot, np.array([0.4, 0.0, 0.0]))
    point, direction = zero_motion_lines(robot, np.array([0.4, 0.0, 0.0]))[0]
    away = centre.point - point
    assert direction[0] * away[1] - direction[1] * away[0] == pytest.approx(0.0, abs=1e-12)
    assert abs(direction @ centre.direction) == pytest.approx(1.0)


def test_icr_is_anywhere_for_omni_robots_and_nowhere_for_stuck_ones():
    assert icr(READY["omni"]()).kind == "plane"
    assert icr(STUCK).kind == "none"
    assert delta_m(STUCK) == 0


def test_icr_of_a_motion():
    np.testing.assert_allclose(icr_of(np.array([0.2, 0.1, 0.5])).point, [-0.2, 0.4])
    straight = icr_of(np.array([0.2, 0.0, 0.0]))
    assert straight.kind == "infinity"
    np.testing.assert_allclose(straight.direction, [0.0, 1.0])
    assert icr_of(np.zeros(3)).kind == "none"
    with pytest.raises(ConfigurationError, match="finite"):
        icr_of(np.array([np.nan, 0.0, 0.0]))


def test_the_tricycles_lines_meet_in_the_centre_for_a_wheel_turned_to_the_right():
    robot = tricycle(wheelbase=0.2)
    centre = icr(robot, np.array([0.0, 0.0, -math.atan2(0.2, 0.5)]))
    np.testing.assert_allclose(centre.point, [0.0, -0.5], atol=1e-12)
