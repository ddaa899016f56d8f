"""The coarse map, ways over it, goals of exploring, waypoints, and the way out of corners."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.navigation import route
from bluefoot_mpc.navigation.escape import Escape, EscapeConfig, StuckWatch
from bluefoot_mpc.navigation.explore import ExploreConfig, Explorer
from bluefoot_mpc.navigation.grid import GridConfig, MapGrid
from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.plan import GoalWay, PlanConfig, way_to, ways
from bluefoot_mpc.navigation.pose import Pose
from bluefoot_mpc.navigation.scan import LevelScan, ScanConfig, ScanReader
from bluefoot_mpc.navigation.waypoints import WaypointConfig, Waypoints
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import LidarScan
from tests.navigation.bench import BEARINGS, MOUNTS, FlatWorld, body_state, box, closed_room

DIVIDED = closed_room(box("wall", 1.5, -0.6, 0.1, 2.8))
"""A wall with a passage of 1.2 m at its left end."""


def swept(plan: WorldPlan, grid: MapGrid, pose: Pose, time: float = 0.0) -> None:
    """Let the map see what is there to see, twice: once is no evidence."""
    for k in range(2):
        grid.step(level_sweep(plan, pose, time + 0.1 * k), pose)


def stands_at(grid: MapGrid, x: float, y: float) -> bool:
    """True where a thing stands within a square of a place."""
    row, column = grid.cell_of(x, y)
    return bool(grid.occupied()[row - 1 : row + 2, column - 1 : column + 2].any())


def level_sweep(plan: WorldPlan, pose: Pose, time: float) -> LevelScan:
    """A sweep without errors."""
    x, y = pose.x + 0.04 * math.cos(pose.yaw), pose.y + 0.04 * math.sin(pose.yaw)
    true = FlatWorld(plan).ranges(x, y, BEARINGS + pose.yaw)
    scan = LidarScan(time=time, bearing=BEARINGS, distance=np.where(true > 5.6, np.nan, true), valid=True)
    result = ScanReader(ScanConfig(), MOUNTS).read(scan, body_state(time))
    assert isinstance(result, LevelScan)
    return result


def test_map_holds_walls_free_floor_and_what_is_not_seen() -> None:
    grid = MapGrid(GridConfig())
    swept(DIVIDED, grid, Pose(0.0, 0.0, 0.0))
    occupied = grid.occupied()
    assert occupied[grid.cell_of(1.45, 0.0)]
    assert not occupied[grid.cell_of(1.0, 0.5)]
    assert np.isfinite(grid.seen[grid.cell_of(1.0, 0.5)])
    assert np.isinf(grid.seen[grid.cell_of(3.0, -1.0)])  # behind the wall
    assert np.isfinite(grid.visited[grid.cell_of(0.0, 0.0)])


def test_what_went_away_goes_from_the_map() -> None:
    grid = MapGrid(GridConfig())
    pose, thing = Pose(0.0, 0.0, 0.0), closed_room(box("box", 1.0, 0.0, 0.3, 0.3))
    swept(thing, grid, pose)
    cell = grid.cell_of(0.86, 0.0)
    assert grid.occupied()[cell]
    for k in range(5):
        swept(closed_room(), grid, pose, 1.0 + k)
    assert not grid.occupied()[cell]


def test_map_moves_on_with_the_robot_and_keeps_what_it_holds() -> None:
    config = GridConfig()
    grid = MapGrid(config)
    swept(closed_room(), grid, Pose(0.0, 0.0, math.pi))
    assert stands_at(grid, -1.0, 0.0)
    for k in range(5):
        far = Pose(2.0 * k, 0.0, 0.0)
        grid.step(level_sweep(closed_room(), Pose(0.0, 0.0, 0.0), 1.0 + k), far)
        if k == 2:
            assert stands_at(grid, -1.0, 0.0)
    assert grid.inside(grid.cell_of(8.0, 0.0), config.edge)
    assert grid.evidence.shape == (config.cells, config.cells)
    assert grid.nearest_cell(100.0, 0.0)[0] == config.cells - 1


def test_way_leads_around_the_wall_and_keeps_off_it() -> None:
    grid = MapGrid(GridConfig())
    for x, y in ((0.0, 0.0), (0.5, 1.2), (2.5, 1.2)):
        swept(DIVIDED, grid, Pose(x, y, 0.0))
    config = PlanConfig()
    found = ways(grid, Pose(0.0, -1.0, 0.0), config)
    assert found is not None
    goal = grid.cell_of(3.0, -1.0)
    way = way_to(found, (goal[0] - found.corner[0], goal[1] - found.corner[1]), grid)
    assert math.dist(way[0], (0.0, -1.0)) < 0.1
    assert math.dist(way[-1], (3.0, -1.0)) < 0.1
    beside = way[np.abs(way[:, 0] - 1.5) < 0.1]
    assert (beside[:, 1] > 0.8 + config.room - 0.1).all()
    assert found.cost[goal[0] - found.corner[0], goal[1] - found.corner[1]] > 5.0


def test_exploring_goes_to_the_edge_of_what_was_seen_and_then_where_it_was_long_ago() -> None:
    grid, explorer = MapGrid(GridConfig()), Explorer(ExploreConfig(), PlanConfig())
    for yaw in (0.0, math.pi):
        swept(DIVIDED, grid, Pose(0.0, 0.0, yaw))
    explorer.step(grid, Pose(0.0, 0.0, 0.0), 0.2)
    assert explorer.way[-1][1] > 0.4  # towards the passage
    for x, y, yaw in ((0.0, 0.0, 2.0), (0.5, 1.2, 0.0), (2.5, 1.2, 0.0), (3.0, -1.0, 2.0), (3.0, 0.0, -2.0)):
        swept(DIVIDED, grid, Pose(x, y, yaw), 10.0)
    explorer.step(grid, Pose(3.0, 0.0, -2.0), 20.0)
    last = explorer.way[-1]
    assert len(explorer.way) > 5
    assert not math.dist(last, (3.0, 0.0)) < 0.5


def test_a_goal_that_was_given_up_is_left_alone() -> None:
    grid, explorer = MapGrid(GridConfig()), Explorer(ExploreConfig(), PlanConfig())
    pose = Pose(0.0, 0.0, 0.0)
    swept(DIVIDED, grid, pose)
    explorer.step(grid, pose, 0.2)
    first = explorer.way[-1]
    explorer.give_up(1.0)
    assert len(explorer.way) == 0
    explorer.step(grid, pose, 1.1)
    assert not len(explorer.way) or math.dist(explorer.way[-1], first) >= ExploreConfig().avoid_radius - 0.1


def test_a_goal_off_the_map_is_gone_towards() -> None:
    grid, goal_way = MapGrid(GridConfig()), GoalWay(PlanConfig(), every=1.0, tolerance=0.1)
    open_field = WorldPlan(name="one", seed=0, bounds=(-9.0, -9.0, 9.0, 9.0), solids=(box("b", 0, 3, 1, 1),))
    swept(open_field, grid, Pose(0.0, 0.0, 0.0))
    goal_way.step(np.array((30.0, 0.0)), grid, Pose(0.0, 0.0, 0.0), 0.0)
    assert goal_way.way[-1][0] > 9.0
    assert abs(goal_way.way[10][1]) < 0.3


def test_place_ahead_on_a_way() -> None:
    way = np.column_stack((np.arange(0.0, 3.0, 0.1), np.zeros(30)))
    x, y = route.ahead_on(way, Pose(1.0, 0.2, 0.5 * math.pi), 0.5)
    assert (x, y) == pytest.approx((-0.2, -0.5), abs=1e-9)
    assert route.ahead_on(way, Pose(2.9, 0.0, 0.0), 0.5) == pytest.approx((0.0, 0.0))


def test_robot_turns_before_it_goes_and_glides_at_the_end() -> None:
    config = route.RouteConfig()
    assert route.turning_to(2.0, 0.2, config) == Motion(0.0, 0.0, config.yaw_rate)
    assert route.turning_to(0.0, 0.2, config) == Motion(0.2, 0.0, 0.0)
    side = route.gliding_to((0.0, -0.1), 0.2, config)
    assert (side.x, side.yaw_rate) == (0.0, 0.0)
    assert side.y == pytest.approx(-0.1 * config.glide_gain)
    assert route.gliding_to((3.0, 4.0), 0.1, config) == pytest.approx((0.06, 0.08, 0.0))
    pulled = route.towards((1.0, 0.0), np.array((0.0, 5.0)), 0.2, config)
    assert pulled.yaw_rate > 0.0
    assert route.towards((1.0, 0.0), np.zeros(2), 0.2, config) == Motion(0.2, 0.0, 0.0)


POINTS = np.array(((1.0, 0.0), (2.0, 0.0), (2.0, 1.0)))


def at(waypoints: Waypoints, grid: MapGrid, x: float, y: float, time: float) -> None:
    """One tick with the robot at a place."""
    waypoints.step(grid, Pose(x, y, 0.0), time, 0.15)


def test_waypoints_come_one_after_the_other() -> None:
    grid, waypoints = MapGrid(GridConfig()), Waypoints(WaypointConfig(), PlanConfig())
    swept(closed_room(), grid, Pose(0.0, 0.0, 0.0))
    waypoints.take(POINTS, 0.0)
    at(waypoints, grid, 0.0, 0.0, 0.0)
    assert waypoints.left == 3
    np.testing.assert_allclose(waypoints.way[-1], POINTS[0])
    at(waypoints, grid, 0.93, 0.0, 5.0)
    assert waypoints.left == 2
    at(waypoints, grid, 2.0, 0.0, 10.0)
    at(waypoints, grid, 2.0, 0.93, 15.0)
    assert waypoints.left == 0
    assert waypoints.goal is None
    assert waypoints.reason == ""


def test_a_list_that_grows_is_gone_on_with_and_another_is_begun() -> None:
    grid, waypoints = MapGrid(GridConfig()), Waypoints(WaypointConfig(), PlanConfig())
    swept(closed_room(), grid, Pose(0.0, 0.0, 0.0))
    waypoints.take(POINTS[:2], 0.0)
    at(waypoints, grid, 1.0, 0.0, 1.0)
    waypoints.take(POINTS, 2.0)
    assert waypoints.left == 2
    waypoints.take(POINTS[::-1], 3.0)
    assert waypoints.left == 3
    np.testing.assert_allclose(waypoints.goal, POINTS[2])


def test_waypoints_that_are_no_numbers_are_left_out() -> None:
    grid, waypoints = MapGrid(GridConfig()), Waypoints(WaypointConfig(), PlanConfig())
    waypoints.take(np.array(((np.nan, 0.0), (0.0, np.inf))), 0.0)
    at(waypoints, grid, 0.0, 0.0, 0.0)
    assert waypoints.left == 0
    assert waypoints.reason == "waypoint 1 is not a number; waypoint 2 is not a number"


def test_numbers_that_are_no_pairs_are_no_waypoints() -> None:
    waypoints = Waypoints(WaypointConfig(), PlanConfig())
    for wrong in (np.zeros(3), np.zeros((2, 3)), np.zeros(0)):
        waypoints.take(wrong, 0.0)
        assert waypoints.left == 0


def test_a_waypoint_inside_a_thing_or_behind_walls_is_given_up() -> None:
    plan = closed_room(box("box", 2.0, 0.0, 0.8, 0.8))
    grid, waypoints = MapGrid(GridConfig()), Waypoints(WaypointConfig(), PlanConfig())
    for x, y in ((0.0, 0.0), (2.0, 1.4), (3.3, 0.0), (2.0, -1.4)):
        for yaw in (0.0, math.pi):
            swept(plan, grid, Pose(x, y, yaw))
    waypoints.take(np.array(((2.0, 0.0), (0.0, -9.0), (0.5, 0.0))), 0.0)
    for tick in range(60):
        at(waypoints, grid, 0.0, 0.0, 0.5 * tick)
    assert waypoints.left == 1
    assert waypoints.reason.startswith("waypoint 1 given up: no way to it; waypoint 2 given up")


def test_a_waypoint_that_takes_too_long_is_given_up() -> None:
    grid, waypoints = MapGrid(GridConfig()), Waypoints(WaypointConfig(), PlanConfig())
    swept(closed_room(), grid, Pose(0.0, 0.0, 0.0))
    waypoints.take(POINTS[:1], 0.0)
    for tick in range(200):
        at(waypoints, grid, 0.0, 0.0, 0.5 * tick)
    assert waypoints.left == 0
    assert "given up after" in waypoints.reason


def test_watch_notices_who_stays() -> None:
    watch = StuckWatch(EscapeConfig())
    for tick in range(60):
        rests = watch.rests(Pose(0.001 * tick, 0.0, 0.0), 0.1 * tick, Motion(0.15))
    assert 4.0 < rests < 6.0
    assert watch.rests(Pose(0.5, 0.0, 0.0), 6.0, Motion(0.15)) == 0.0
    assert watch.rests(Pose(0.5, 0.0, 0.3), 6.1, Motion(0.15)) == 0.0
    assert watch.rests(Pose(0.5, 0.0, 0.3), 7.1, Motion(0.15)) == pytest.approx(1.0)


@pytest.mark.parametrize("wanted", [Motion(0.004), Motion(0.0, 0.0, 0.02)])
def test_who_wants_little_is_not_stuck_where_little_happens(wanted: Motion) -> None:
    watch = StuckWatch(EscapeConfig())
    assert max(watch.rests(Pose(0.0, 0.0, 0.0), 0.1 * tick, wanted) for tick in range(100)) == 0.0


def test_who_is_told_to_and_fro_is_not_stuck() -> None:
    watch = StuckWatch(EscapeConfig())
    way = [Motion(0.05 if tick // 5 % 2 else -0.05) for tick in range(100)]
    assert max(watch.rests(Pose(0.0, 0.0, 0.0), 0.1 * k, motion) for k, motion in enumerate(way)) == 0.0


def test_escape_makes_room_turns_backs_off_and_ends_when_away() -> None:
    config, escape = EscapeConfig(), Escape(EscapeConfig())
    here, away = Pose(0.0, 0.0, 0.0), Motion(-0.06, 0.0, 0.0)
    escape.begin(here, 10.0, openness=-1.0)
    assert escape.step(here, 10.1, away) == away
    assert escape.step(here, 10.1, Motion()).yaw_rate < 0.0
    seen = {escape.step(here, 10.0 + 0.1 * k, Motion()) for k in range(140)}
    assert Motion(-config.back_speed, 0.0, 0.0) in seen
    assert any(motion.y for motion in seen)
    assert {motion.yaw_rate for motion in seen} >= {config.yaw_rate, -config.yaw_rate}
    assert escape.active
    assert escape.step(Pose(0.0, 0.0, 1.0), 11.0, away) == Motion()
    assert not escape.active
