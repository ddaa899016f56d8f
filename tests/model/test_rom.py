import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.legs import LegGeometry, inverse
from bluefoot_mpc.model.parameters import load_parameters
from bluefoot_mpc.model.rom import RomConfig, stance_margin, study_range_of_motion

PARAMETERS = load_parameters()
GEOMETRY = LegGeometry.from_parameters(PARAMETERS)


@pytest.fixture(scope="module")
def study():
    return study_range_of_motion(PARAMETERS, RomConfig(points=41, rays=40))


def test_documented_figures_of_the_default_stance(study):
    """Truncated as the documents do: ±1.4 cm at -99°, ±9.8 cm and ±36° with free directions."""
    figures = study.figures()
    assert figures["ankle_direction_deg"] == pytest.approx(-99.0)
    assert math.floor(10.0 * figures["shift_fixed_cm"]) / 10.0 == 1.4
    assert math.floor(10.0 * figures["shift_free_cm"]) / 10.0 == 9.8
    assert math.floor(figures["tilt_free_deg"]) == 36


def test_free_shift_ends_where_a_stretched_leg_ends(study):
    """By hand: three links along the line from the hip_pitch axis, 0.115 m down."""
    radius = np.sqrt((3 * 0.065) ** 2 - 0.115**2) + 0.065
    side = 0.165 - 0.09215 / np.sqrt(2.0)
    assert study.shift_free.extent == pytest.approx(np.sqrt(radius**2 - side**2) - side, abs=2e-6)


def test_axes_are_equal_in_a_square_stance(study):
    for region in study.maps:
        low_first, high_first, low_second, high_second = region.extents
        assert low_first == pytest.approx(-high_first, abs=2e-6)
        assert low_second == pytest.approx(-high_second, abs=2e-6)
        assert high_first == pytest.approx(high_second, abs=2e-6)
        np.testing.assert_array_equal(region.feasible, region.feasible[::-1])
        if region.kind == "shift":  # roll and pitch do not commute
            np.testing.assert_array_equal(region.feasible, region.feasible.T)


def test_free_ankles_reach_every_pose_of_fixed_ones(study):
    for fixed, free in ((study.shift_fixed, study.shift_free), (study.tilt_fixed, study.tilt_free)):
        assert not (fixed.feasible & ~free.feasible).any()
        assert (free.margin >= fixed.margin - np.radians(0.1)).all()
        assert free.feasible.sum() > fixed.feasible.sum() > 0


def test_boundary_separates_feasible_from_infeasible(study):
    for region in study.maps:
        fixed = study.ankle_direction if region.ankle == "fixed" else None
        for share, expected in ((0.999, True), (1.001, False)):
            position = np.tile([0.0, 0.0, 0.115], (len(region.boundary), 1))
            rpy = np.zeros_like(position)
            (position if region.kind == "shift" else rpy)[:, :2] = share * region.boundary
            margin = stance_margin(GEOMETRY, PARAMETERS.stance.foot_position, position, rpy, fixed)
            assert ((margin >= 0.0) == expected).all()


def test_margins_are_those_of_the_single_inverse():
    rng = np.random.default_rng(1)
    feet = PARAMETERS.stance.foot_position
    position = np.array([0.0, 0.0, 0.115]) + rng.uniform(-0.02, 0.02, size=(30, 3))
    rpy = rng.uniform(-0.2, 0.2, size=(30, 3))
    margins = stance_margin(GEOMETRY, feet, position, rpy, np.radians(-99.0))
    for k in range(30):
        in_base = (feet - position[k]) @ rotation_from_rpy(rpy[k])
        result = inverse(GEOMETRY, in_base, np.radians(-99.0))
        expected = np.minimum(result.joints - GEOMETRY.lower, GEOMETRY.upper - result.joints).min()
        assert margins[k] == pytest.approx(expected if result.reachable.all() else -np.inf, abs=1e-12)


def test_stance_that_breaks_a_limit_has_no_room_at_all():
    study = study_range_of_motion(PARAMETERS, RomConfig(points=5, rays=4, ankle_direction_deg=-90.0))
    assert study.shift_fixed.extent == 0.0
    assert study.tilt_fixed.extent == 0.0
    assert study.shift_free.extent > 0.09


def test_maps_without_the_stance_or_the_axes_are_refused():
    with pytest.raises(ConfigurationError, match="points = 40 must be odd"):
        RomConfig(points=40)
    with pytest.raises(ConfigurationError, match="rays = 42 must be a multiple of 4"):
        RomConfig(rays=42)
