import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.voxels import thin


def test_a_voxel_gives_the_centroid_of_its_points_and_their_number():
    points = np.array([[0.001, 0.0, 0.0], [0.003, 0.002, -0.004], [0.021, 0.0, 0.0]])
    voxels = thin(points, 0.02)
    order = np.argsort(voxels.points[:, 0])
    np.testing.assert_allclose(voxels.points[order], [[0.002, 0.001, -0.002], [0.021, 0.0, 0.0]], atol=1e-15)
    assert voxels.count[order].tolist() == [2.0, 1.0]


def test_level_ground_at_height_zero_lies_in_one_layer():
    rng = np.random.default_rng(0)
    points = np.column_stack((rng.uniform(0.0, 1.0, (5000, 2)), rng.uniform(-0.009, 0.009, 5000)))
    voxels = thin(points, 0.02)
    corners = np.rint(voxels.points[:, :2] / 0.02)
    assert len(np.unique(corners, axis=0)) == len(voxels.points)


def test_sum_of_all_points_is_kept():
    points = np.random.default_rng(1).normal(size=(1000, 3)) * (0.2, 0.2, 0.01) + (1.0, -2.0, 0.3)
    voxels = thin(points, 0.03)
    assert len(voxels.points) < 900
    assert voxels.count.sum() == 1000.0
    np.testing.assert_allclose((voxels.points * voxels.count[:, None]).sum(axis=0), points.sum(axis=0))


@pytest.mark.parametrize("points", [np.zeros((0, 3)), np.full((4, 3), np.nan), np.full((4, 3), np.inf)])
def test_no_finite_point_gives_an_empty_cloud(points):
    voxels = thin(points, 0.02)
    assert voxels.points.shape == (0, 3)
    assert voxels.count.shape == (0,)


def test_points_that_are_no_numbers_are_left_out():
    voxels = thin(np.array([[0.0, 0.0, np.nan], [0.1, 0.2, 0.3], [np.inf, 0.0, 0.0]]), 0.02)
    np.testing.assert_allclose(voxels.points, [[0.1, 0.2, 0.3]])


def test_a_voxel_without_a_size_is_refused():
    with pytest.raises(ConfigurationError, match="size"):
        thin(np.zeros((1, 3)), 0.0)
