import itertools
import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.terrain.comparison import compare, made_ground, spread_starts
from bluefoot_mpc.terrain.cost import CostConfig, cost_tensor
from bluefoot_mpc.terrain.graph import optimal, reachable
from bluefoot_mpc.terrain.lattice import Goal, path_cost
from bluefoot_mpc.terrain.smoothing import SmoothingConfig, poses, smooth
from bluefoot_mpc.terrain.windows import WINDOWS, Aim, search
from bluefoot_mpc.types import HeightMap


def cheapest(cost, start, goal):
    """Cost of the cheapest way, layer by layer: another algorithm than the one tested."""
    n, _, turns = cost.shape
    last = cost.shape[1] - 1 if goal.j is None else goal.j
    paid = {(start[0], start[2]): cost[start]}
    for j in range(start[1] + 1, last + 1):
        ahead = {}
        for (i, u), so_far in paid.items():
            for a, b in itertools.product((i - 1, i, i + 1), (u - 1, u, u + 1)):
                if 0 <= a < n and 0 <= b < turns:
                    ahead[a, b] = min(ahead.get((a, b), math.inf), so_far + cost[a, j, b])
        paid = ahead
    return min(
        (c for (i, u), c in paid.items() if goal.i in (None, i) and goal.u in (None, u)), default=math.inf
    )


def by_trying_all(cost, start, goal):
    best = math.inf
    steps = goal.j - start[1]
    for moves in itertools.product(itertools.product((-1, 0, 1), repeat=2), repeat=steps):
        i, j, u = start
        total = cost[start]
        for di, du in moves:
            i, j, u = i + di, j + 1, u + du
            if not (0 <= i < cost.shape[0] and 0 <= u < cost.shape[2]):
                break
            total += cost[i, j, u]
        else:
            if goal.i in (None, i) and goal.u in (None, u):
                best = min(best, total)
    return best


def tensors(count, shape):
    """Random tensors, among them ones with ties, zeros, infinite cells and great ranges."""
    for seed in range(count):
        rng = np.random.default_rng(seed)
        cost = rng.random(shape)
        if seed % 5 == 1:
            cost = rng.integers(0, 3, shape).astype(float)
        elif seed % 5 == 2:
            cost[rng.random(shape) < 0.4] = np.inf
        elif seed % 5 == 3:
            cost = 10.0 ** rng.uniform(-6, 6, shape)
        elif seed % 5 == 4:
            cost = np.where(rng.random(shape) < 0.5, 0.0, cost)
            cost[rng.random(shape) < 0.3] = np.inf
        cost[shape[0] // 2, 0, shape[2] // 2] = 0.5
        yield seed, cost


def check_way(way, cost, start, goal):
    assert tuple(way.cells[0]) == start
    moves = np.diff(way.cells, axis=0)
    assert (moves[:, 1] == 1).all()
    assert (np.abs(moves[:, ::2]) <= 1).all()
    if way.reached:
        assert way.cells[-1, 1] == (cost.shape[1] - 1 if goal.j is None else goal.j)
        assert goal.i in (None, way.cells[-1, 0])
        assert goal.u in (None, way.cells[-1, 2])
        assert way.cost == path_cost(cost, way.cells) < math.inf
        assert not way.reason
    else:
        assert way.cost == math.inf
        assert way.reason


def test_a_star_is_the_best_of_all_ways():
    for seed, cost in tensors(10, (3, 5, 3)):
        for goal in (Goal(4), Goal(3, 0, 2)):
            way = optimal(cost, (1, 0, 1), goal)
            check_way(way, cost, (1, 0, 1), goal)
            assert way.cost == pytest.approx(by_trying_all(cost, (1, 0, 1), goal), rel=1e-12), seed


def test_a_star_finds_what_layers_find():
    for seed, cost in tensors(10, (9, 14, 7)):
        for goal in (Goal(), Goal(12, 2), Goal(13, None, 1)):
            way = optimal(cost, (4, 0, 3), goal)
            check_way(way, cost, (4, 0, 3), goal)
            assert way.cost == pytest.approx(cheapest(cost, (4, 0, 3), goal), rel=1e-9), seed


def test_no_window_is_cheaper_than_a_star():
    for seed, cost in tensors(15, (21, 24, 5)):
        for goal in (Goal(), Goal(23, 5)):
            best = optimal(cost, (10, 0, 2), goal).cost
            for window, aim in itertools.product(WINDOWS, Aim):
                way = search(cost, (10, 0, 2), goal, window, aim=aim)
                check_way(way, cost, (10, 0, 2), goal)
                assert best <= way.cost * (1.0 + 1e-12), (seed, window)


def test_a_wall_with_one_door_is_found():
    cost = np.ones((41, 30, 5))
    cost[:, 20] = np.inf
    cost[2, 20, 4] = 1.0
    way = optimal(cost, (20, 0, 2))
    assert way.cost == 30.0
    assert tuple(way.cells[20]) == (2, 20, 4)


def test_no_way_is_said():
    cost = np.ones((9, 12, 5))
    cost[:, 6] = np.inf
    assert "no way" in optimal(cost, (4, 0, 2)).reason
    stuck = search(cost, (4, 0, 2), window=3)
    assert not stuck.reached
    assert stuck.cells[-1, 1] == 5
    assert "can be stepped towards" in stuck.reason
    cost[4, 0, 2] = np.inf
    assert "first cell" in optimal(cost, (4, 0, 2)).reason
    assert "first cell" in search(cost, (4, 0, 2)).reason
    assert "no way" in optimal(np.ones((30, 4, 3)), (0, 0, 0), Goal(3, 20)).reason
    assert not search(np.ones((30, 4, 3)), (0, 0, 0), Goal(3, 20)).reached


def test_a_way_of_one_cell():
    cost = np.full((3, 4, 3), 0.25)
    assert optimal(cost, (1, 3, 1)).cost == search(cost, (1, 3, 1)).cost == 0.25


def test_level_ground_is_crossed_straight():
    for window, aim in itertools.product(WINDOWS, Aim):
        way = search(np.full((50, 40, 9), 0.1), (25, 0, 4), window=window, aim=aim)
        assert (way.cells[:, 0] == 25).all()
        assert (way.cells[:, 2] == 4).all()


def test_the_thesis_rule_steps_towards_the_cheapest_cell():
    cost = np.ones((21, 12, 5))
    cost[7, 5, 3] = 0.0
    way = search(cost, (10, 0, 2), window=5, aim=Aim.CELL)
    assert way.cells[:6].tolist() == [[10, 0, 2], [9, 1, 3], [8, 2, 3], [7, 3, 3], [7, 4, 3], [7, 5, 3]]
    shorter = search(cost, (10, 0, 2), window=4, aim=Aim.CELL)
    assert shorter.cells[:3].tolist() == [[10, 0, 2], [10, 1, 2], [9, 2, 3]]
    assert (search(cost, (10, 0, 2), window=2, aim=Aim.CELL).cells[:, 0] == 10).all()


def test_what_lies_behind_the_goal_does_not_count():
    cost = np.ones((21, 12, 5))
    cost[7, 5:] = 0.0
    for aim in Aim:
        assert (search(cost, (10, 0, 2), Goal(4), 8, aim=aim).cells[:, 0] == 10).all()


def test_the_other_rule_asks_what_lies_between():
    cost = np.ones((21, 12, 5))
    cost[7, 5] = 0.0
    cost[6:10, 1:4] = 9.0
    assert search(cost, (10, 0, 2), window=5, aim=Aim.CELL).cells[1, 0] == 9
    assert search(cost, (10, 0, 2), window=5, aim=Aim.MEAN).cells[1, 0] == 10


def test_the_yaw_index_does_not_wrap():
    cost = np.ones((5, 8, 6))
    cost[:, 1:, 5] = 0.0
    assert (optimal(cost, (2, 0, 0)).cells[1:4, 2] == [1, 2, 3]).all()


@pytest.mark.parametrize(
    ("start", "goal"),
    [((5, 0, 0), Goal()), ((0, 0, -1), Goal()), ((0, 2, 0), Goal(1)), ((0, 0, 0), Goal(9)),
     ((0, 0, 0), Goal(3, 7)), ((0, 0, 0), Goal(3, 0, 3))],
)  # fmt: skip
def test_cells_off_the_tensor_are_refused(start, goal):
    for plan in (optimal, search):
        with pytest.raises(ConfigurationError, match="cost tensor|goal column"):
            plan(np.ones((5, 4, 3)), start, goal)


def test_what_can_be_reached():
    cost = np.ones((9, 6, 5))
    cost[:, 3] = np.inf
    cost[0, 3, 2] = 1.0
    found = reachable(cost, (3, 0, 2))
    assert found[:, 3].sum() == 1
    assert found[:, 5].any(axis=1).tolist() == [True] * 3 + [False] * 6
    assert not reachable(cost, (4, 0, 2))[:, 3].any()


def ratios(names, seeds, aim, windows=WINDOWS):
    """(s, w) cost of the windows' ways over the optimum, over all starts from which every window arrives."""
    rows = []
    for name, seed in itertools.product(names, range(seeds)):
        cost = cost_tensor(made_ground(name, seed, cells=80), CostConfig(yaw_range=math.radians(60.0)))
        rows.append(compare(cost, spread_starts(cost, 12, 18), Goal(68), windows, aim).ratio)
    found = np.concatenate(rows)
    return found[np.isfinite(found).all(axis=1)]


def test_larger_windows_find_cheaper_ways():
    ratio = ratios(("rubble", "scattered", "large blocks", "measured", "half seen"), 2, Aim.MEAN)
    assert len(ratio) >= 32
    assert (ratio >= 1.0 - 1e-9).all()
    one, five, fifteen, thirty = ratio.mean(axis=0)
    assert max(fifteen, thirty) < five < one


def test_the_cheapest_cell_alone_is_a_poor_aim():
    one, thirty = ratios(("rubble", "scattered"), 1, Aim.CELL, (1, 30)).mean(axis=0)
    assert one < thirty


def test_starts_are_spread_over_free_cells():
    cost = np.ones((20, 3, 3))
    cost[:10] = np.inf
    assert [i for i, _, _ in spread_starts(cost, 0, 1)] == [12, 14, 15, 17]
    assert spread_starts(np.full((4, 2, 1), np.inf), 0, 0) == []
    with pytest.raises(UnknownNameError, match="rubble"):
        made_ground("swamp", 0)


def jaggedness(places):
    return float((np.diff(places[:, ::2], 2, axis=0) ** 2).sum())


def test_smooth_ways_are_smoother_and_stay_on_finite_cells():
    for seed in range(2):
        cost = cost_tensor(made_ground("half seen", seed), CostConfig(yaw_range=math.radians(40.0)))
        for way in (optimal(cost, (50, 12, 18), Goal(88)), search(cost, (50, 12, 18), Goal(88), 15)):
            places = smooth(way, cost, SmoothingConfig())
            assert jaggedness(places) < 0.5 * jaggedness(way.cells.astype(float))
            assert (places[[0, -1]] == way.cells[[0, -1]]).all()
            assert np.abs(places - way.cells).max() <= SmoothingConfig().freedom
            i, j, u = np.rint(places).astype(int).T
            assert np.isfinite(cost[i, j, u]).all()


def test_a_corridor_is_not_cut():
    cost = np.full((40, 41, 3), np.inf)
    corner = np.concatenate((np.full(20, 10), np.arange(10, 31)))
    cost[corner, np.arange(41)] = 1.0
    way = optimal(cost, (10, 0, 1))
    places = smooth(way, cost, SmoothingConfig(stiffness=1e6, freedom=30.0))
    assert (np.rint(places[:, 0]) == corner).all()


def test_ways_in_the_world():
    pose = np.array((1.0, 2.0, 0.0, math.pi / 2.0))
    ground = HeightMap(time=0.0, cell=0.1, pose=pose, height=np.zeros((5, 5)), confidence=np.ones((5, 5)))
    found = poses(np.array(((0.0, 3.0, 18.0), (1.5, 3.0, 21.0))), ground, 36)
    expected = [(0.95, 2.35, math.pi / 2.0), (0.80, 2.35, math.pi / 2.0 + math.radians(30.0))]
    np.testing.assert_allclose(found, expected)
