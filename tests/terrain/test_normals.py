import numpy as np
import pytest

from bluefoot_mpc.terrain.moving_squares import FitConfig, find_neighbours, smooth
from bluefoot_mpc.terrain.normals import flat, normals, roughness
from tests.terrain.clouds import degrees_between, ground, seen

FIT = FitConfig()


def found(points, guess=None):
    around = find_neighbours(points, np.ones(len(points)), FIT)
    smoothed, last = smooth(points, around, FIT)
    return normals(smoothed, around, last if guess is None else guess, FIT)


@pytest.mark.parametrize("slope_deg", [0.0, 10.0, 20.0])
def test_normals_of_a_noisy_slope_are_true_and_point_up(slope_deg):
    rng = np.random.default_rng(0)
    points, true = ground(rng, 2500, slope_deg)
    seen_normals = found(seen(points, rng)).normal
    assert (seen_normals[:, 2] > 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(seen_normals, axis=1), 1.0)
    assert np.median(degrees_between(seen_normals, true)) < 2.0


def test_roughness_is_what_strays_from_the_planes():
    rng = np.random.default_rng(1)
    points, normal = ground(rng, 2500, slope_deg=10.0)
    around = find_neighbours(points, np.ones(2500), FIT)
    planes = np.tile(normal, (2500, 1))
    np.testing.assert_allclose(roughness(points, points, around, planes), 0.0, atol=1e-9)
    measured = points + normal * rng.normal(0.0, 0.004, (2500, 1))
    assert np.median(roughness(measured, points, around, planes)) == pytest.approx(0.004, rel=0.1)


def test_curvature_tells_even_from_rough_ground():
    rng = np.random.default_rng(1)
    points, _ = ground(rng, 2500)
    even = found(points).curvature
    rough = found(points + (0.0, 0.0, 1.0) * rng.normal(0.0, 0.004, (2500, 1))).curvature
    np.testing.assert_allclose(even, 0.0, atol=1e-9)
    assert np.median(rough) > 1e-6
    assert ((rough >= 0.0) & (rough <= 1.0 / 3.0 + 1e-12)).all()


def test_support_is_high_on_a_face_and_low_beside_it():
    rng = np.random.default_rng(2)
    points = np.vstack((ground(rng, 2000)[0], [[0.7, 0.0, 0.03]]))
    support = found(points, guess=np.tile((0.0, 0.0, 1.0), (2001, 1))).support
    assert support[:-1].min() > 0.9
    assert support[-1] < 0.2


def test_no_points_have_no_normals():
    nothing = found(np.zeros((0, 3)))
    assert nothing.normal.shape == (0, 3)
    assert nothing.curvature.shape == nothing.support.shape == (0,)


def test_flat_is_within_the_angle():
    angle = np.radians([0.0, 19.0, 21.0, 90.0])
    normal = np.column_stack((np.sin(angle), np.zeros(4), np.cos(angle)))
    assert flat(normal, 1.0 - np.cos(np.radians(20.0))).tolist() == [True, True, False, False]
