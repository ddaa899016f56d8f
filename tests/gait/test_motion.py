from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.gait.swing import lift_motion, lift_profile, smooth_bend, smooth_slope, smooth_step
from tests.gait.walker import DT, FOOTHOLD, STANCE, TROT_TIMING, command, drive, make

SMOOTH = replace(FOOTHOLD, law="minimum_jerk", vertical="quintic")
FIXED = replace(TROT_TIMING, cycle_min=0.4, cycle_max=0.4)
FIELDS = ("position", "velocity", "acceleration")


def in_world(motion) -> np.ndarray:
    x, y, yaw = motion.virtual_pose
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    return motion.position @ turn.T + (x, y, 0.0)


def rotated(motion, values: np.ndarray) -> np.ndarray:
    yaw = motion.virtual_pose[2]
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    return values @ turn.T


def test_derivatives_of_the_profiles() -> None:
    h = 1e-6
    for s in (0.1, 0.45, 0.55, 0.9):
        assert (smooth_step(s + h) - smooth_step(s - h)) / (2 * h) == pytest.approx(smooth_slope(s), abs=1e-6)
        assert (smooth_slope(s + h) - smooth_slope(s - h)) / (2 * h) == pytest.approx(
            smooth_bend(s), abs=1e-6
        )
        for apex in (0.4, 0.6):
            here, low, high = (lift_motion(s + step, apex) for step in (0.0, -h, h))
            assert here[0] == lift_profile(s, apex)
            assert (high[0] - low[0]) / (2 * h) == pytest.approx(here[1], abs=1e-6)
            assert (high[1] - low[1]) / (2 * h) == pytest.approx(here[2], abs=1e-5)
    assert lift_motion(1.0, 0.5) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("foothold", [FOOTHOLD, SMOOTH, replace(SMOOTH, ground_matching=-0.5)])
def test_without_lead_it_is_the_output(foothold) -> None:
    walker = make(foothold=foothold)
    for _ in range(150):
        output = walker.step(command(0.08, 0.3), DT)
        motion = walker.feet_ahead()
        np.testing.assert_array_equal(motion.swing, output.phase.swing)
        np.testing.assert_allclose(motion.position, output.foot_position, atol=1e-12)
        assert not motion.velocity[~motion.swing].any()
        assert not motion.acceleration[~motion.swing].any()


@pytest.mark.parametrize(("foothold", "close"), [(FOOTHOLD, 2.5e-3), (SMOOTH, 1e-3)])
@pytest.mark.parametrize("lead", [0.02, 0.04])
def test_with_a_lead_it_is_a_later_output(foothold, close: float, lead: float) -> None:
    walker = make(FIXED, foothold)
    inputs = command(0.1, 0.3)
    drive(walker, inputs, 4.0)
    motions, outputs = [], []
    for _ in range(60):
        outputs.append(walker.step(inputs, DT))
        motions.append(walker.feet_ahead(lead))
    ticks = round(lead / DT)
    for before, motion, output in zip(outputs[:-ticks], motions[:-ticks], outputs[ticks:], strict=True):
        same = motion.swing == output.phase.swing
        assert same.sum() >= 2  # at an edge, within a substep
        if foothold.law == "virtual_force":
            # The damped point mass starts at the beginning of the substep in which it lifts, and starts fast.
            same &= before.phase.swing | ~output.phase.swing
        np.testing.assert_allclose(motion.position[same], output.foot_position[same], atol=close)
        np.testing.assert_allclose(motion.virtual_pose, output.virtual_pose, atol=1e-9)


@pytest.mark.parametrize("foothold", [FOOTHOLD, SMOOTH, replace(SMOOTH, ground_matching=-0.5)])
@pytest.mark.parametrize("given", [False, True])
def test_velocity_and_acceleration_are_over_the_ground(foothold, given: bool) -> None:
    walker = make(FIXED, foothold)
    inputs = command(0.1, 0.4, left=0.03)
    drive(walker, inputs, 4.0)
    h, seen = 1e-4, 0
    for _ in range(40):
        walker.step(inputs, DT)
        if given:
            walker.set_footholds(STANCE + 0.01, [foot.turning is False for foot in walker.state.feet])
        low, here, high = (walker.feet_ahead(0.004 + step) for step in (-h, 0.0, h))
        steady = (low.swing == high.swing) & here.swing
        rate = (in_world(high) - in_world(low)) / (2.0 * h)
        change = (rotated(high, high.velocity) - rotated(low, low.velocity)) / (2.0 * h)
        seen += int(steady.sum())
        np.testing.assert_allclose(rotated(here, here.velocity)[steady, :2], rate[steady, :2], atol=5e-4)
        np.testing.assert_allclose(
            rotated(here, here.acceleration)[steady, :2], change[steady, :2], atol=0.05
        )
        if foothold.vertical == "quintic":
            np.testing.assert_allclose(here.velocity[steady, 2], rate[steady, 2], atol=1e-4)
            np.testing.assert_allclose(here.acceleration[steady, 2], change[steady, 2], atol=0.1)
        else:  # the arch is a table: its derivatives are differences
            np.testing.assert_allclose(here.velocity[steady, 2], rate[steady, 2], atol=0.04)
    assert seen > 20


def test_it_leaves_the_gait_alone_and_stands_at_rest() -> None:
    walker, other = make(foothold=SMOOTH), make(foothold=SMOOTH)
    motion = walker.feet_ahead(0.03)
    np.testing.assert_array_equal(motion.position, STANCE)
    assert not motion.swing.any()
    for _ in range(100):
        one, two = walker.step(command(0.08), DT), other.step(command(0.08), DT)
        walker.feet_ahead(0.03)
        np.testing.assert_array_equal(one.foot_position, two.foot_position)
