"""What is out of sight stays known, until a sweep says otherwise or it is too old."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.navigation.memory import MemoryConfig, PointMemory, nearest
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.navigation.scan import LevelScan
from bluefoot_mpc.types import FloatArray
from tests.navigation.bench import BEARINGS

CONFIG = MemoryConfig()


def sweep(distance: FloatArray, time: float = 0.0) -> LevelScan:
    """A level sweep from the robot's middle."""
    points = distance[:, None] * np.column_stack((np.cos(BEARINGS), np.sin(BEARINGS)))
    return LevelScan(
        time=time, bearing=BEARINGS, distance=distance, points=points, hit=distance < 5.5, origin=np.zeros(2)
    )


def pole(bearing: float, far: float, time: float = 0.0) -> LevelScan:
    """A sweep of open floor with a thin thing in it."""
    distance = np.full(BEARINGS.size, 5.6)
    distance[np.abs(BEARINGS - bearing) < 0.02] = far
    return sweep(distance, time)


OPEN = np.full(BEARINGS.size, 5.6)
WALLS = np.full(BEARINGS.size, 3.0)


def near(memory: PointMemory, x: float, y: float) -> int:
    """How many points are known about a place."""
    return int((np.hypot(*(memory.points - (x, y)).T) < 0.05).sum())


def test_what_goes_out_of_sight_stays_where_it_was() -> None:
    memory = PointMemory(CONFIG)
    memory.step(pole(2.0, 0.6), Pose(0.0, 0.0, 0.0))
    # Turned to the right: the pole is behind.
    for k in range(20):
        memory.step(sweep(OPEN, 0.1 * k), Pose(0.0, 0.0, -1.0))
    assert near(memory, 0.6 * math.cos(2.0), 0.6 * math.sin(2.0)) >= 1


@pytest.mark.parametrize(("behind", "sweeps"), [(WALLS, 3), (OPEN, 12)])
def test_what_is_looked_through_goes_sooner_where_something_is_met_behind_it(
    behind: FloatArray, sweeps: int
) -> None:
    memory = PointMemory(CONFIG)
    memory.step(pole(0.5, 0.6), Pose(0.0, 0.0, 0.0))
    place = 0.6 * math.cos(0.5), 0.6 * math.sin(0.5)
    for k in range(sweeps):
        assert near(memory, *place) >= 1
        memory.step(sweep(behind, 0.1 * k), Pose(0.0, 0.0, 0.0))
    assert near(memory, *place) == 0


def test_what_stands_behind_something_stays() -> None:
    memory = PointMemory(CONFIG)
    memory.step(pole(0.5, 1.2), Pose(0.0, 0.0, 0.0))
    for k in range(10):
        memory.step(pole(0.5, 0.6, 0.1 * k), Pose(0.0, 0.0, 0.0))
    assert near(memory, 1.2 * math.cos(0.5), 1.2 * math.sin(0.5)) >= 1


def test_too_old_or_too_far_is_forgotten() -> None:
    memory = PointMemory(CONFIG)
    memory.step(pole(2.0, 0.6), Pose(0.0, 0.0, 0.0))
    memory.step(sweep(OPEN, CONFIG.age + 1.0), Pose(0.0, 0.0, -1.0))
    assert len(memory.points) == 0
    memory.step(pole(2.0, 0.6), Pose(0.0, 0.0, -1.0))
    memory.step(sweep(OPEN), Pose(3.0, 0.0, -1.0))
    assert len(memory.points) == 0


def test_memory_is_bounded() -> None:
    rng, memory = np.random.default_rng(0), PointMemory(CONFIG)
    for k in range(300):
        distance = rng.uniform(0.3, 1.4, BEARINGS.size)
        memory.step(sweep(distance, 0.1 * k), Pose(0.0, 0.0, 0.7 * k))
        assert len(memory.points) <= CONFIG.capacity


def test_of_neighbouring_rays_the_nearest_is_kept() -> None:
    distance = np.full(BEARINGS.size, 1.2)
    distance[340] = 0.5
    found = np.hypot(*nearest(sweep(distance), CONFIG).T)
    assert found.min() == 0.5
    assert len(found) == BEARINGS.size // CONFIG.rays
    assert len(nearest(sweep(OPEN), CONFIG)) == 0


def test_reset_forgets() -> None:
    memory = PointMemory(CONFIG)
    memory.step(pole(0.5, 0.6), Pose(0.0, 0.0, 0.0))
    memory.reset()
    assert len(memory.points) == 0
