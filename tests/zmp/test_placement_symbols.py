import numpy as np
import pytest

from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry, joint_positions_in_base
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.zmp import placement
from bluefoot_mpc.zmp.mass_points import lump
from bluefoot_mpc.zmp.placement import PlacementConfig
from bluefoot_mpc.zmp.placement_symbols import com_function, placement_function

PARAMETERS = load_parameters()
GEOMETRY, MASSES = LegGeometry.from_parameters(PARAMETERS), lump(PARAMETERS)


def case(rng):
    stance = np.tile([0.0, 0.3, -1.2, -0.7], 4)
    joints = stance + rng.normal(0.0, 0.2, 16)
    rotation = rotation_from_rpy(rng.normal(0.0, 0.1, 3))
    points = joint_positions_in_base(GEOMETRY, joints) @ rotation.T
    return joints, rotation, points, placement.centre_of_mass(MASSES, rotation @ MASSES.trunk_com, points)


def test_the_centre_of_mass_is_that_of_the_lumped_points():
    function, rng = com_function(GEOMETRY, MASSES), np.random.default_rng(1)
    for _ in range(20):
        joints, rotation, points, com = case(rng)
        found, moments = function(joints, rotation.T)
        np.testing.assert_allclose(found.full().ravel(), com, atol=1e-14)
        np.testing.assert_allclose(moments.full().T, MASSES.leg_weights @ points, atol=1e-14)


@pytest.mark.parametrize(
    "config",
    [PlacementConfig(), PlacementConfig(max_rate=0.01, boundary_gain=0.1), PlacementConfig(max_offset=1e-3)],
)
def test_the_law_is_that_of_plain_numbers(config):
    function, rng = placement_function(GEOMETRY, MASSES, config), np.random.default_rng(2)
    for _ in range(20):
        joints, rotation, points, com = case(rng)
        trunk, feet = rng.normal([0.0, 0.0, 0.13], 0.02, 3), rng.normal(0.0, 0.2, (4, 3))
        swing, offset, commanded = rng.uniform(size=4), rng.normal(0.0, 0.01, 2), rng.normal(0.0, 0.01, 2)
        zmp = placement.static_zmp(MASSES, com, points, swing)
        force = placement.boundary_force(trunk, feet, config)
        wanted = placement.advance(offset, zmp + offset - commanded, force, MASSES, 0.02, config)
        found = function(joints, rotation.T, feet.T, trunk, swing, offset, commanded, 0.02)
        np.testing.assert_allclose(found[0].full().ravel(), wanted, atol=1e-14)
        np.testing.assert_allclose(found[1].full().ravel(), zmp, atol=1e-14)
