import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.moving_squares import (
    FitConfig,
    find_neighbours,
    fit_planes,
    least_axis,
    offsets,
    same_face,
    smooth,
)
from tests.terrain.clouds import block, ground, seen

FIT = FitConfig()


def around(points, config=FIT):
    return find_neighbours(points, np.ones(len(points)), config)


def test_neighbours_are_the_nearest_points_within_the_radius():
    points = np.random.default_rng(0).uniform(0.0, 0.2, (200, 3))
    found = around(points, FitConfig(neighbours=12, radius=0.05, width=0.02))
    distance = np.linalg.norm(points[:, None] - points, axis=2)
    for row in (0, 57, 199):
        true = [k for k in np.argsort(distance[row])[:12] if distance[row, k] < 0.05]
        assert found.index[row][found.weight[row] > 0.0].tolist() == true
        np.testing.assert_allclose(
            found.weight[row, : len(true)], np.exp(-0.5 * (distance[row, true] / 0.02) ** 2)
        )


def test_a_point_that_stands_for_more_weighs_more():
    points = np.array([[0.0, 0.0, 0.0], [0.01, 0.0, 0.0], [0.0, 0.01, 0.0]])
    found = find_neighbours(points, np.array([1.0, 5.0, 1.0]), FIT)
    weight = dict(zip(found.index[0].tolist(), found.weight[0], strict=True))
    assert weight[1] == pytest.approx(5.0 * weight[2])


@pytest.mark.parametrize("count", [0, 1, 2, 5])
def test_fewer_points_than_neighbours(count):
    points = np.random.default_rng(2).uniform(0.0, 0.02, (count, 3))
    found = around(points)
    assert found.index.shape == found.weight.shape == (count, count)
    smoothed, normal = smooth(points, found, FIT)
    assert smoothed.shape == normal.shape == (count, 3)
    assert np.isfinite(smoothed).all()
    np.testing.assert_allclose(np.linalg.norm(normal, axis=1), 1.0)


@pytest.mark.parametrize("scale", [(1.0, 1.0, 0.1), (1.0, 1.0, 1e-3), (1.0, 0.05, 0.02), (1.0, 1.0, 0.0)])
def test_least_axis_is_that_of_lapack(scale):
    rng = np.random.default_rng(3)
    turned = np.linalg.qr(rng.normal(size=(300, 3, 3)))[0]
    near = rng.normal(size=(300, 30, 3)) * (0.03 * np.array(scale)) @ turned
    moment = np.einsum("nka,nkb->nab", near, near) / 30.0
    spread, axes = np.linalg.eigh(moment)
    entries = np.stack([moment[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))])
    found, normal = least_axis(entries)
    np.testing.assert_allclose(found, np.maximum(spread, 0.0), atol=1e-9 * spread.max())
    np.testing.assert_allclose(np.abs(np.einsum("nd,nd->n", normal, axes[:, :, 0])), 1.0, atol=1e-9)
    assert (normal[:, 2] >= 0.0).all()


def test_points_on_a_line_or_in_one_place_have_a_level_plane():
    on_a_line = np.array([[1e-4, 0.0, 0.0, 0.0, 0.0, 0.0], [0.0] * 6]).T
    np.testing.assert_allclose(least_axis(on_a_line)[1], [[0.0, 0.0, 1.0]] * 2)


def test_a_plane_is_found_exactly_and_stays_as_it_is():
    points, normal = ground(np.random.default_rng(4), 500, slope_deg=15.0)
    found = around(points)
    planes = fit_planes(offsets(points, found), found.weight)
    np.testing.assert_allclose(planes.normal, np.tile(normal, (500, 1)), atol=1e-7)
    np.testing.assert_allclose(planes.spread[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(smooth(points, found, FIT)[0], points, atol=1e-9)


def test_neighbours_of_no_weight_give_a_level_plane():
    points, _ = ground(np.random.default_rng(5), 50, slope_deg=30.0)
    found = around(points)
    planes = fit_planes(offsets(points, found), np.zeros_like(found.weight))
    np.testing.assert_allclose(planes.normal, [[0.0, 0.0, 1.0]] * 50)
    np.testing.assert_allclose(planes.centre, 0.0)


def test_what_lies_a_step_higher_counts_little():
    points = np.array([[0.0, 0.0, 0.0], [0.02, 0.0, 0.001], [0.02, 0.0, 0.02]])
    found = around(points)
    level = np.tile((0.0, 0.0, 1.0), (3, 1))
    share = same_face(offsets(points, found), found.weight, level, FIT.step) / found.weight
    by_neighbour = dict(zip(found.index[0].tolist(), share[0], strict=True))
    assert by_neighbour[1] > 0.95
    assert by_neighbour[2] < 1e-4


def test_noise_is_smoothed_and_an_edge_stays():
    rng = np.random.default_rng(6)
    true = block(rng, 3000, height=0.03)
    points = seen(true, rng, sigma=0.01)
    smoothed, _ = smooth(points, around(points), FIT)
    near = np.abs(true[:, 0] - 0.7) > 0.03
    before = np.abs(points[:, 2] - true[:, 2])[near]
    after = np.abs(smoothed[:, 2] - true[:, 2])[near]
    assert np.median(after) < 0.6 * np.median(before)
    middle = np.abs(smoothed[:, 2] - 0.015) < 0.005
    assert middle[near].mean() < 0.01


@pytest.mark.parametrize(
    "wrong", [{"neighbours": 2}, {"radius": 0.0}, {"width": -1.0}, {"step": float("nan")}, {"rounds": 0}]
)
def test_impossible_fits_are_refused(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        FitConfig(**wrong)
