"""An older map fitted to a newer one."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.terrain.frame import heights_at
from bluefoot_mpc.terrain.height_map import MapBuilder, Region
from bluefoot_mpc.terrain.registration import Shift, align, moved
from bluefoot_mpc.types import FloatArray, HeightMap
from tests.terrain.boxes import Box, Off, heights, rubble, sweep

AHEAD = Region.spanning((0.2, 1.6), (-0.7, 0.7), 0.02)
DRIFT = Off(place=(0.012, -0.015, 0.005), yaw=math.radians(1.5), jitter_deg=0.1)
THERE = (0.15, 0.02, 0.03)


def _map(boxes: list[Box], seed: int, place: tuple[float, float, float], off: Off | None = None) -> HeightMap:
    builder = MapBuilder()
    for points, time, origin in sweep(boxes, np.random.default_rng(seed), place, off):
        builder.add(points, time, origin)
    return builder.build(AHEAD)


def _drifted(points: FloatArray) -> FloatArray:
    """Where a robot at `THERE` with `DRIFT` believes places (k, 3) to be."""
    true = Shift(x=DRIFT.place[0], y=DRIFT.place[1], z=DRIFT.place[2], yaw=DRIFT.yaw, centre=THERE[:2])
    return true.apply(points)


@pytest.mark.parametrize("seed", [0, 2])
def test_drift_between_two_sweeps_is_found(seed: int) -> None:
    """Of 19 mm, 5 mm up and 1.5 degrees some 5 mm and 0.5 degrees are left, of two noisy sweeps of rubble."""
    boxes = rubble(seed, 0.025, count=60)
    shift = align(_map(boxes, seed, (0.0, 0.0, 0.0)), _map(boxes, seed + 9, THERE, DRIFT))
    assert not shift.reason
    middle = np.array([[*shift.centre, 0.0]])
    left = shift.apply(middle) - _drifted(middle)
    assert np.hypot(*left[0, :2]) < 0.006
    assert abs(left[0, 2]) < 0.002
    assert shift.yaw == pytest.approx(DRIFT.yaw, abs=math.radians(0.6))


def test_a_shift_of_the_same_ground_is_found_exactly() -> None:
    """Smooth hills, without noise."""

    def hills(x: FloatArray, y: FloatArray) -> FloatArray:
        return 0.02 * np.sin(9.0 * x) * np.cos(7.0 * y)

    j, i = np.meshgrid(0.01 + 0.02 * np.arange(60), 0.01 + 0.02 * np.arange(60))
    pose, trust = np.zeros(4), np.ones(j.shape)
    old = HeightMap(time=0.0, cell=0.02, pose=pose, height=hills(j, i), confidence=trust)
    true = Shift(x=0.015, y=-0.010, z=0.005, yaw=math.radians(1.5), centre=(0.6, 0.6))
    back = replace(true, x=0.0, y=0.0, z=0.0, yaw=-true.yaw).apply(
        np.column_stack((j.ravel() - true.x, i.ravel() - true.y, np.zeros(j.size)))
    )
    new = replace(old, height=hills(back[:, 0], back[:, 1]).reshape(j.shape) + true.z)
    shift = align(old, new)
    assert shift.reason == ""
    places = np.array([[0.3, 0.3, 0.0], [0.9, 0.8, 0.0]])
    assert shift.apply(places) == pytest.approx(true.apply(places), abs=5e-4)
    fitted = moved(old, shift)
    inside = (slice(5, -5), slice(5, -5))
    assert fitted.height[inside] == pytest.approx(new.height[inside], abs=0.004)
    assert np.abs(old.height[inside] - new.height[inside]).max() > 0.006


def test_even_ground_tells_the_height_only() -> None:
    """Noise does not pass for features: no sideways shift, and why."""
    shift = align(_map([], 1, (0.0, 0.0, 0.0)), _map([], 2, THERE, Off(place=(0.01, 0.01, 0.006))))
    assert (shift.x, shift.y, shift.yaw) == (0.0, 0.0, 0.0)
    assert shift.z == pytest.approx(0.006, abs=0.001)
    assert "too even" in shift.reason


def test_maps_that_hardly_overlap_are_not_fitted() -> None:
    """Two maps of different places, and a map of nothing."""
    old = _map(rubble(0, 0.02), 0, (0.0, 0.0, 0.0))
    empty = replace(old, height=np.full_like(old.height, np.nan))
    elsewhere = replace(old, pose=np.array([5.0, 0.0, 0.0, 0.0]))
    for new in (empty, elsewhere):
        shift = align(old, new)
        assert (shift.x, shift.y, shift.z, shift.yaw) == (0.0, 0.0, 0.0, 0.0)
        assert "share 0 cells" in shift.reason
        assert align(new, old).reason


def test_what_the_odometry_cannot_have_done_is_refused() -> None:
    """A change of height beyond bounds is no drift."""
    boxes = rubble(0, 0.025, count=60)
    old, new = _map(boxes, 0, (0.0, 0.0, 0.0)), _map(boxes, 9, THERE, Off(place=(0.0, 0.0, 0.05)))
    shift = align(old, new)
    assert (shift.x, shift.y, shift.yaw) == (0.0, 0.0, 0.0)
    assert "drifted" in shift.reason
    assert shift.z == 0.0


def test_moving_a_map_brings_its_heights_along() -> None:
    """A block stands where the shift says."""
    boxes = [Box(0.8, 0.1, 0.2, 0.2, 0.03)]
    old = _map(boxes, 0, (0.0, 0.0, 0.0))
    shift = Shift(x=0.10, y=-0.06, z=0.01, yaw=0.1, centre=(0.8, 0.1))
    new = moved(old, shift)
    assert heights_at(new, np.array([0.90, 0.04])) == pytest.approx(0.04, abs=0.004)
    assert heights(boxes, np.array([0.80, 0.1])) == 0.03
    assert (np.isnan(new.height) == (new.confidence == 0.0)).all()
