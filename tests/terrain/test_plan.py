import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.cost import feet
from bluefoot_mpc.terrain.frame import centres, heights_at
from bluefoot_mpc.terrain.plan import PlanConfig, plan_route
from bluefoot_mpc.terrain.treads import TreadConfig, treads
from bluefoot_mpc.types import HeightMap

START, GOAL = (0.0, 0.0, 0.0), (1.5, 0.0)
CONFIG = PlanConfig()


def ground(of, size=(1.6, 2.4), pose=(-0.4, -0.8, 0.0, 0.0), cell=0.02):
    """A map of heights that are a function of x and y (m, odometry frame)."""
    empty = np.zeros((round(size[0] / cell), round(size[1] / cell)))
    made = HeightMap(time=0.0, cell=cell, pose=np.array(pose), height=empty, confidence=np.ones_like(empty))
    x, y = np.moveaxis(centres(made), -1, 0)
    height = np.asarray(of(x, y)) * np.ones_like(empty) - pose[2]
    return HeightMap(time=0.0, cell=cell, pose=np.array(pose), height=height, confidence=np.ones_like(empty))


def level(x, y):
    return np.zeros_like(x)


def check_route(route, made, config=CONFIG):
    """Every place of the route has ground that is known within reach of all feet."""
    assert route.feasible
    assert np.isfinite(route.poses).all()
    assert (np.hypot(*np.diff(route.poses[:, :2], axis=0).T) < 0.09).all()
    assert (np.abs(np.diff(route.poses[:, 2])) < 0.25).all()
    around = np.linspace(-0.08, 0.08, 9)
    near = np.stack(np.meshgrid(around, around), axis=-1).reshape(-1, 2)
    near = near[np.hypot(*near.T) <= config.treads.reach + 0.5 * config.cell * math.sqrt(2.0) + 0.01]
    for x, y, yaw in route.poses[1:]:
        places = np.array((x, y)) + feet(config.cost.spacing, np.array(yaw))
        known = np.isfinite(heights_at(made, places[:, None] + near)).any(axis=1)
        known |= np.hypot(*places.T) < config.even_radius + 0.06
        assert known.all(), (x, y)


@pytest.mark.parametrize("planner", ["optimal", "window"])
def test_level_ground_is_crossed_straight(planner):
    route = plan_route(ground(level), START, GOAL, PlanConfig(planner=planner))
    assert route.reaches_goal
    assert route.reason == ""
    assert route.planner == planner
    np.testing.assert_allclose(route.poses[0], START, atol=1e-9)
    np.testing.assert_allclose(route.poses[-1], (*GOAL, 0.0), atol=1e-9)
    np.testing.assert_allclose(route.poses[:, 1:], 0.0, atol=1e-9)


def test_a_turned_map_and_start_give_the_same_way():
    """The plan depends on where things are, not on how the map lies."""
    turned = ground(level, size=(3.6, 3.6), pose=(0.3, -2.2, 0.4, 0.5))
    config = PlanConfig(even_radius=0.0)
    route = plan_route(turned, (0.2, 0.3, 0.9), (0.9, 1.2), config)
    assert route.reaches_goal
    check_route(route, turned, config)
    np.testing.assert_allclose(route.poses[0], (0.2, 0.3, 0.9))
    np.testing.assert_allclose(route.poses[-1, :2], (0.9, 1.2), atol=1e-9)
    assert route.poses[-1, 2] == pytest.approx(math.atan2(0.9, 0.7), abs=0.05)


def test_the_route_ends_where_known_ground_ends():
    made = ground(lambda x, y: np.where(x < 1.1, 0.0, np.nan))
    route = plan_route(made, START, GOAL, CONFIG)
    check_route(route, made)
    assert not route.reaches_goal
    assert "before the goal" in route.reason
    assert "unknown" in route.reason
    assert 1.1 - 0.158 - 0.05 < route.poses[-1, 0] < 1.1 - 0.158 + 0.08


def test_nothing_is_known_but_the_start():
    made = ground(lambda x, y: np.full_like(x, np.nan))
    route = plan_route(made, START, GOAL, CONFIG)
    assert route.feasible
    assert 0.15 < route.poses[-1, 0] < 0.45 - 0.1
    blind = plan_route(made, START, GOAL, PlanConfig(even_radius=0.0))
    assert not blind.feasible
    assert blind.poses.shape == (0, 3)
    assert blind.cost == math.inf
    assert "FL, FR, RL, RR at the start is unknown: sweep again" in blind.reason


def test_a_start_with_one_foot_on_the_unknown_is_refused():
    made = ground(lambda x, y: np.where((x > 0.0) & (y > 0.05), np.nan, 0.0))
    route = plan_route(made, START, GOAL, PlanConfig(even_radius=0.0))
    assert not route.feasible
    assert "under FL at" in route.reason


def test_a_block_too_high_is_gone_round():
    """A block as wide as the robot, to one side: its rim is a step that no foot takes."""
    made = ground(lambda x, y: np.where((np.abs(x - 0.8) < 0.1) & (y > 0.10), 0.12, 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    check_route(route, made)
    assert route.reaches_goal
    assert route.poses[:, 1].min() < -0.02


def test_a_post_between_the_feet_is_not_passed_over():
    made = ground(lambda x, y: np.where((np.abs(x - 0.8) < 0.03) & (np.abs(y) < 0.03), 0.09, 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    assert route.reaches_goal
    near = np.abs(route.poses[:, 0] - 0.8) < 0.08
    assert np.abs(route.poses[near, 1]).min() > 0.08


def test_a_wall_ends_the_route():
    made = ground(lambda x, y: np.where(np.abs(x - 1.0) < 0.05, 0.10, 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    assert route.feasible
    assert not route.reaches_goal
    assert "too steep or too high" in route.reason
    assert route.poses[-1, 0] < 0.95 - 0.158 + 0.03


def test_a_wall_right_ahead_leaves_no_way():
    made = ground(lambda x, y: np.where(x > 0.20, 0.10, 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    assert not route.feasible
    assert "no way ahead" in route.reason


def test_a_goal_in_an_obstacle_is_passed_beside():
    made = ground(lambda x, y: np.where(np.hypot(x - 1.5, y) < 0.13, 0.2, 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    assert route.feasible
    assert route.reaches_goal
    assert "beside the goal" in route.reason
    assert route.poses[-1, 0] == pytest.approx(1.5)
    assert 0.1 < abs(route.poses[-1, 1]) <= 0.4


def test_steep_ground_is_not_walked():
    steep = ground(lambda x, y: np.clip(x - 0.8, 0.0, None) * math.tan(math.radians(35.0)))
    gentle = ground(lambda x, y: np.clip(x - 0.8, 0.0, None) * math.tan(math.radians(15.0)))
    assert not plan_route(steep, START, GOAL, CONFIG).reaches_goal
    assert plan_route(gentle, START, GOAL, CONFIG).reaches_goal


def test_stones_and_kerbs_are_crossed():
    """Stones of 0.12 m with gaps of 0.06 m, and a kerb of 25 mm."""
    stones = ground(lambda x, y: np.where((x < 0.45) | ((x % 0.18 < 0.12) & (y % 0.18 < 0.12)), 0.0, -0.08))
    kerb = ground(lambda x, y: np.where(x > 0.8, 0.025, 0.0))
    assert plan_route(stones, START, GOAL, CONFIG).reaches_goal
    assert plan_route(kerb, START, GOAL, CONFIG).reaches_goal


def test_a_wide_gap_is_not():
    made = ground(lambda x, y: np.where((x > 0.7) & (x < 1.0), -0.08, 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    assert not route.reaches_goal
    assert route.poses[-1, 0] < 0.7 - 0.158 + 0.08


def test_cells_rated_as_none_are_no_treads():
    made = ground(level)
    quality = np.where(centres(made)[..., 0] > 1.0, 0.0, 1.0)
    route = plan_route(made, START, GOAL, CONFIG, quality)
    assert not route.reaches_goal
    assert route.poses[-1, 0] < 1.0


def test_the_smoother_side_is_taken():
    """Rough on the left of the way, even on the right."""
    rng = np.random.default_rng(2)
    made = ground(lambda x, y: np.where((x > 0.5) & (y > -0.1), rng.uniform(0.0, 0.02, x.shape), 0.0))
    route = plan_route(made, START, GOAL, CONFIG)
    check_route(route, made)
    assert route.poses[:, 1].min() < -0.1


def test_bad_numbers_and_goals():
    made = ground(level)
    for start, goal in (((0.0, math.nan, 0.0), GOAL), (START, (math.inf, 0.0))):
        route = plan_route(made, start, goal, CONFIG)
        assert not route.feasible
        assert "no number" in route.reason
    here = plan_route(made, START, (0.01, 0.0), CONFIG)
    assert here.reaches_goal
    assert len(here.poses) == 1
    behind = plan_route(made, START, (-0.1, 0.0), CONFIG)
    assert behind.feasible
    far = plan_route(made, START, (50.0, 0.0), CONFIG)
    assert not far.reaches_goal
    assert "before the goal" in far.reason
    short = plan_route(made, START, GOAL, PlanConfig(horizon=0.5))
    assert not short.reaches_goal
    assert "ends 1.03 m before the goal: further is not planned at once" in short.reason
    away = plan_route(made, (5.0, 5.0, 0.0), (6.0, 5.0), CONFIG)
    assert not away.feasible


def test_an_empty_map_and_absurd_heights():
    nothing = HeightMap(
        time=0.0, cell=0.02, pose=np.zeros(4), height=np.zeros((0, 0)), confidence=np.zeros((0, 0))
    )
    empty = plan_route(nothing, START, GOAL, CONFIG)
    assert not empty.feasible
    assert "empty" in empty.reason
    endless = ground(lambda x, y: np.where(x > 0.5, np.inf, 0.0))
    assert not plan_route(endless, START, GOAL, CONFIG).reaches_goal
    spikes = ground(lambda x, y: np.where((x > 0.5) & ((x * 50).astype(int) % 3 == 0), 1e9, 0.0))
    assert not plan_route(spikes, START, GOAL, CONFIG).reaches_goal


def test_plans_are_the_same_again():
    rng = np.random.default_rng(5)
    made = ground(lambda x, y: rng.uniform(0.0, 0.02, x.shape))
    one, two = (plan_route(made, START, GOAL, CONFIG) for _ in range(2))
    assert (one.poses == two.poses).all()
    assert one.cost == two.cost


def test_treads_are_the_best_places_near_by():
    height = np.zeros((11, 11))
    height[5, 5] = 0.03
    found = treads(height, 0.02, TreadConfig())
    assert found.height[5, 5] == 0.0
    assert found.slope[5, 5] == 0.0
    height[:] = np.nan
    height[2, 2] = 0.01
    found = treads(height, 0.02, TreadConfig(reach=0.04))
    assert found.known.sum() == np.isfinite(found.height).sum() == 13


@pytest.mark.parametrize(
    "values", [{"planner": "guess"}, {"cell": 0.0}, {"window": 0}, {"side": -1.0}, {"max_under": math.nan}]
)
def test_impossible_settings_are_refused(values):
    with pytest.raises(ConfigurationError):
        PlanConfig(**values)
