import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.patches import PatchConfig, cell_planes, segment
from bluefoot_mpc.types import HeightMap

CELL = 0.02


def as_map(height, confidence=None):
    height = np.asarray(height, dtype=np.float64)
    known = np.isfinite(height).astype(np.float64)
    return HeightMap(
        time=0.0,
        cell=CELL,
        pose=np.zeros(4),
        height=height,
        confidence=known if confidence is None else confidence,
    )


def slope(degrees, n=12, m=12):
    """A plane that rises along j."""
    return np.tile(np.arange(m) * CELL * np.tan(np.radians(degrees)), (n, 1))


def test_a_block_on_the_floor_is_a_patch_of_its_own_up_to_its_edges():
    height = np.zeros((12, 12))
    height[3:8, 4:9] = 0.02
    patches = segment(as_map(height))
    assert len(patches.size) == 2
    top = patches.label[5, 5]
    assert (patches.label[3:8, 4:9] == top).all()
    assert (patches.label == top).sum() == 25
    assert patches.label[0, 0] == 1 - top
    np.testing.assert_allclose(patches.height[[top, 1 - top]], [0.02, 0.0], atol=1e-12)
    np.testing.assert_allclose(patches.size[[top, 1 - top]], [25 * CELL**2, 119 * CELL**2])
    np.testing.assert_allclose(patches.slope, 0.0, atol=1e-9)
    np.testing.assert_allclose(patches.step, 0.0, atol=1e-12)
    assert patches.carries.all()


def test_a_small_step_joins_and_is_told():
    height = np.zeros((8, 8))
    height[:, 4:] = 0.008
    joined = segment(as_map(height), PatchConfig(step=0.010))
    assert len(joined.size) == 1
    assert joined.step[0] == pytest.approx(0.008)
    assert len(segment(as_map(height), PatchConfig(step=0.007)).size) == 2


@pytest.mark.parametrize("degrees", [0.0, 10.0, 20.0])
def test_slope_of_a_ramp(degrees):
    patches = segment(as_map(slope(degrees)))
    assert len(patches.size) == 1
    assert np.degrees(patches.slope[0]) == pytest.approx(degrees, abs=0.1)
    assert patches.roughness[0] < 1e-4
    assert patches.carries[0]


def test_a_steep_slope_is_in_no_patch():
    patches = segment(as_map(slope(22.0)), PatchConfig(slope_deg=20.0, step=0.02))
    assert (patches.label == -1).all()
    assert len(patches.size) == len(patches.carries) == 0


def test_rough_ground_is_in_no_patch():
    height = 0.008 * (np.indices((10, 10)).sum(axis=0) % 2)
    assert (segment(as_map(height), PatchConfig(roughness=0.003)).label == -1).all()
    assert (segment(as_map(height), PatchConfig(roughness=0.005)).label == 0).all()


def test_unknown_and_untrusted_cells_are_in_no_patch_and_part_patches():
    height = np.zeros((6, 9))
    height[:, 4] = np.nan
    patches = segment(as_map(height))
    assert (patches.label[:, 4] == -1).all()
    assert len(patches.size) == 2
    confidence = np.ones((6, 9))
    confidence[:, 4] = 0.1
    untrusted = segment(as_map(np.zeros((6, 9)), confidence), PatchConfig(confidence=0.2))
    np.testing.assert_array_equal(untrusted.label, patches.label)


def test_stray_heights_across_a_gap_join_nothing():
    height = np.zeros((12, 13))
    height[:, 5:8] = np.nan
    height[5:7, 5:8] = 0.001
    patches = segment(as_map(height))
    left, right = patches.label[0, 0], patches.label[0, 12]
    assert left != right
    assert (patches.label[:, :5] == left).all()
    assert (patches.label[:, 8:] == right).all()


def test_a_block_of_two_by_two_cells_is_a_patch():
    height = np.full((6, 6), 0.0)
    height[2:4, 2:4] = 0.05
    patches = segment(as_map(height))
    assert len(np.unique(patches.label[2:4, 2:4])) == 1
    assert patches.label[2, 2] != patches.label[0, 0]
    assert patches.height[patches.label[2, 2]] == pytest.approx(0.05)


def test_step_is_the_greatest_within_a_patch_even_where_it_joins_nothing():
    height = np.zeros((14, 14))
    height[:, :7] = np.linspace(0.02, 0.0, 14)[:, None]
    patches = segment(as_map(height), PatchConfig(step=0.008))
    assert patches.label[13, 0] == patches.label[0, 0] == patches.label[0, 13]
    assert patches.step[patches.label[0, 0]] == pytest.approx(0.02)


def test_a_cell_alone_is_in_no_patch():
    height = np.full((5, 5), np.nan)
    height[2, 2] = 0.0
    assert (segment(as_map(height)).label == -1).all()
    height[2, 3] = 0.0
    assert (segment(as_map(height)).label == -1).all()


def test_a_line_of_cells_says_nothing_of_the_slope_across():
    height = np.full((5, 5), np.nan)
    height[2] = 0.0
    slopes, roughness = cell_planes(height, CELL, PatchConfig())
    assert np.isnan(slopes).all()
    assert np.isnan(roughness).all()


def test_a_patch_that_is_too_small_carries_no_foot():
    height = np.zeros((8, 8))
    height[3:5, 3:5] = 0.02
    ground = as_map(height)
    for area, carries in ((4 * CELL**2, True), (5 * CELL**2, False)):
        patches = segment(ground, PatchConfig(area=area))
        assert bool(patches.carries[patches.label[3, 3]]) is carries
        assert patches.carries[patches.label[0, 0]]


def test_patches_bend_and_do_not_carry_as_a_whole():
    x = np.arange(20) * CELL
    height = np.tile(np.abs(x - 0.2) * np.tan(np.radians(15.0)), (6, 1))
    patches = segment(as_map(height), PatchConfig(roughness=0.006))
    assert len(patches.size) == 1
    assert patches.roughness[0] > 0.006
    assert not patches.carries[0]


@pytest.mark.parametrize("shape", [(0, 0), (1, 1), (1, 7), (4, 4)])
def test_maps_without_anything_known_or_of_one_line_have_no_patches(shape):
    height = np.full(shape, np.nan) if shape == (4, 4) else np.zeros(shape)
    patches = segment(as_map(height))
    assert patches.label.shape == shape
    assert (patches.label == -1).all()
    assert len(patches.height) == len(patches.size) == len(patches.step) == 0


@pytest.mark.parametrize(
    "wrong", [{"step": 0.0}, {"slope_deg": 90.0}, {"area": -1.0}, {"least_cells": 2}, {"confidence": 2.0}]
)
def test_impossible_limits_are_refused(wrong):
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        PatchConfig(**wrong)
