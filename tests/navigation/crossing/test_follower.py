"""Following a route."""

import math

import numpy as np
import pytest

from bluefoot_mpc.navigation.crossing.follower import FeetCentre, FollowerConfig, steer
from bluefoot_mpc.navigation.crossing.pace import PaceConfig, paces
from bluefoot_mpc.types import HeightMap

CONFIG = FollowerConfig()


def straight(length=1.0, yaw=0.0):
    x = np.linspace(0.0, length, 26)
    return np.column_stack((x, np.zeros_like(x), np.full_like(x, yaw)))


def bent():
    angle = np.linspace(0.0, 1.0, 40)
    return np.column_stack((np.sin(angle), 1.0 - np.cos(angle), angle))


def walked(route, place, yaw, seconds, speed=0.03, dt=0.1):
    place = np.array(place, dtype=float)
    for _ in range(round(seconds / dt)):
        steering = steer(route, place, yaw, speed, CONFIG)
        c, s = math.cos(yaw), math.sin(yaw)
        x, y = steering.velocity
        place += dt * np.array((c * x - s * y, s * x + c * y))
        yaw += dt * steering.yaw_rate
        if steering.left == 0.0:
            break
    return place, yaw, steering


@pytest.mark.parametrize("start", [(0.0, 0.0), (0.0, 0.06), (0.1, -0.05)])
def test_a_route_is_met_and_followed_to_its_end(start):
    place, yaw, steering = walked(straight(), start, 0.2, 60.0)
    assert steering.left == 0.0
    assert place == pytest.approx([1.0, 0.0], abs=0.03)
    assert yaw == pytest.approx(0.0, abs=0.05)


def test_a_bend_is_followed_with_its_yaw():
    place, yaw, steering = walked(bent(), (0.0, 0.0), 0.0, 60.0)
    assert steering.left == 0.0
    assert place == pytest.approx(bent()[-1, :2], abs=0.03)
    assert yaw == pytest.approx(1.0, abs=0.12)


def test_speed_sideways_motion_and_turning_are_bounded():
    steering = steer(straight(yaw=1.0), np.array([0.2, 0.3]), 0.0, 0.03, CONFIG)
    assert np.hypot(*steering.velocity) <= 0.03 + 1e-12
    assert abs(steering.velocity[1]) <= CONFIG.max_aside + 1e-12
    assert steering.yaw_rate == pytest.approx(CONFIG.max_yaw_rate)


def test_who_overshot_does_not_turn_back():
    steering = steer(straight(), np.array([1.05, 0.04]), 0.0, 0.03, CONFIG)
    assert steering.left == 0.0
    assert not steering.velocity.any()


def test_a_single_pose_is_the_end():
    assert steer(straight()[:1], np.array([0.5, 0.5]), 0.0, 0.03, CONFIG).left == 0.0


def test_the_middle_of_the_feet_is_smoothed():
    centre = FeetCentre(0.5)
    feet = np.zeros((4, 3))
    assert centre.step(feet, 0.02).tolist() == [0.0, 0.0]
    feet[0, 0] = 0.08
    assert centre.step(feet, 0.02)[0] == pytest.approx(0.02 * 0.02 / 0.5)
    centre.reset()
    assert centre.step(feet, 0.02)[0] == pytest.approx(0.02)


def test_rough_ground_is_slow_and_unknown_ground_does_not_count():
    config = PaceConfig()
    height = np.zeros((60, 100))
    height[:, 50:] = 0.05 * (np.indices((60, 50)).sum(axis=0) % 2)
    height[:, :10] = np.nan
    ground = HeightMap(
        time=0.0,
        cell=0.02,
        pose=np.array([-0.4, -0.6, 0.0, 0.0]),
        height=height,
        confidence=np.ones((60, 100)),
    )
    found = paces(ground, np.array([(0.0, 0.0, 0.0), (1.2, 0.0, 0.0), (9.0, 9.0, 0.0)]), config)
    assert found.tolist() == pytest.approx([1.0, config.least, 1.0])
