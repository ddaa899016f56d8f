import numpy as np
import pytest

from bluefoot_mpc.gait.reflex import (
    IDLE,
    NEGLIGIBLE,
    ReflexConfig,
    activation,
    fall_direction,
    is_quiet,
    reflex,
)

FEET = (0.165 + 0.165j, 0.165 - 0.165j, -0.165 + 0.165j, -0.165 - 0.165j)
AIR = (False,) * 4
ON = ReflexConfig(enabled=True)


def test_falling_nose_down_points_forward_and_to_the_right_points_right() -> None:
    assert fall_direction((0.0, 1.0)) == 1.0 + 0.0j  # pitch rate + = nose goes down
    assert fall_direction((1.0, 0.0)) == -1.0j  # roll rate + = right side goes down


def test_legs_on_the_side_of_the_fall_react() -> None:
    out = reflex((0.0, 0.8), FEET, AIR, ON)
    assert out.psi_omega[0] == pytest.approx(out.psi_omega[1])
    assert out.psi_omega[0] > out.psi_omega[2] + 0.3
    assert out.psi_m[0] > 1.3
    assert min(out.psi_m) >= 1.0  # the step gets lower, never higher


def test_strength_is_fall_speed_plus_its_part_towards_the_foot() -> None:
    config = ReflexConfig(enabled=True, sharpness=2.0, threshold=1.0)
    fall, foot = 0.6 + 0.8j, 0.2 + 0.0j
    expected = 1.0 / (1.0 + np.exp(-2.0 * (1.0 + 0.6 - 1.0)))
    assert activation(fall, foot, False, config) == pytest.approx(expected)


def test_standing_legs_and_the_switched_off_reflex_do_nothing() -> None:
    assert activation(5.0 + 0j, FEET[0], True, ON) == 0.0
    assert reflex((0.0, 9.0), FEET, AIR, ReflexConfig(enabled=False)) is IDLE


def test_shift_follows_the_fall_and_is_bounded() -> None:
    config = ReflexConfig(enabled=True, shift=0.02, shift_limit=0.03)
    assert reflex((0.0, 1.0), FEET, AIR, config).shift == pytest.approx(0.02)
    assert abs(reflex((5.0, 5.0), FEET, AIR, config).shift) == pytest.approx(0.03)


def test_quiet_is_where_no_leg_reacts() -> None:
    edge = 0.5 * (ON.threshold + NEGLIGIBLE / ON.sharpness)
    for size, quiet in ((0.99 * edge, True), (1.01 * edge, False)):
        for angle in np.linspace(0.0, 6.0, 7):
            error = (size * np.cos(angle), size * np.sin(angle))
            assert is_quiet(error, ON) == quiet
            strongest = activation(fall_direction(error), fall_direction(error), False, ON)
            assert (strongest < np.exp(NEGLIGIBLE)) == quiet
    assert not is_quiet((0.0, 0.0), ReflexConfig(shift=0.01))


def test_extreme_rates_do_not_overflow() -> None:
    out = reflex((1e6, -1e6), FEET, AIR, ON)
    assert np.all(np.isfinite(out.psi_omega))
