from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.legs import LegGeometry, joint_positions_in_base
from bluefoot_mpc.model.parameters import Part
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.zmp import placement
from bluefoot_mpc.zmp.mass_points import lump
from bluefoot_mpc.zmp.placement import PlacementConfig


@pytest.fixture(scope="module")
def robot():
    return load_robot()


@pytest.fixture(scope="module")
def masses(robot):
    return lump(robot.parameters)


@pytest.fixture(scope="module")
def leg_points(robot):
    return joint_positions_in_base(LegGeometry.from_parameters(robot.parameters), robot.stance_joints)


def test_lumped_masses_add_up_to_the_mass_budget(robot, masses):
    assert masses.total == pytest.approx(robot.parameters.total_mass, rel=1e-12)
    assert masses.leg_weights.sum() * 4 + masses.trunk == pytest.approx(masses.total, rel=1e-12)


def test_lumped_centre_of_mass_is_close_to_the_real_one(robot, masses, leg_points):
    import pinocchio as pin

    q = np.concatenate([np.zeros(3), [0.0, 0.0, 0.0, 1.0], robot.stance_joints])
    real = pin.centerOfMass(robot.pin_model, robot.pin_data, q)
    lumped = placement.centre_of_mass(masses, masses.trunk_com, leg_points)
    np.testing.assert_allclose(lumped, real, atol=4e-3)


def test_parts_go_to_the_nearest_point_of_their_link(robot):
    legs = robot.parameters.legs
    length = legs.link_lengths[0]

    def at(body, share):
        return Part(
            name="lump", body=body, mass=0.1, shape="box", size=(0.01, 0.01, 0.01),
            position=(share * length, 0.0, 0.0),
        )  # fmt: skip

    before = lump(robot.parameters)
    places = {
        ("link2", 0.2): ("joint", 1), ("link2", 0.3): ("link", 1), ("link2", 0.7): ("link", 1),
        ("link2", 0.8): ("joint", 2), ("link4", 0.8): ("foot", None), ("link1", -0.1): ("joint", 0),
    }  # fmt: skip
    for (body, share), (kind, index) in places.items():
        after = lump(replace(robot.parameters, parts=(*robot.parameters.parts, at(body, share))))
        change = {
            name: np.atleast_1d(getattr(after, name) - getattr(before, name))
            for name in ("joint", "link", "foot")
        }
        assert change[kind][index or 0] == pytest.approx(0.1)
        assert sum(values.sum() for values in change.values()) == pytest.approx(0.1)


def test_leg_weights_give_a_legs_first_moment(masses, leg_points):
    middles = 0.5 * (leg_points[0, :-1] + leg_points[0, 1:])
    moment = masses.joint @ leg_points[0, :4] + masses.link @ middles + masses.foot * leg_points[0, 4]
    np.testing.assert_allclose(masses.leg_weights @ leg_points[0], moment, atol=1e-15)


def test_no_swinging_leg_leaves_the_zmp_at_the_centre_of_mass(masses, leg_points):
    com = placement.centre_of_mass(masses, masses.trunk_com, leg_points)
    zmp = placement.static_zmp(masses, com, leg_points, np.zeros(4))
    np.testing.assert_allclose(zmp, com[:2], atol=1e-15)


@pytest.mark.parametrize("leg", range(4))
def test_the_trunk_leans_away_from_a_swinging_leg(masses, leg_points, leg):
    com = placement.centre_of_mass(masses, masses.trunk_com, leg_points)
    swing = np.arange(4) == leg
    shift = placement.static_zmp(masses, com, leg_points, swing) - com[:2]
    foot = leg_points[leg, 4, :2]
    assert shift @ foot < 0.0
    assert abs(shift[0] * foot[1] - shift[1] * foot[0]) < 1e-3 * np.hypot(*foot)


def test_moment_balance_of_the_placement(masses, leg_points):
    """The trunk's weight at the ZMP balances the swinging legs about the centre of mass."""
    com = placement.centre_of_mass(masses, masses.trunk_com, leg_points) + np.array([0.03, -0.02, 0.0])
    swing = np.array([1.0, 0.0, 0.0, 0.0])
    zmp = placement.static_zmp(masses, com, leg_points, swing)
    gravity = np.array([0.0, 0.0, -9.80665])
    moment = np.zeros(3)
    for weight, point in zip(masses.leg_weights, leg_points[0], strict=True):
        moment += np.cross(point - com, weight * gravity)
    moment += np.cross(np.append(zmp - com[:2], 0.0), masses.trunk * gravity)
    np.testing.assert_allclose(moment[:2], 0.0, atol=1e-12)


def test_diagonal_legs_cancel(masses, leg_points):
    com = placement.centre_of_mass(masses, masses.trunk_com, leg_points)
    zmp = placement.static_zmp(masses, com, leg_points, np.array([1.0, 0.0, 0.0, 1.0]))
    np.testing.assert_allclose(zmp, com[:2], atol=2e-3)


def test_boundary_force_pulls_to_far_feet_and_pushes_from_near_ones():
    config = PlacementConfig()
    feet = np.array([[0.15, 0.15, 0], [0.15, -0.15, 0], [-0.15, 0.15, 0], [-0.15, -0.15, 0]])
    np.testing.assert_allclose(placement.boundary_force(np.array([0, 0, 0.1]), feet, config), 0.0, atol=1e-12)
    far = placement.boundary_force(np.array([-0.12, 0, 0.1]), feet, config)
    assert far[0] > 0.0
    assert abs(far[1]) < 1e-12


def test_boundary_force_is_the_laws_sum_of_exponentials():
    """(e^{k r+} - e^{k r-}) unit(foot - trunk), summed over the feet, horizontal part."""
    config = PlacementConfig(boundary_sharpness=50.0, reach_min=0.2, reach_max=0.24)
    trunk = np.array([0.03, -0.02, 0.11])
    feet = np.array([[0.17, 0.15, 0.0], [0.14, -0.17, 0.01], [-0.16, 0.17, 0.0], [-0.1, -0.1, 0.02]])
    expected = np.zeros(3)
    for foot in feet:
        lever = foot - trunk
        distance = np.linalg.norm(lever)
        size = np.exp(50.0 * (distance - 0.24)) - np.exp(50.0 * (0.2 - distance))
        expected += size * lever / distance
    np.testing.assert_allclose(placement.boundary_force(trunk, feet, config), expected[:2], rtol=1e-12)


def test_near_feet_push_the_trunk_away():
    config = PlacementConfig()
    feet = np.array([[0.3, 0.15, 0], [0.3, -0.15, 0], [-0.05, 0.05, 0], [-0.05, -0.05, 0]])
    assert placement.boundary_force(np.array([0.0, 0.0, 0.1]), feet, config)[0] > 0.0


def test_one_small_step_is_the_law_itself(masses):
    config = PlacementConfig(boundary_gain=0.01)
    offset, target, force = np.array([0.002, -0.001]), np.array([0.006, 0.003]), np.array([2.0, -3.0])
    rate = config.gain * (target - offset) + config.boundary_gain * force / masses.trunk
    moved = placement.advance(offset, target, force, masses, 1e-3, config)
    np.testing.assert_allclose(moved, offset + 1e-3 * rate, rtol=1e-12)


def test_advance_converges_to_the_target_and_keeps_its_bounds(masses):
    config = PlacementConfig(max_offset=0.03, max_rate=0.2)
    offset = np.zeros(2)
    for _ in range(400):
        before = offset
        offset = placement.advance(offset, np.array([0.02, -0.01]), np.zeros(2), masses, 0.02, config)
        assert np.hypot(*(offset - before)) <= config.max_rate * 0.02 + 1e-12
    np.testing.assert_allclose(offset, [0.02, -0.01], atol=1e-6)
    for _ in range(400):
        offset = placement.advance(offset, np.array([1.0, 1.0]), np.zeros(2), masses, 0.02, config)
    assert np.hypot(*offset) == pytest.approx(0.03, abs=1e-9)


def test_impossible_reaches_are_refused():
    with pytest.raises(ConfigurationError, match="reach_min"):
        PlacementConfig(reach_min=0.4, reach_max=0.3)
