import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import build, to_table
from bluefoot_mpc.terrain.moving_squares import FitConfig
from bluefoot_mpc.terrain.surface import SurfaceConfig, reconstruct
from tests.terrain.clouds import block, degrees_between, ground, seen


@pytest.mark.parametrize("slope_deg", [0.0, 10.0])
def test_normals_of_a_sweep_are_within_four_degrees(slope_deg):
    rng = np.random.default_rng(0)
    points, true = ground(rng, 12_000, slope_deg)
    surface = reconstruct(seen(points, rng))
    assert len(surface.points) > 2000
    assert np.median(degrees_between(surface.normals, true)) < 1.0
    assert surface.flat.mean() > 0.999


def test_tops_of_blocks_are_level_on_both_sides_of_an_edge():
    rng = np.random.default_rng(1)
    surface = reconstruct(seen(block(rng, 12_000, height=0.02), rng))
    off = degrees_between(surface.normals, np.array([0.0, 0.0, 1.0]))
    assert np.median(off) < 1.0
    near = np.abs(surface.points[:, 0] - 0.7) < 0.05
    assert np.median(off[near]) < 4.0
    for low, high, height in ((0.4, 0.66, 0.0), (0.74, 1.1, 0.02)):
        there = (surface.points[:, 0] > low) & (surface.points[:, 0] < high)
        assert abs(np.median(surface.points[there, 2]) - height) < 0.002


def test_a_steep_slope_is_not_flat():
    rng = np.random.default_rng(2)
    surface = reconstruct(seen(ground(rng, 12_000, slope_deg=30.0)[0], rng))
    assert surface.flat.mean() < 0.12
    assert np.median(surface.normals[:, 2]) == pytest.approx(np.cos(np.radians(30.0)), abs=0.01)


def test_points_that_are_no_numbers_change_nothing():
    points = seen(ground(np.random.default_rng(3), 3000)[0], np.random.default_rng(4))
    spoilt = np.insert(points, [0, 1500], np.nan, axis=0)
    spoilt[0, :2] = 0.5
    np.testing.assert_array_equal(reconstruct(spoilt).normals, reconstruct(points).normals)


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.full((10, 3), np.nan),
        np.zeros((1, 3)),
        np.zeros((500, 3)),
        np.array([[0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [2.5, 0.0, 0.0]]),
        np.random.default_rng(5).uniform(-3.0, 3.0, (300, 3)),
    ],
)
def test_too_few_points_give_an_empty_surface(points):
    surface = reconstruct(points)
    assert surface.points.shape == surface.normals.shape == (0, 3)
    assert surface.flat.shape == surface.roughness.shape == surface.curvature.shape == (0,)
    assert surface.flat.dtype == np.bool_


def test_a_stray_echo_is_no_surface():
    rng = np.random.default_rng(6)
    points = np.vstack((ground(rng, 3000)[0], [[0.7, 0.0, 0.4]]))
    assert reconstruct(points).points[:, 2].max() < 0.05


def test_the_side_of_a_block_is_mostly_left_out():
    rng = np.random.default_rng(9)
    floor = block(rng, 6000, height=0.08)
    side = np.column_stack((np.full(1500, 0.7), rng.uniform(-0.6, 0.6, 1500), rng.uniform(0.0, 0.08, 1500)))
    cloud = seen(np.vstack((floor, side)), rng)
    kept, all_points = (reconstruct(cloud, SurfaceConfig(least_support=share)).points for share in (0.4, 0.0))
    on_side, on_side_of_all = (((z > 0.015) & (z < 0.065)).sum() for z in (kept[:, 2], all_points[:, 2]))
    assert on_side < 0.3 * on_side_of_all
    assert len(kept) > 0.8 * len(all_points)


def test_the_same_cloud_gives_the_same_surface_bit_for_bit():
    points = seen(ground(np.random.default_rng(7), 2000)[0], np.random.default_rng(8))
    one, other = reconstruct(points), reconstruct(points.copy())
    assert one.points.tobytes() == other.points.tobytes()
    assert one.normals.tobytes() == other.normals.tobytes()


@pytest.mark.parametrize(
    ("wrong", "name"),
    [
        ({"voxel": 0.0}, "voxel"),
        ({"least_neighbours": 2}, "least_neighbours"),
        ({"least_support": -0.1}, "least_support"),
        ({"flatness": 1.5}, "flatness"),
    ],
)
def test_impossible_configurations_are_refused(wrong, name):
    with pytest.raises(ConfigurationError, match=name):
        SurfaceConfig(**wrong)


def test_configuration_goes_through_a_file():
    config = SurfaceConfig(voxel=0.015, fit=FitConfig(neighbours=20, rounds=2))
    assert build(SurfaceConfig, to_table(config)) == config
