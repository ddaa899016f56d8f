import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.zmp.preview.capture import CaptureConfig, capture_point, foothold_shift

CONFIG = CaptureConfig(begin=0.03, end=0.01, gain=1.0, max_shift=0.04)


def shift(x, y, active, config=CONFIG):
    return foothold_shift(np.array([0.1 + x, y]), np.array([0.1, 0.0]), active, config)


def test_a_pendulum_from_the_capture_point_comes_to_rest_over_it():
    position, velocity, height = np.array([0.02, -0.01]), np.array([0.3, 0.1]), 0.1
    goal, omega = capture_point(position, velocity, height), np.sqrt(GRAVITY / height)
    for time in (0.1, 0.5, 1.0):
        there = goal + (position - goal) * np.cosh(omega * time) + velocity / omega * np.sinh(omega * time)
        assert there - goal == pytest.approx((position - goal) * np.exp(-omega * time), abs=1e-10)


def test_mild_pushes_leave_the_footholds_alone():
    correction = shift(0.029, 0.0, active=False)
    assert not correction.active
    assert np.array_equal(correction.shift, np.zeros(2))


def test_a_hard_push_moves_them_along_it_and_no_farther_than_allowed():
    correction = shift(0.03, 0.04, active=False)
    assert correction.active
    assert correction.shift == pytest.approx(0.04 * np.array([0.6, 0.8]))
    assert np.linalg.norm(shift(3.0, -4.0, active=True).shift) == pytest.approx(0.04)


def test_a_correction_ends_at_the_lower_threshold_without_a_jump():
    assert shift(0.02, 0.0, active=True).shift == pytest.approx([0.01, 0.0])
    assert shift(0.0101, 0.0, active=True).shift == pytest.approx([0.0001, 0.0])
    assert not shift(0.0099, 0.0, active=True).active


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_unknown_points_correct_nothing(value):
    correction = shift(value, 0.0, active=True)
    assert correction == (pytest.approx(np.zeros(2)), False)


def test_thresholds_in_the_wrong_order_are_refused():
    with pytest.raises(ConfigurationError, match="must not exceed begin"):
        CaptureConfig(begin=0.01, end=0.02)
