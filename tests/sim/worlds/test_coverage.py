"""Floor within reach and floor seen, against areas by hand and against lines of sight."""

import math

import numpy as np
import pytest

from bluefoot_mpc.io.lidar.geometry import bearings
from bluefoot_mpc.sim.worlds.coverage import (
    LIDAR_RANGE,
    Coverage,
    Grid,
    lidar_pose,
    reachable,
    seen_fraction,
    visible,
)
from bluefoot_mpc.sim.worlds.make import make_plan
from bluefoot_mpc.sim.worlds.plan import Marker, Solid, WorldPlan
from bluefoot_mpc.types import LidarScan


def plan_with(*solids, bounds=(-2.0, -2.0, 2.0, 2.0), marker=None):
    return WorldPlan(name="test", seed=0, bounds=bounds, solids=solids, marker=marker)


def wall(x, y, length, width, name="wall"):
    return Solid(name=name, shape="box", x=x, y=y, z=0.25, size=(length, width, 0.5))


def scan(distance, valid=True):
    """What a LIDAR sees that has the same distance all around."""
    bearing = bearings()
    return LidarScan(time=0.0, bearing=bearing, distance=np.full(len(bearing), distance), valid=valid)


def measured(plan, pose):
    """A scan without errors, from lines of sight in small steps."""
    bearing = bearings()
    angle = bearing + pose[2]
    steps = np.arange(0.02, 5.6, 0.02)
    distance = np.full(len(bearing), np.nan)
    for ray, direction in enumerate(np.stack([np.cos(angle), np.sin(angle)], axis=1)):
        seen = visible(plan.solids, pose[:2], pose[:2] + steps[:, None] * direction)
        if not seen.all():
            distance[ray] = steps[int(np.argmin(seen))]
    return LidarScan(time=0.0, bearing=bearing, distance=distance, valid=True)


def test_empty_room_is_all_within_reach_but_its_corners():
    radius = 0.30
    grid = reachable(plan_with(), radius)
    corners = (4.0 - math.pi) * radius**2
    assert grid.area == pytest.approx(16.0 - corners, abs=0.1)
    assert np.count_nonzero(grid.centres) * grid.cell**2 == pytest.approx(3.4**2, rel=0.03)


def test_a_gap_lets_a_disc_through_or_not():
    sides = (wall(1.0, 1.3, 0.1, 1.6, "a"), wall(1.0, -1.3, 0.1, 1.6, "b"))  # 1.0 m between them
    assert reachable(plan_with(*sides), 0.45).holds(1.5, 0.0)
    assert not reachable(plan_with(*sides), 0.55).holds(1.5, 0.0)


def test_start_without_room_reaches_nothing():
    grid = reachable(plan_with(wall(0.2, 0.0, 0.1, 0.1)), 0.3)
    assert grid.area == 0.0
    assert Coverage(grid).fraction == 1.0


def test_marker_stands_in_the_way_and_hanging_things_do_not():
    over = Solid(name="top", shape="box", x=1.0, y=0.0, z=0.7, size=(1.0, 1.0, 0.03))
    assert reachable(plan_with(over)).holds(1.0, 0.0)
    assert not reachable(plan_with(marker=Marker(x=1.0, y=0.0))).holds(1.0, 0.0)


def test_cells_and_points_agree():
    grid = reachable(plan_with())
    points = grid.points().reshape(*grid.floor.shape, 2)
    assert points[0, 0] == pytest.approx([-1.975, -1.975])
    assert points[0, -1] == pytest.approx([1.975, -1.975])
    assert points[-1, 0] == pytest.approx([-1.975, 1.975])
    assert grid.holds(0.0, 0.0)
    assert not grid.holds(-1.99, 0.0)
    assert not grid.holds(99.0, 0.0)


def test_one_scan_sees_its_sector():
    coverage = Coverage(reachable(plan_with()))
    coverage.add(np.zeros(3), scan(5.0))
    # Of the square of 4 m, what lies within 60° of straight back is missing: the quarter behind,
    # and two triangles of 2 m by 2 m (1 - tan 30°) beside it.
    missing_area = 4.0 + 2.0 * (1.0 - math.tan(math.radians(30.0))) * 2.0
    assert coverage.fraction == pytest.approx(1.0 - missing_area / 16.0, abs=0.015)
    missing = (~coverage.seen & coverage.grid.floor).ravel()
    bearing = np.abs(np.arctan2(*coverage.grid.points()[missing].T[::-1]))
    assert np.degrees(bearing).min() == pytest.approx(120.0, abs=1.0)
    coverage.add(np.array([0.0, 0.0, math.pi]), scan(5.0))
    assert coverage.fraction == 1.0


def test_nothing_is_seen_behind_what_was_hit_nor_where_no_echo_came():
    grid = reachable(plan_with())
    near = Coverage(grid)
    near.add(np.zeros(3), scan(1.0))
    far = np.hypot(*grid.points()[near.seen.ravel()].T)
    assert far.max() == pytest.approx(1.0 + grid.cell, abs=grid.cell)
    for useless in (scan(math.nan), scan(5.0, valid=False)):
        assert seen_fraction(grid, [np.zeros(3)], [useless]) == 0.0
    empty = LidarScan(time=0.0, bearing=np.zeros(0), distance=np.zeros(0), valid=True)
    assert seen_fraction(grid, [np.zeros(3)], [empty]) == 0.0


def spoilt(bearing, distance):
    return LidarScan(time=0.0, bearing=np.asarray(bearing), distance=np.asarray(distance), valid=True)


@pytest.mark.parametrize(
    "useless",
    [
        spoilt(bearings(), np.full(677, 3.0)),
        spoilt(bearings()[:100], np.full(682, 3.0)),
        spoilt(bearings()[::-1], np.full(682, 3.0)),
        spoilt(np.where(np.arange(682) == 300, np.nan, bearings()), np.full(682, 3.0)),
        spoilt([np.nan], [3.0]),
        spoilt([-np.inf, 0.0], [3.0, 3.0]),
        spoilt(np.stack([bearings()] * 2), np.full((2, 682), 3.0)),
        scan(3.0, valid=False),
    ],
)
def test_scans_that_are_none_are_left_out(useless):
    coverage = Coverage(reachable(plan_with()))
    coverage.add(np.zeros(3), useless)
    assert coverage.fraction == 0.0
    coverage.add(np.zeros(3), scan(3.0))
    assert coverage.fraction > 0.5


def test_a_far_cell_is_out_of_reach():
    grid = reachable(plan_with(bounds=(-1.0, -1.0, 9.0, 1.0)))
    coverage = Coverage(grid)
    coverage.add(np.zeros(3), scan(20.0))
    assert grid.points()[coverage.seen.ravel(), 0].max() <= LIDAR_RANGE


@pytest.mark.parametrize("kind", ["corridors", "chairs"])
def test_seen_floor_agrees_with_lines_of_sight(kind):
    plan = make_plan(kind, 4)
    grid = reachable(plan)
    pose = np.array([0.05, -0.02, 0.4])
    coverage = Coverage(grid)
    coverage.add(pose, measured(plan, pose))
    points = grid.points()
    offset = points - pose[:2]
    bearing = (np.arctan2(offset[:, 1], offset[:, 0]) - pose[2] + math.pi) % (2.0 * math.pi) - math.pi
    sight = visible(plan.solids, pose[:2], points) & (np.abs(bearing) < math.radians(119.5))
    sight &= np.hypot(*offset.T) < LIDAR_RANGE
    wanted = sight.reshape(grid.floor.shape) & grid.floor
    differs = np.count_nonzero(wanted != coverage.seen) / np.count_nonzero(grid.floor)
    # Edges of shadows, one cell wide, and rays that left the reach.
    assert differs < 0.06


def test_pose_of_the_lidar():
    half = math.radians(45.0)
    q = np.array([1.0, 2.0, 0.12, 0.0, 0.0, math.sin(half), math.cos(half)])
    pose = lidar_pose(q, np.array([0.04, 0.0, 0.127]))
    assert pose == pytest.approx([1.0, 2.04, math.radians(90.0)])


def test_lines_of_sight_around_a_box_and_a_cylinder():
    post = Solid(name="post", shape="cylinder", x=1.0, y=0.0, z=0.25, size=(0.2, 0.2, 0.5))
    points = np.array([[2.0, 0.0], [2.0, 0.3], [0.5, 0.0]])
    assert visible([post], np.zeros(2), points).tolist() == [False, True, True]
    turned = Solid(name="b", shape="box", x=1.0, y=0.0, z=0.25, size=(1.0, 0.1, 0.5), yaw=math.pi / 2)
    points = np.array([[2.0, 0.0], [2.0, 0.9], [2.0, 1.1], [0.5, 0.0]])
    assert visible([turned], np.zeros(2), points).tolist() == [False, False, True, True]
    seat = Solid(name="seat", shape="box", x=1.0, y=0.0, z=0.45, size=(1.0, 1.0, 0.04))
    assert visible([seat], np.zeros(2), points).all()


def test_grid_is_plain_data():
    grid = Grid(corner=(0.0, 0.0), cell=0.5, centres=np.ones((2, 2), bool), floor=np.ones((2, 2), bool))
    assert grid.area == 1.0
