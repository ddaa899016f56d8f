"""The guard lets pass what stays clear, and finds something near it otherwise."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.navigation.guard import Guard, GuardConfig
from bluefoot_mpc.navigation.limits import LimitConfig, Motion, allowed, ramped
from bluefoot_mpc.navigation.outline import Foresight, OutlineConfig, RampConfig, closest, distances
from bluefoot_mpc.types import FloatArray

CONFIG = GuardConfig()
OUTLINE = CONFIG.outline
NOWHERE = np.zeros((0, 2))


def wall_ahead(gap: float) -> FloatArray:
    """(n, 2) points of a wall across the way, `gap` before the outline."""
    x = OUTLINE.half_length + OUTLINE.rounding + gap
    return np.column_stack((np.full(101, x), np.linspace(-1.0, 1.0, 101)))


def glided(points: FloatArray, wanted: Motion, seconds: float) -> float:
    """Least clearance of a robot that follows the guard exactly, by the gait's ramps."""
    guard, ramp, now = Guard(CONFIG), CONFIG.ramp, Motion()
    x = y = yaw = 0.0
    least, motion = math.inf, Motion()
    for tick in range(round(seconds / 0.02)):
        cos, sin = math.cos(yaw), math.sin(yaw)
        rel = (points - (x, y)) @ np.array(((cos, -sin), (sin, cos)))
        if tick % 5 == 0:
            motion = guard.step(rel, wanted, now).motion
        now = ramp.followed(now, motion, 0.02)
        x += (cos * now.x - sin * now.y) * 0.02
        y += (sin * now.x + cos * now.y) * 0.02
        yaw += now.yaw_rate * 0.02
        least = min(least, float(distances(rel, OUTLINE).min()))
    return least


def test_the_open_lets_everything_pass() -> None:
    wanted = Motion(0.2, 0.0, 0.3)
    found = Guard(CONFIG).step(NOWHERE, wanted, Motion())
    assert found.motion == wanted
    assert math.isinf(found.clearance)


def test_a_wall_ahead_is_not_walked_into() -> None:
    guard = Guard(CONFIG)
    found = guard.step(wall_ahead(0.16), Motion(0.15, 0.0, 0.0), Motion(0.15, 0.0, 0.0))
    assert found.motion.x < 0.05
    assert found.clearance == pytest.approx(0.16)


@pytest.mark.parametrize("wanted", [(0.2, 0.0, 0.0), (0.15, 0.0, 0.4), (0.0, 0.0, 0.5), (-0.08, 0.0, 0.0)])
@pytest.mark.parametrize("seed", range(4))
def test_no_motion_comes_nearer_than_the_least_distance(
    seed: int, wanted: tuple[float, float, float]
) -> None:
    rng = np.random.default_rng(seed)
    around = rng.uniform(-2.0, 2.0, (60, 2))
    around = around[distances(around, OUTLINE) > 0.25]
    assert glided(around, Motion(*wanted), 20.0) >= CONFIG.least - 0.01


def test_who_is_too_near_may_leave_but_not_come_nearer() -> None:
    guard = Guard(CONFIG)
    wall = wall_ahead(0.05)
    assert guard.step(wall, Motion(-0.08, 0.0, 0.0), Motion()).motion.x < 0.0
    assert guard.step(wall, Motion(0.08, 0.0, 0.0), Motion()).motion.x <= 0.0
    assert guard.away(wall, Motion()).x < 0.0


def test_between_walls_that_touch_it_the_robot_stands() -> None:
    points = np.concatenate([wall_ahead(0.02), -wall_ahead(0.02), wall_ahead(0.02)[:, ::-1],
                             -wall_ahead(0.02)[:, ::-1]])  # fmt: skip
    found = Guard(CONFIG).step(points, Motion(0.1, 0.0, 0.0), Motion())
    assert found.stopped
    assert not any(found.motion)


def test_distances_to_a_box_with_round_corners() -> None:
    config = OutlineConfig(half_length=0.2, half_width=0.1, rounding=0.05)
    points = np.array([(0.45, 0.0), (0.0, -0.35), (0.2 + 0.3, 0.1 + 0.4)])
    np.testing.assert_allclose(distances(points, config), (0.2, 0.2, 0.45))


def test_foresight_follows_the_ramps_to_a_stop() -> None:
    config = RampConfig(step=0.01, steps=400)
    places = Foresight(config).places(Motion(0.1, 0.0, 0.0), np.array([(0.1, 0.0, 0.0), (0.0, 0.0, 0.5)]))
    # Held for 0.4 s and braked at 0.1 m/s²: v t + v² / 2 a.
    assert places.x[0, -1] == pytest.approx(0.1 * 0.4 + 0.1**2 / 0.2, abs=1e-3)
    assert places.yaw[0, -1] == 0.0
    # The turn is reached in part only before it is braked: a triangle of 0.4 rad/s.
    assert places.yaw[1, -1] == pytest.approx(0.4 * 0.4, abs=5e-3)
    coarse = Foresight(RampConfig()).places(Motion(0.1, 0.0, 0.0), np.array([(0.1, 0.0, 0.4)]))
    fine = Foresight(RampConfig(step=0.01, steps=180)).places(
        Motion(0.1, 0.0, 0.0), np.array([(0.1, 0.0, 0.4)])
    )
    assert math.hypot(coarse.x[0, -1] - fine.x[0, -1], coarse.y[0, -1] - fine.y[0, -1]) < 0.01
    assert coarse.yaw[0, -1] == pytest.approx(fine.yaw[0, -1], abs=0.02)


def test_a_single_motion_leads_where_it_leads_among_others() -> None:
    foresight, rng = Foresight(RampConfig()), np.random.default_rng(2)
    for _ in range(20):
        now, wanted = (Motion(*(rng.uniform(-1.0, 1.0, 3) * (0.2, 0.06, 0.5))) for _ in range(2))
        one, among = foresight.place(now, wanted), foresight.places(now, np.array((wanted,)))
        np.testing.assert_allclose(np.array(one), np.array(among), atol=1e-12)


def test_closest_equals_a_loop_over_places_and_points() -> None:
    rng = np.random.default_rng(1)
    points = rng.uniform(-1.0, 1.0, (30, 2))
    where = Foresight(CONFIG.ramp).places(Motion(0.1, 0.0, 0.2), rng.uniform(-0.3, 0.3, (5, 3)))
    found = closest(points, where, OUTLINE)
    for k, s in np.ndindex(*where.x.shape):
        cos, sin = math.cos(where.yaw[k, s]), math.sin(where.yaw[k, s])
        rel = (points - (where.x[k, s], where.y[k, s])) @ np.array(((cos, -sin), (sin, cos)))
        assert found[k, s] == pytest.approx(float(distances(rel, OUTLINE).min()), abs=1e-5)


def test_no_part_of_the_robot_gets_farther_than_the_reach() -> None:
    foresight, rng = Foresight(CONFIG.ramp), np.random.default_rng(0)
    corners = np.array([(x, y) for x in (-0.21, 0.21) for y in (-0.21, 0.21)])
    for _ in range(50):
        now, wanted = (Motion(*(rng.uniform(-1.0, 1.0, 3) * (0.2, 0.06, 0.5))) for _ in range(2))
        places = foresight.places(now, np.array((wanted,)))
        cos, sin = np.cos(places.yaw[0]), np.sin(places.yaw[0])
        x = cos[:, None] * corners[:, 0] - sin[:, None] * corners[:, 1] + places.x[0][:, None]
        y = sin[:, None] * corners[:, 0] + cos[:, None] * corners[:, 1] + places.y[0][:, None]
        gone = np.hypot(x - corners[:, 0], y - corners[:, 1]).max()
        assert gone <= foresight.reach(now, wanted) + 1e-9


def test_closest_without_points_is_infinite() -> None:
    places = Foresight(CONFIG.ramp).places(Motion(), np.zeros((3, 3)))
    assert np.isinf(closest(NOWHERE, places, OUTLINE)).all()


def test_limits_scale_speed_and_turn_together() -> None:
    config = LimitConfig()
    motion = allowed(Motion(1.0, 0.0, 1.0), 0.3, config)
    assert math.hypot(motion.x, motion.y) + config.lever * motion.yaw_rate <= config.edge_speed + 1e-12
    assert allowed(Motion(0.5, 0.0, 0.0), 0.1, config) == Motion(0.1, 0.0, 0.0)
    assert allowed(Motion(-0.5, 0.0, 0.0), 0.05, config) == Motion(-0.05, 0.0, 0.0)
    assert allowed(Motion(), 0.1, config) == Motion()


def test_ramps_limit_what_speeds_up_and_let_go_at_once() -> None:
    config = LimitConfig(acceleration=0.3, yaw_acceleration=1.5)
    assert ramped(Motion(), Motion(0.2, 0.0, -0.5), 0.1, config) == pytest.approx((0.03, 0.0, -0.15))
    assert ramped(Motion(0.2, 0.0, 0.0), Motion(), 0.02, config) == Motion()
    assert ramped(Motion(0.2, 0.0, 0.0), Motion(-0.2, 0.0, 0.0), 0.1, config).x == pytest.approx(-0.03)
