import math

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.terrain.comparison import made_ground
from bluefoot_mpc.terrain.cost import CostConfig, cost_tensor, feet, squared_slope, yaw_index, yaw_of
from bluefoot_mpc.types import HeightMap

CONFIG = CostConfig(yaws=12)


def ground(height, cell=0.03):
    height = np.asarray(height, dtype=float)
    return HeightMap(time=0.0, cell=cell, pose=np.zeros(4), height=height, confidence=np.ones_like(height))


def by_loops(made, config):
    """The tensor as the equation says it, cell by cell."""
    n, m = made.height.shape
    slope = squared_slope(made.height, made.cell)
    cost = np.full((n, m, config.yaws), np.inf)
    for u in range(config.yaws):
        gamma = 2.0 * math.pi * u / config.yaws - math.pi
        for i in range(n):
            for j in range(m):
                total, heights = 0.0, []
                for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                    right = 0.5 * config.spacing * np.array((x, y))
                    turned = (
                        right[0] * math.cos(gamma) - right[1] * math.sin(gamma),
                        right[0] * math.sin(gamma) + right[1] * math.cos(gamma),
                    )
                    a, b = i + round(turned[1] / made.cell), j + round(turned[0] / made.cell)
                    if not (0 <= a < n and 0 <= b < m) or np.isnan(made.height[a, b]):
                        break
                    heights.append(made.height[a, b])
                    total += config.k_slope * slope[a, b]
                else:
                    cost[i, j, u] = config.k_var * np.var(heights) + total + config.k_yaw * gamma**2
    return cost


def test_the_tensor_is_the_thesis_equation():
    made = made_ground("half seen", 3, cells=26, cell=0.04)
    expected = by_loops(made, CONFIG)
    assert 0.02 < np.isfinite(expected).mean() < 0.5
    np.testing.assert_allclose(cost_tensor(made, CONFIG), expected, rtol=1e-9, atol=1e-12)


def test_great_heights_do_not_lose_the_variance():
    made = made_ground("rubble", 0, cells=24, cell=0.03)
    raised = ground(made.height + 1000.0)
    np.testing.assert_allclose(cost_tensor(raised, CONFIG), cost_tensor(made, CONFIG), atol=1e-6)


def test_level_ground_costs_only_the_yaw():
    cost = cost_tensor(ground(np.full((20, 20), 0.7)), CONFIG)
    np.testing.assert_allclose(cost[10, 10], yaw_of(np.arange(12), 12) ** 2, atol=1e-12)


def test_a_ramp_costs_its_slope_under_four_feet_and_its_variance():
    rise = 0.2 * 0.03 * np.arange(24)
    cost = cost_tensor(ground(np.tile(rise, (24, 1))), CostConfig(k_var=10.0))
    away = np.rint(0.165 / 0.03) * 0.03
    assert cost[12, 12, 18] == pytest.approx(4.0 * 0.2**2 + 10.0 * (0.2 * away) ** 2)


def test_beyond_the_yaw_range_everything_is_infinite():
    config = CostConfig(yaws=36, yaw_range=math.radians(30.0))
    cost = cost_tensor(ground(np.zeros((20, 20))), config)
    assert np.flatnonzero(np.isfinite(cost[10, 10])).tolist() == list(range(15, 22))


def test_unknown_and_absent_ground_is_infinite():
    assert np.isinf(cost_tensor(ground(np.full((20, 20), np.nan)), CONFIG)).all()
    assert np.isinf(cost_tensor(ground(np.full((20, 20), np.inf)), CONFIG)).all()
    assert np.isinf(cost_tensor(ground(np.zeros((5, 5))), CONFIG)).all()


@pytest.mark.parametrize("yaws", [1, 7, 36])
def test_yaw_indices_and_angles_agree(yaws):
    for u in range(yaws):
        assert yaw_index(float(yaw_of(u, yaws)) + 2.0 * math.pi, yaws) == u


def test_feet_turn_with_the_yaw():
    np.testing.assert_allclose(feet(0.3, np.array(math.pi / 2.0))[0], (-0.15, 0.15))


def test_slopes_stop_at_the_unknown():
    height = np.array([[0.0, 0.01, np.nan, 0.05], [0.0, 0.01, np.nan, 0.05], [0.0, 0.01, np.nan, 0.05]])
    slope = squared_slope(height, 0.1)
    np.testing.assert_allclose(slope[:, :2], 0.01)
    assert np.isnan(slope[:, 2]).all()
    assert (slope[:, 3] == 0.0).all()


@pytest.mark.parametrize(
    "values", [{"spacing": 0.0}, {"k_var": -1.0}, {"yaws": 0}, {"yaw_range": 4.0}, {"k_yaw": math.nan}]
)
def test_impossible_weights_are_refused(values):
    with pytest.raises(ConfigurationError):
        CostConfig(**values)


def test_straight_ahead_is_one_of_the_yaws():
    with pytest.raises(ConfigurationError, match="even"):
        CostConfig(yaws=35)
