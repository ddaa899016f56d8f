import cmath
import math

import numpy as np
import pytest

from bluefoot_mpc.gait.swing import lift_profile, matched_step, smooth_step, spring_transition
from bluefoot_mpc.gait.virtual_robot import VirtualPose, carried, point_velocity


def test_smooth_step_has_rest_at_both_ends() -> None:
    h = 1e-5
    assert smooth_step(0.0) == 0.0
    assert smooth_step(1.0) == 1.0
    assert smooth_step(h) / h < 1e-8
    assert (1.0 - smooth_step(1.0 - h)) / h < 1e-8


@pytest.mark.parametrize("apex", [0.35, 0.5, 0.7])
def test_lift_profile(apex: float) -> None:
    assert lift_profile(apex, apex) == pytest.approx(1.0)
    assert lift_profile(0.0, apex) == 0.0
    assert lift_profile(1.0, apex) == 0.0
    assert lift_profile(1.0 - 1e-4, apex) / 1e-4 < 1e-5  # touches down without speed
    values = [lift_profile(s, apex) for s in np.linspace(0.0, 1.0, 201)]
    assert max(values) <= 1.0 + 1e-12


def test_matched_step_is_at_rest_on_the_ground() -> None:
    start, goal, velocity, time = -0.01 + 0.002j, 0.012 - 0.001j, 0.1 + 0.02j, 0.2
    h = 1e-5
    for s, place in ((0.0, start), (1.0 - h, goal)):
        here = matched_step(start, goal, velocity * time, s)
        there = matched_step(start, goal, velocity * time, s + h)
        assert abs((there - here) / (h * time) + velocity) < 1e-6
        assert abs(here - place) < 1e-5


@pytest.mark.parametrize("ratio", [1.0, 1.05, 2.0])
def test_spring_transition_solves_its_equation(ratio: float) -> None:
    rate, dt = 30.0, 0.01
    fine = np.eye(2)
    generator = np.array([[0.0, 1.0], [-rate * rate, -2.0 * ratio * rate]])
    term = np.eye(2)
    for k in range(1, 30):
        term = term @ generator * (dt / k)
        fine = fine + term
    np.testing.assert_allclose(np.reshape(spring_transition(rate, ratio, dt), (2, 2)), fine, atol=1e-9)


def test_virtual_robot_drives_an_exact_circle() -> None:
    pose = VirtualPose()
    speed, rate = 0.1, 0.4
    radius = speed / rate
    dt = 2.0 * math.pi / rate / 50.0
    for k in range(1, 51):
        pose = pose.moved(complex(speed), rate, dt)
        expected = 1j * radius + cmath.rect(radius, rate * dt * k - math.pi / 2.0)
        assert abs(pose.centre - expected) < 1e-12
    assert abs(pose.centre) < 1e-12
    assert pose.yaw == pytest.approx(2.0 * math.pi)


def test_step_size_does_not_matter() -> None:
    for rate in (0.0, 1e-7, 1e-3, 0.8):
        one = VirtualPose().moved(0.1 + 0.03j, rate, 1.0)
        many = VirtualPose()
        for _ in range(100):
            many = many.moved(0.1 + 0.03j, rate, 0.01)
        assert abs(one.centre - many.centre) < 1e-9
        assert one.yaw == pytest.approx(many.yaw)


def test_frames_are_inverse_and_the_heading_turns_the_command() -> None:
    pose = VirtualPose(centre=1.0 + 2.0j, yaw=math.pi / 2.0)
    assert abs(pose.to_local(pose.to_world(0.3 - 0.1j)) - (0.3 - 0.1j)) < 1e-15
    moved = pose.moved(0.1 + 0j, 0.0, 1.0)
    assert abs(moved.centre - (1.0 + 2.1j)) < 1e-15


def test_carried_point_is_where_the_frame_takes_it() -> None:
    point, velocity, rate = 0.165 + 0.165j, 0.1 - 0.05j, 0.5
    assert (
        abs(carried(point, velocity, rate, 0.7) - VirtualPose().moved(velocity, rate, 0.7).to_world(point))
        < 1e-15
    )
    h = 1e-6
    slope = (carried(point, velocity, rate, h) - point) / h
    assert abs(slope - point_velocity(point, velocity, rate)) < 1e-6
