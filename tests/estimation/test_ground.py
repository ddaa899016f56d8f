import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.estimation import Estimator, EstimatorConfig, GroundConfig, GroundPlane
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy
from bluefoot_mpc.types import BodyState

from .synthetic_motion import PERFECT, Motion, geometry, make_run

FEET = np.array([[0.17, 0.16], [0.15, -0.16], [-0.16, 0.17], [-0.17, -0.15]])
ALL = (True,) * 4
DIAGONALS = ((True, False, False, True), (False, True, True, False))
DT = 0.02


def standing(slope, rpy, lifted=(), height=0.12) -> BodyState:
    """A body over a plane that rises by `slope` per metre of the world's x and y; lifted feet hang higher."""
    rotation = rotation_from_rpy(np.array(rpy))
    # Feet below the trunk in the heading frame, brought onto the plane, then into the base.
    c, s = math.cos(rpy[2]), math.sin(rpy[2])
    xy = FEET @ np.array([[c, s], [-s, c]])
    feet = np.column_stack([xy, xy @ np.array(slope) - height])
    feet[list(lifted), 2] += 0.02
    return BodyState(
        time=0.0, position=np.zeros(3), quaternion=quaternion_from_rpy(np.array(rpy)), rpy=np.array(rpy),
        linear_velocity=np.zeros(3), angular_velocity=np.zeros(3), joint_position=np.zeros(16),
        joint_velocity=np.zeros(16), contact=np.ones(4, dtype=bool), foot_position_in_base=feet @ rotation,
        height=height,
    )  # fmt: skip


def in_heading(slope, yaw):
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([c * slope[0] + s * slope[1], c * slope[1] - s * slope[0]])


@pytest.mark.parametrize("seed", range(5))
def test_four_feet_show_the_slope_whatever_the_attitude(seed):
    rng = np.random.default_rng(seed)
    slope, rpy = rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.3, 0.3, 3) * (1.0, 1.0, 10.0)
    plane = GroundPlane(GroundConfig())
    for _ in range(100):
        ground = plane.step(standing(slope, rpy), ALL, DT)
    assert ground.known
    np.testing.assert_allclose(ground.slope, in_heading(slope, rpy[2]), rtol=0.02)


def test_diagonals_in_turn_show_both_directions_and_a_lifted_foot_does_not_count():
    slope, plane = (0.1, -0.05), GroundPlane(GroundConfig())
    for k in range(200):
        stance = DIAGONALS[k // 10 % 2]
        lifted = [leg for leg in range(4) if not stance[leg]]
        ground = plane.step(standing(slope, (0.02, 0.03, 0.0), lifted), stance, DT)
    assert ground.known
    np.testing.assert_allclose(ground.slope, slope, rtol=0.02)


def test_one_line_of_feet_leaves_the_other_direction_unknown_and_level():
    plane = GroundPlane(GroundConfig())
    for _ in range(300):
        ground = plane.step(standing((0.1, 0.1), (0.0, 0.0, 0.0)), DIAGONALS[0], DT)
    assert not ground.known
    along = FEET[0] - FEET[3]
    # Along the line the fit sees the rise; nothing is claimed across it.
    assert ground.slope @ along == pytest.approx(0.1 * along.sum(), rel=0.02)
    assert abs(ground.slope @ np.array([-along[1], along[0]])) < 1e-3


def test_the_slope_turns_with_the_robot():
    plane, slope = GroundPlane(GroundConfig()), (0.1, 0.0)
    for _ in range(100):
        plane.step(standing(slope, (0.0, 0.0, 0.0)), ALL, DT)
    turned = plane.step(standing(slope, (0.0, 0.0, math.pi / 2)), (False,) * 4, DT)
    np.testing.assert_allclose(turned.slope, (0.0, -0.1), atol=2e-3)


def test_it_forgets_with_its_time_constant():
    plane = GroundPlane(GroundConfig(memory=0.5))
    for _ in range(500):
        plane.step(standing((0.1, 0.0), (0.0, 0.0, 0.0)), ALL, DT)
    for _ in range(25):
        ground = plane.step(standing((0.0, 0.0), (0.0, 0.0, 0.0)), ALL, DT)
    assert ground.slope[0] == pytest.approx(0.1 * math.exp(-1.0), rel=0.03)


def test_single_feet_and_a_lost_state_change_nothing():
    plane = GroundPlane(GroundConfig())
    for _ in range(50):
        before = plane.step(standing((0.1, 0.02), (0.0, 0.0, 0.0)), ALL, DT)
    after = plane.step(standing((0.0, 0.0), (0.0, 0.0, 0.0)), (True, False, False, False), DT)
    np.testing.assert_array_equal(after.slope, before.slope)
    lost = replace(standing((0.0, 0.0), (0.0, 0.0, 0.0)), quaternion=np.full(4, math.nan))
    np.testing.assert_array_equal(plane.step(lost, ALL, DT).slope, before.slope)
    np.testing.assert_array_equal(plane.step(standing((0.1, 0.02), (0.0,) * 3), ALL, DT).known, True)


def test_reset_is_the_state_after_init():
    fresh, used = GroundPlane(GroundConfig()), GroundPlane(GroundConfig())
    assert not fresh.latest.known
    used.step(standing((0.1, 0.1), (0.0, 0.0, 0.0)), ALL, DT)
    used.reset()
    np.testing.assert_array_equal(used.latest.slope, fresh.latest.slope)
    for _ in range(10):
        one, other = (plane.step(standing((0.1, 0.1), (0.1, 0.0, 0.2)), ALL, DT) for plane in (fresh, used))
        np.testing.assert_array_equal(one.slope, other.slope)


def test_a_trot_on_a_level_floor_shows_no_slope():
    run = make_run(Motion(duration=8.0), PERFECT, 0)
    estimator, slopes = Estimator(geometry(), EstimatorConfig()), []
    for frame in run.frames:
        estimator.step(frame)
        slopes.append(estimator.ground.slope)
    assert estimator.ground.known
    assert np.abs(slopes[100:]).max() < 0.004
    estimator.reset()
    assert not estimator.ground.known


def test_bad_settings_are_refused():
    with pytest.raises(ConfigurationError, match="memory"):
        GroundConfig(memory=0.0)
