"""Figures against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.zmp.support import support_margins

MASS = 1.9
TIME = 0.02 * np.arange(500)
SQUARE = np.array([[0.1, 0.1], [0.1, -0.1], [-0.1, 0.1], [-0.1, -0.1]])


def quaternions(rpy: np.ndarray) -> np.ndarray:
    return np.array([quaternion_from_rpy(row) for row in rpy])


def test_angles_of_random_attitudes() -> None:
    rng = np.random.default_rng(0)
    rpy = rng.uniform([-3.0, -1.5, -3.0], [3.0, 1.5, 3.0], (200, 3))
    assert metrics.roll_pitch(quaternions(rpy)) == pytest.approx(rpy[:, :2], abs=1e-9)
    up = np.array([rotation_from_rpy(row)[2, 2] for row in rpy])
    assert np.cos(metrics.tilt(quaternions(rpy))) == pytest.approx(up, abs=1e-12)


def test_yaw_goes_on_beyond_half_a_turn() -> None:
    angle = np.linspace(0.5, 0.5 + 6 * math.pi, 200)
    rpy = np.stack([0.1 * np.sin(angle), 0.1 * np.cos(angle), angle], axis=1)
    assert metrics.yaw(quaternions(rpy)) == pytest.approx(angle)


def test_rms_and_peak_of_a_sine() -> None:
    sine = 0.3 * np.sin(np.linspace(0.0, 8 * math.pi, 4000, endpoint=False))
    assert metrics.rms(sine) == pytest.approx(0.3 / math.sqrt(2.0))
    assert metrics.rms(sine + 0.4) == pytest.approx(math.sqrt(0.045 + 0.16))  # the mean counts
    assert metrics.peak(-0.1 + sine) == pytest.approx(0.4, abs=1e-6)


def test_straight_path_in_its_heading() -> None:
    direction = 2.0
    forward, left = 0.06 * TIME, 0.01 * np.sin(TIME)
    c, s = math.cos(direction), math.sin(direction)
    position = np.stack([c * forward - s * left, s * forward + c * left], axis=1) + 3.0
    path = metrics.path_in_heading(position, np.full(len(TIME), direction))
    assert path == pytest.approx(np.stack([forward, left], axis=1))


def test_circle_in_its_heading_is_an_arc() -> None:
    heading = 0.3 * TIME
    position = 0.2 * np.stack([np.sin(heading), -np.cos(heading)], axis=1)
    path = metrics.path_in_heading(position, heading)
    assert path[-1, 0] == pytest.approx(0.2 * heading[-1], rel=1e-5)
    assert abs(path[:, 1]).max() < 1e-9


def test_integral_of_held_values() -> None:
    assert metrics.integrate(np.array([1.0, 2.0, 9.0]), np.array([0.0, 0.1, 0.4]), 5.0) == pytest.approx(
        [5.0, 5.1, 5.7]
    )


def test_mass_is_found_in_motion_and_at_rest() -> None:
    com = np.stack([0.06 * TIME, 0.01 * np.sin(3.0 * TIME), np.full(len(TIME), 0.1)], axis=1)
    velocity = np.stack([np.full(len(TIME), 0.06), 0.03 * np.cos(3.0 * TIME), np.zeros(len(TIME))], axis=1)
    assert metrics.mass_in_motion(com, MASS * velocity, TIME) == pytest.approx(MASS, rel=2e-3)
    assert metrics.mass_in_motion(com[:1].repeat(50, axis=0), np.zeros((50, 3)), TIME[:50]) is None
    force = np.zeros((50, 4, 3))
    force[:, :, 2] = (MASS * GRAVITY + 2.0) / 4.0
    push = np.tile([5.0, 0.0, -2.0], (50, 1))
    assert metrics.mass_from_load(force, push) == pytest.approx(MASS)


def zmp(
    com: np.ndarray, momentum: np.ndarray, push: np.ndarray | None = None, ground: float = 0.0
) -> np.ndarray:
    n = len(com)
    push = np.zeros((n, 6)) if push is None else push
    return metrics.zero_moment_points(TIME[:n], com, momentum, push, np.full(n, ground), mass=MASS)


def test_zmp_of_a_swaying_point_mass() -> None:
    """x_zmp = x - (z - ground) / g * x'', the cart on a table."""
    w, ground = 4.0, 0.03
    com = np.stack([0.02 * np.sin(w * TIME), 0.01 * np.cos(w * TIME), np.full(len(TIME), 0.13)], axis=1)
    velocity = np.stack([0.02 * w * np.cos(w * TIME), -0.01 * w * np.sin(w * TIME), 0 * TIME], axis=1)
    momentum = np.hstack([MASS * velocity, np.zeros((len(TIME), 3))])
    expected = (0.5 * (com[1:] + com[:-1]) * (1.0 + 0.10 * w * w / GRAVITY))[:, :2]
    assert zmp(com, momentum, ground=ground) == pytest.approx(expected, abs=2e-5)


def test_zmp_moves_with_angular_momentum() -> None:
    """To turn the trunk nose down (+y) the ground must press behind the centre of mass, by M / (m g)."""
    com = np.tile([0.3, -0.2, 0.11], (50, 1))
    momentum = np.zeros((50, 6))
    momentum[:, 3], momentum[:, 4] = 0.4 * TIME[:50], 0.5 * TIME[:50]
    weight = MASS * GRAVITY
    assert zmp(com, momentum) == pytest.approx(np.tile([0.3 - 0.5 / weight, -0.2 + 0.4 / weight], (49, 1)))


def test_zmp_of_a_robot_that_withstands_a_push() -> None:
    """Pushed forward above the ground without moving, the feet's reaction moves forward by F h / (m g)."""
    com = np.tile([0.0, 0.0, 0.10], (20, 1))
    push = np.tile([3.0, 0.0, 0.0, 0.01, 0.0, 0.12], (20, 1))
    assert zmp(com, np.zeros((20, 6)), push) == pytest.approx(
        np.tile([3.0 * 0.12 / (MASS * GRAVITY), 0.0], (19, 1))
    )


def test_zmp_in_flight_is_unknown() -> None:
    com = np.tile([0.0, 0.0, 0.2], (20, 1))
    momentum = np.zeros((20, 6))
    momentum[:, 2] = -MASS * GRAVITY * TIME[:20]
    assert np.isnan(zmp(com, momentum)).all()


def test_support_margins_need_three_feet() -> None:
    stance = np.array([[1, 1, 1, 1], [1, 1, 1, 0], [1, 0, 0, 1], [1, 1, 1, 1]], dtype=bool)
    point = np.array([[0.0, 0.03], [-0.05, -0.05], [0.0, 0.0], [0.0, 0.12]])
    margins = support_margins(point, np.tile(SQUARE, (4, 1, 1)), stance)
    assert margins[[0, 3]] == pytest.approx([0.07, -0.02])
    assert margins[1] == pytest.approx(-0.05 * math.sqrt(2.0))  # behind the diagonal of the three feet
    assert np.isnan(margins[2])


def schedule(lags: list[float], cycle: float, duty: float, time: np.ndarray = TIME) -> np.ndarray:
    """(n, 4) swing of legs whose lift-off lags FL's."""
    phase = (time[:, None] / cycle - 0.05 - np.array(lags)) % 1.0
    return phase < 1.0 - duty


@pytest.mark.parametrize("lags", [[0.0, 0.5, 0.5, 0.0], [0.0, 0.5, 0.75, 0.25]])
def test_lags_of_lift_off(lags: list[float]) -> None:
    swing = schedule(lags, cycle=0.473, duty=0.65)
    assert metrics.lift_off_lags(TIME, swing) == pytest.approx(lags, abs=0.015)
    assert metrics.cycle_time(TIME, swing) == pytest.approx(0.473, abs=0.011)
    signal = np.sin(2 * np.pi * (TIME[:, None] / 0.473 - 0.05 - np.array(lags)))
    assert metrics.lift_off_lags(TIME, signal) == pytest.approx(lags, abs=2e-3)


def test_a_lag_just_before_the_reference_is_negative() -> None:
    assert metrics.lift_off_lags(TIME, schedule([0.0, 0.5, 0.5, -0.06], 0.6, 0.6))[3] == pytest.approx(
        -0.06, abs=0.02
    )


def test_order_of_footfall() -> None:
    assert metrics.footfall_order(TIME, schedule([0.0, 0.5, 0.75, 0.25], 0.9, 0.75)) == (
        "FR",
        "RL",
        "FL",
        "RR",
    )
    assert metrics.footfall_order(TIME, schedule([0.0, 0.5, 0.25, 0.75], 0.9, 0.75)) == (
        "FR",
        "RR",
        "FL",
        "RL",
    )


def test_without_steps_there_is_no_order() -> None:
    rest = np.zeros((100, 4), dtype=bool)
    assert np.isnan(metrics.lift_off_lags(TIME[:100], rest)).all()
    assert metrics.footfall_order(TIME[:100], rest) == ()
    assert metrics.cycle_time(TIME[:100], rest) is None


def test_clearance_is_the_highest_point_of_each_cycle() -> None:
    """The foot follows the schedule 60 ms late; the last swing, cut by the end, does not count."""
    swing = schedule([0.0, 0.5, 0.5, 0.0], 0.5, 0.6)
    late = schedule([0.0, 0.5, 0.5, 0.0], 0.5, 0.6, TIME - 0.06)
    apex = np.array([0.010, 0.012, 0.014, 0.016])
    apexes = metrics.swing_apexes(late * apex, swing)
    assert set(apexes.round(6)) == set(apex)
    assert np.median(apexes) == pytest.approx(0.013)
    assert len(apexes) == 4 * 20 - 4


def test_swing_from_heights_ignores_chatter() -> None:
    height = np.zeros((40, 4))
    height[:, 0] = [0.0] * 10 + [0.004] * 5 + [0.002] * 5 + [0.010] * 5 + [0.001] * 15
    height[::2, 1] = 0.0029
    swing = metrics.swing_from_heights(height, 0.003)
    assert np.flatnonzero(swing[:, 0]).tolist() == list(range(10, 25))
    assert not swing[:, 1:].any()
