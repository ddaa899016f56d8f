import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import (
    AnkleConfig,
    AnkleTable,
    LegGeometry,
    ankle_directions,
    feet_in_base,
    inverse,
    inverse_in_leg,
    joint_positions_in_base,
    limit_margin,
    to_leg_frame,
    widest_directions,
    widest_margin,
)
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.settings import build
from tests.model.leg_samples import uneven_geometry

BLUEFOOT = LegGeometry.from_parameters(load_parameters())
STANCE_FEET = load_parameters().stance.foot_position - np.array([0.0, 0.0, 0.115])
ALL = np.linspace(-np.pi, np.pi, 3601)


def random_feet(rng, spread):
    return STANCE_FEET + rng.uniform(-spread, spread, size=(4, 3))


@pytest.mark.parametrize("policy", ["fixed", "ground", "margin"])
def test_every_policy_leaves_the_feet_where_they_are_wanted(policy):
    rng = np.random.default_rng(1)
    config = AnkleConfig(policy=policy)
    for _ in range(50):
        feet = random_feet(rng, 0.012)
        up = rotation_from_rpy(rng.uniform(-0.1, 0.1, 3))[2]
        result = inverse(BLUEFOOT, feet, ankle_directions(BLUEFOOT, config, feet, up))
        assert result.reachable.all()
        np.testing.assert_allclose(feet_in_base(BLUEFOOT, result.joints), feet, atol=1e-12)


def test_fixed_policy_ignores_the_trunk():
    up = rotation_from_rpy(np.array([0.3, -0.2, 1.0]))[2]
    directions = ankle_directions(
        BLUEFOOT, AnkleConfig(policy="fixed", direction_deg=-105.0), STANCE_FEET, up
    )
    np.testing.assert_allclose(np.degrees(directions), -105.0)


def test_ground_policy_keeps_the_last_links_angle_to_the_ground():
    rng = np.random.default_rng(2)
    config = AnkleConfig(policy="ground", direction_deg=-99.0)
    feet_in_world = load_parameters().stance.foot_position
    for _ in range(20):
        rpy = rng.uniform(-0.2, 0.2, 3)
        rotation = rotation_from_rpy(rpy)
        feet = (feet_in_world - [0.0, 0.0, 0.115]) @ rotation
        joints = inverse(BLUEFOOT, feet, ankle_directions(BLUEFOOT, config, feet, rotation[2])).joints
        points = joint_positions_in_base(BLUEFOOT, joints)
        for leg in range(4):
            # The leg's plane (hip, foot, base z) keeps the ground's normal and the last link
            # at the angle that they have under a level trunk, 90° + 99° apart the long way.
            outward = points[leg, -1] - points[leg, 0]
            outward[2] = 0.0
            outward /= np.linalg.norm(outward)
            link = points[leg, 4] - points[leg, 3]
            up = rotation[2]
            link_angle = np.arctan2(link[2], link @ outward)
            up_angle = np.arctan2(up[2], up @ outward)
            turned = (up_angle - link_angle) % (2.0 * np.pi)
            assert np.degrees(turned) == pytest.approx(189.0, abs=1e-9)


def test_ground_policy_turns_the_front_and_rear_links_against_a_pitch():
    config = AnkleConfig(policy="ground")
    feet = np.array(
        [[0.2, 0.0651599, -0.1], [0.2, -0.0651599, -0.1], [-0.2, 0.0651599, -0.1], [-0.2, -0.0651599, -0.1]]
    )
    up = rotation_from_rpy(np.array([0.0, 0.1, 0.0]))[2]  # nose down; legs along x
    directions = ankle_directions(BLUEFOOT, config, feet, up) - np.radians(-99.0)
    np.testing.assert_allclose(directions, [0.1, 0.1, -0.1, -0.1], atol=1e-6)


@pytest.mark.parametrize("knee_up", [True, False])
@pytest.mark.parametrize("geometry", [BLUEFOOT, uneven_geometry()], ids=["bluefoot", "uneven"])
def test_no_direction_has_a_wider_margin_than_the_margin_policy(geometry, knee_up):
    rng = np.random.default_rng(3)
    height = -0.115 * sum(geometry.links) / 0.26
    for _ in range(15):
        feet = geometry.hip_position + 0.14 * np.column_stack(
            [np.cos(geometry.hip_azimuth), np.sin(geometry.hip_azimuth), np.full(4, height / 0.14)]
        )
        feet = feet + rng.uniform(-0.04, 0.04, size=(4, 3))
        in_leg = to_leg_frame(geometry, feet)
        found = widest_margin(geometry, in_leg, knee_up=knee_up)
        everywhere = limit_margin(geometry, in_leg, ALL[:, None], knee_up=knee_up).max(axis=0)
        assert np.isfinite(everywhere).all()
        # Knee-down, nearly equal hills stand at both stretched ends: the scan may take the lower.
        assert (found >= everywhere - np.radians(0.1 if knee_up else 2.5)).all()


def test_margin_policy_reaches_what_a_fixed_direction_cannot():
    """The trunk 8 cm aside: out of the question at -99°, inside the limits with free directions."""
    feet = STANCE_FEET - np.array([0.08, 0.0, 0.0])
    assert not inverse(BLUEFOOT, feet, np.radians(-99.0)).feasible
    assert inverse(BLUEFOOT, feet, ankle_directions(BLUEFOOT, AnkleConfig(policy="margin"), feet)).feasible


def test_margin_policy_is_continuous_below_the_hips():
    heights = np.arange(-0.17, -0.03, 0.0005)
    for reach in (0.10, 0.14, 0.18):
        points = np.column_stack([np.full_like(heights, reach), np.zeros_like(heights), heights])
        feet = np.repeat(points[:, None, :], 4, axis=1)
        inside = widest_margin(BLUEFOOT, feet)[:, 0] > 0.0
        directions = widest_directions(BLUEFOOT, feet)[inside, 0]
        assert inside.sum() > 100
        steps = np.abs((np.diff(directions) + np.pi) % (2.0 * np.pi) - np.pi)
        assert np.degrees(steps.max()) < 2.0  # half a millimetre at a time


def test_margin_policy_points_at_a_foot_out_of_reach():
    feet = np.tile([0.4, 0.0, -0.3], (4, 1))
    directions = widest_directions(BLUEFOOT, feet)
    np.testing.assert_allclose(directions, np.arctan2(-0.3, 0.4 - 0.065), atol=1e-12)
    assert (widest_margin(BLUEFOOT, feet) == -np.inf).all()
    angles, _ = inverse_in_leg(BLUEFOOT, feet, directions)
    np.testing.assert_allclose(angles[:, 2:], 0.0, atol=1e-7)


def _reachable_feet(geometry, rng, count):
    """(count, 4, 3) feet below the hips, in the workspace of walking and falling."""
    length = sum(geometry.links[1:])
    reach = geometry.links[0] + length * rng.uniform(0.0, 0.72, (count, 4))
    azimuth = geometry.hip_azimuth + rng.uniform(-0.8, 0.8, (count, 4))
    height = length * rng.uniform(-0.85, -0.2, (count, 4))
    return geometry.hip_position + np.stack(
        [reach * np.cos(azimuth), reach * np.sin(azimuth), height], axis=-1
    )


@pytest.mark.parametrize("geometry", [BLUEFOOT, uneven_geometry()], ids=["bluefoot", "uneven"])
def test_table_gives_the_widest_directions(geometry):
    table = AnkleTable(geometry)
    feet = _reachable_feet(geometry, np.random.default_rng(5), 1500)
    exact = widest_directions(geometry, to_leg_frame(geometry, feet), zooms=3)
    error = np.array([table.directions(points) for points in feet]) - exact
    error = np.degrees(np.abs((error + np.pi) % (2.0 * np.pi) - np.pi))
    assert error.max() < 0.5
    assert np.median(error) < 0.02  # most of the workspace is smooth


def test_table_searches_where_it_cannot_look_up():
    table = AnkleTable(BLUEFOOT)
    for feet in (
        np.tile([0.4, 0.1, -0.3], (4, 1)),  # out of reach
        STANCE_FEET + np.array([0.0, 0.0, 0.2]),  # above the hips
        BLUEFOOT.hip_position,  # behind the hip_pitch axes
    ):
        exact = widest_directions(BLUEFOOT, to_leg_frame(BLUEFOOT, feet))
        np.testing.assert_array_equal(table.directions(feet), exact)


def test_table_answers_for_the_legs_that_are_asked_for():
    geometry = uneven_geometry()
    config, table = AnkleConfig(policy="margin"), AnkleTable(geometry)
    feet = _reachable_feet(geometry, np.random.default_rng(6), 1)[0]
    every = ankle_directions(geometry, config, feet, table=table)
    some = ankle_directions(geometry, config, feet[[3, 1]], legs=(3, 1), table=table)
    np.testing.assert_array_equal(some, every[[3, 1]])
    np.testing.assert_allclose(every, ankle_directions(geometry, config, feet), atol=np.radians(0.5))


def test_policies_come_from_a_table_and_wrong_ones_name_the_valid_ones():
    assert build(AnkleConfig, {"policy": "ground", "direction_deg": -105.0}).policy == "ground"
    with pytest.raises(ConfigurationError, match="fixed, ground, margin"):
        build(AnkleConfig, {"policy": "straight"})
    with pytest.raises(ConfigurationError, match="direction_deg"):
        AnkleConfig(direction_deg=200.0)
