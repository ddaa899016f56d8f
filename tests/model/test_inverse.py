import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.legs import (
    LegGeometry,
    feet_in_base,
    inverse,
    inverse_in_leg,
    limit_violations,
    to_leg_frame,
)
from bluefoot_mpc.model.parameters import load_parameters
from tests.model.leg_samples import outward, random_joints, uneven_geometry

BLUEFOOT = LegGeometry.from_parameters(load_parameters())
STANCE_FEET = load_parameters().stance.foot_position - np.array([0.0, 0.0, 0.115])
UNEVEN = uneven_geometry()


def directions(joints):
    return joints.reshape(4, 4)[:, 1:].sum(axis=1)


def angle_difference(a, b):
    return (a - b + np.pi) % (2.0 * np.pi) - np.pi


def foot_distance(geometry, result, targets):
    return np.linalg.norm(feet_in_base(geometry, result.joints) - targets, axis=1)


@pytest.mark.parametrize("geometry", [BLUEFOOT, UNEVEN], ids=["bluefoot", "uneven"])
def test_inverse_gives_the_joints_back_on_their_own_branch(geometry):
    rng = np.random.default_rng(1)
    seen = 0
    for joints in random_joints(geometry, rng, 400):
        for sign in (-1.0, 1.0):
            joints[2::4] = sign * np.abs(joints[2::4])
            if not outward(geometry, joints):
                continue
            seen += 1
            targets = feet_in_base(geometry, joints)
            result = inverse(geometry, targets, directions(joints), knee_up=sign < 0.0)
            assert result.reachable.all()
            # Near the stretched knee the angles are ill-conditioned, the feet are not.
            np.testing.assert_allclose(feet_in_base(geometry, result.joints), targets, atol=1e-12)
            bent = np.repeat(np.abs(joints[2::4]) > 0.01, 4)
            np.testing.assert_allclose(angle_difference(result.joints, joints)[bent], 0.0, atol=1e-9)
    assert seen > 200


coordinate = st.floats(-0.6, 0.6, allow_nan=False)


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    target=st.tuples(coordinate, coordinate, coordinate),
    ankle=st.floats(-np.pi, np.pi),
    knee_up=st.booleans(),
    uneven=st.booleans(),
)
def test_any_target_gives_finite_angles_and_an_honest_distance(target, ankle, knee_up, uneven):
    geometry = UNEVEN if uneven else BLUEFOOT
    targets = np.tile(target, (4, 1))
    result = inverse(geometry, targets, ankle, knee_up)
    assert np.isfinite(result.joints).all()
    assert (np.abs(result.joints) <= np.pi + 1e-12).all()
    np.testing.assert_allclose(foot_distance(geometry, result, targets), result.missing, atol=1e-9)
    np.testing.assert_array_equal(result.reachable, result.missing <= 1e-9)
    np.testing.assert_allclose(angle_difference(directions(result.joints), ankle), 0.0, atol=1e-9)
    assert (result.joints[2::4] <= 0.0).all() if knee_up else (result.joints[2::4] >= 0.0).all()


def test_unreachable_target_gets_the_nearest_point_of_this_ankle_direction():
    rng = np.random.default_rng(2)
    target = np.array([0.35, 0.30, -0.05])
    ankle = np.radians(-99.0)
    result = inverse(BLUEFOOT, target[None], ankle, legs=(0,))
    assert not result.reachable[0]
    sampled = rng.uniform(-np.pi, np.pi, size=(20000, 3))
    joints = np.column_stack([sampled, ankle - sampled[:, 1] - sampled[:, 2]])
    distances = np.linalg.norm(feet_in_base(BLUEFOOT, joints, (0,))[:, 0] - target, axis=1)
    assert result.missing[0] <= distances.min()
    assert distances.min() < result.missing[0] + 0.01  # the sampling gets close, so the bound is tight


def test_unreachable_target_names_the_leg_and_the_missing_distance():
    targets = STANCE_FEET.copy()
    targets[2] = [-0.5, 0.5, -0.115]
    result = inverse(BLUEFOOT, targets, np.radians(-99.0))
    np.testing.assert_array_equal(result.reachable, [True, True, False, True])
    # By hand: reach 0.5*sqrt(2) - hip - a1 + a4*cos(81°), depth 0.115 - a4*sin(81°), less two links.
    reach = 0.5 * np.sqrt(2.0) - 0.09215 - 0.065 - 0.065 * np.cos(np.radians(-99.0))
    depth = 0.115 + 0.065 * np.sin(np.radians(-99.0))
    assert result.missing[2] == pytest.approx(np.hypot(reach, depth) - 0.13, abs=1e-12)
    assert not result.feasible
    assert result.describe()[0] == f"RL foot target is {1e3 * result.missing[2]:.1f} mm out of reach"


def test_default_stance_with_the_documented_ankle_direction_is_feasible():
    result = inverse(BLUEFOOT, STANCE_FEET, np.radians(-99.0))
    assert result.feasible
    assert result.describe() == ()
    np.testing.assert_allclose(result.joints[::4], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.degrees(result.joints[2::4]), -79.16, atol=0.01)


def test_vertical_last_link_breaks_the_knee_limit_in_the_default_stance():
    result = inverse(BLUEFOOT, STANCE_FEET, np.radians(-90.0))
    assert result.reachable.all()
    assert [v.leg for v in result.violations] == ["FL", "FR", "RL", "RR"]
    for violation in result.violations:
        assert violation.joint == "knee"
        assert np.degrees(violation.angle) == pytest.approx(-91.0, abs=0.05)
        assert np.degrees(violation.limit) == pytest.approx(-90.0)
        assert violation.excess == pytest.approx(violation.limit - violation.angle)
        assert result.joints[violation.index] == violation.angle
    text = result.violations[0].describe()
    assert text == "FL knee at -91.0° passes its limit of -90.0° by 1.0°"
    np.testing.assert_allclose(np.degrees(result.clamped[2::4]), -90.0)
    assert limit_violations(BLUEFOOT, result.joints) == result.violations
    assert limit_violations(BLUEFOOT, result.clamped) == ()


def test_violations_are_those_that_a_plain_comparison_finds():
    rng = np.random.default_rng(3)
    for _ in range(200):
        joints = rng.uniform(-2.0, 2.0, 16)
        outside = np.flatnonzero((joints < BLUEFOOT.lower) | (joints > BLUEFOOT.upper))
        found = limit_violations(BLUEFOOT, joints)
        assert [v.index for v in found] == list(outside)
        assert all(v.excess > 0.0 for v in found)


def test_one_leg_answers_as_it_does_among_four():
    targets = STANCE_FEET + np.array([0.0, 0.0, -0.3])  # out of reach and limits
    whole = inverse(BLUEFOOT, targets, np.radians(-90.0))
    one = inverse(BLUEFOOT, targets[[2]], np.radians([-90.0]), legs=(2,))
    np.testing.assert_array_equal(one.joints, whole.joints[8:12])
    assert one.violations == tuple(v for v in whole.violations if v.leg == "RL")
    np.testing.assert_array_equal(one.clamped, whole.clamped[8:12])
    assert one.describe()[0].startswith("RL foot target")


@pytest.mark.parametrize("knee_up", [True, False])
def test_stacked_inverse_gives_the_numbers_of_the_single_one(knee_up):
    rng = np.random.default_rng(4)
    targets = rng.uniform(-0.35, 0.35, size=(50, 4, 3))
    ankle = rng.uniform(-np.pi, np.pi, size=(50, 4))
    angles, missing = inverse_in_leg(UNEVEN, to_leg_frame(UNEVEN, targets), ankle, knee_up)
    for k in range(50):
        single = inverse(UNEVEN, targets[k], ankle[k], knee_up)
        np.testing.assert_allclose(angle_difference(angles[k].ravel(), single.joints), 0.0, atol=1e-9)
        np.testing.assert_allclose(missing[k], single.missing, atol=1e-12)


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_target_that_is_not_finite_is_refused_by_name(value):
    targets = STANCE_FEET.copy()
    targets[1, 2] = value
    with pytest.raises(ConfigurationError, match="foot target of FR is not finite"):
        inverse(BLUEFOOT, targets, np.radians(-99.0))
    with pytest.raises(ConfigurationError, match="foot target of FL is not finite"):
        inverse(BLUEFOOT, STANCE_FEET, value)
