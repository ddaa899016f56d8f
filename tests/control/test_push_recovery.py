import numpy as np
import pytest

from bluefoot_mpc.control.push_recovery import PushRecovery, PushRecoveryConfig
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.zmp.preview.capture import CaptureConfig

HEIGHT = 0.1
ON = PushRecoveryConfig(enabled=True)


def test_a_hard_push_moves_the_footholds_along_it_and_no_further_than_the_bound():
    law = CaptureConfig()
    push = np.array([0.0, 0.6])
    shift = PushRecovery(ON).step(np.array([0.06, 0.0]) + push, np.array([0.06, 0.0]), HEIGHT)
    error = 0.6 * np.sqrt(HEIGHT / GRAVITY)
    np.testing.assert_allclose(shift, [0.0, min(law.gain * (error - law.end), law.max_shift)])


def test_a_mild_push_and_a_law_that_is_off_leave_them_alone():
    recovery = PushRecovery(ON)
    np.testing.assert_array_equal(recovery.step(np.array([0.2, 0.0]), np.zeros(2), HEIGHT), 0.0)
    assert PushRecovery(PushRecoveryConfig()).step(np.array([2.0, 0.0]), np.zeros(2), HEIGHT) is None


@pytest.mark.parametrize("height", [np.nan, -1.0])
def test_no_shift_without_a_height(height):
    shift = PushRecovery(ON).step(np.array([2.0, 0.0]), np.zeros(2), height)
    assert np.isfinite(shift).all()
    np.testing.assert_array_equal(shift, 0.0)


def test_a_correction_goes_on_until_the_error_is_small_and_reset_ends_it():
    recovery = PushRecovery(ON)
    recovery.step(np.array([0.6, 0.0]), np.zeros(2), HEIGHT)
    small = np.array([0.2, 0.0])
    assert recovery.step(small, np.zeros(2), HEIGHT).any()
    recovery.reset()
    assert not recovery.step(small, np.zeros(2), HEIGHT).any()
