import itertools
import math

import numpy as np
import pytest

from bluefoot_mpc.control.ground import GroundAdaptationConfig, GroundAdapter
from bluefoot_mpc.exceptions import ConfigurationError

DT = 0.02
FEET = np.array([[0.15, 0.14, 0.0], [0.15, -0.14, 0.0], [-0.17, 0.14, 0.0], [-0.17, -0.14, 0.0]])
ALL = np.ones(4, dtype=np.bool_)
DIAGONALS = (np.array([True, False, False, True]), np.array([False, True, True, False]))


def adapter(**changes) -> GroundAdapter:
    return GroundAdapter(GroundAdaptationConfig(enabled=True, **changes))


def on_plane(slope, height=-0.115) -> np.ndarray:
    feet = FEET.copy()
    feet[:, 2] = height + feet[:, :2] @ np.asarray(slope)
    return feet


@pytest.mark.parametrize("slope", [(0.14, 0.0), (-0.05, 0.09)])
def test_standing_feet_show_the_slope(slope):
    ground = adapter()
    for _ in range(200):
        ground.step(on_plane(slope), ALL, DT)
    np.testing.assert_allclose(ground.slope, slope, atol=1e-6)


def test_the_diagonals_of_a_trot_show_it_in_turn():
    ground = adapter()
    for k in range(400):
        ground.step(on_plane((0.14, -0.03)), DIAGONALS[(k // 9) % 2], DT)
    np.testing.assert_allclose(ground.slope, (0.14, -0.03), atol=1e-4)


def test_one_diagonal_leaves_the_other_direction_as_it_was():
    ground = adapter(across=1.0)
    for _ in range(400):
        ground.step(on_plane((0.1, 0.0)), DIAGONALS[0], DT)
    line = FEET[0] - FEET[3]
    across = np.array([-line[1], line[0]])
    assert ground.slope @ line[:2] == pytest.approx(0.1 * line[0])
    assert ground.slope @ across == pytest.approx(0.0, abs=1e-9)


def test_a_step_met_head_on_is_foreseen_for_the_other_diagonal():
    ground = adapter(across=0.05)
    for _ in range(20):
        ground.step(on_plane((0.04, 0.0)), DIAGONALS[0], DT)
    np.testing.assert_allclose(ground.place(FEET)[:, 2], on_plane((0.04, 0.0), 0.0)[:, 2], atol=1.2e-3)


def test_uneven_ground_is_stepped_over_higher_for_a_while():
    ground = adapter(extra_lift=0.4, memory=2.0)
    lifts = []
    for k in range(1000):
        feet = on_plane((0.0, 0.0))
        feet[0, 2] += 0.01 if k == 100 else 0.0
        ground.step(feet, DIAGONALS[0], DT)
        lifts.append(ground.lift)
    assert lifts[99] == 1.0
    assert max(abs(b - a) for a, b in itertools.pairwise(lifts)) <= 0.1 + 1e-12
    assert max(lifts) == pytest.approx(1.4)
    assert lifts[-1] == pytest.approx(1.0)


def test_a_higher_step_raises_feet_in_the_air_only():
    ground = adapter(extra_lift=0.4)
    for k in range(20):
        feet = on_plane((0.0, 0.0))
        feet[0, 2] += 0.01 if k == 0 else 0.0
        ground.step(feet, DIAGONALS[0], DT)
    ground.slope[:] = 0.0
    placed = ground.place(FEET, np.array([0.02, 0.0, 0.0, 0.01]))
    np.testing.assert_allclose(placed[:, 2], [0.008, 0.0, 0.0, 0.004])


@pytest.mark.parametrize("walking", [True, False])
def test_only_walking_over_it_shows_uneven_ground(walking):
    ground = adapter()
    for _ in range(50):
        ground.step(on_plane((0.14, 0.0)), ALL, DT, walking=walking)
    assert (ground.unevenness > 0.0) is walking


def test_feet_are_put_on_the_plane_that_was_seen():
    ground = adapter()
    for _ in range(200):
        ground.step(on_plane((0.1, 0.02)), ALL, DT)
    wanted = FEET + np.array([0.02, 0.0, 0.01])
    placed = ground.place(wanted)
    np.testing.assert_array_equal(placed[:, :2], wanted[:, :2])
    np.testing.assert_allclose(placed[:, 2], 0.01 + wanted[:, :2] @ np.array([0.1, 0.02]), atol=1e-6)
    assert wanted[0, 2] == 0.01


def test_the_slope_is_bounded_in_size_and_in_speed():
    ground = adapter(max_slope=0.2, max_rate=0.5, across=1.0)
    last = ground.slope
    for _ in range(200):
        ground.step(on_plane((0.0, 0.9)), ALL, DT)
        assert math.hypot(*(ground.slope - last)) <= 0.5 * DT + 1e-12
        last = ground.slope
    assert math.hypot(*last) == pytest.approx(0.2)


@pytest.mark.parametrize("standing", [np.zeros(4, dtype=np.bool_), np.array([True, False, False, False])])
def test_too_few_feet_change_nothing(standing):
    ground = adapter()
    ground.step(on_plane((0.1, 0.1)), standing, DT)
    assert not ground.slope.any()


def test_unknown_feet_change_nothing():
    ground = adapter()
    feet = on_plane((0.1, 0.1))
    feet[1, 2] = math.nan
    ground.step(feet, ALL, DT)
    assert not ground.slope.any()


def test_feet_in_one_place_change_nothing():
    ground = adapter()
    feet = np.zeros((4, 3))
    feet[:, 2] = (0.0, 0.01, 0.0, 0.01)
    ground.step(feet, ALL, DT)
    assert not ground.slope.any()


def test_switched_off_the_ground_is_level():
    ground = GroundAdapter(GroundAdaptationConfig())
    ground.step(on_plane((0.1, 0.1)), ALL, DT)
    assert ground.place(FEET, np.ones(4)) is FEET


def test_reset_forgets_the_slope():
    ground = adapter()
    ground.step(on_plane((0.1, 0.1)), ALL, DT)
    assert ground.slope.any()
    ground.reset()
    assert not ground.slope.any()


@pytest.mark.parametrize(
    "bad",
    [{"time_constant": 0.0}, {"max_slope": 2.0}, {"max_rate": -1.0}, {"across": 0.0}, {"extra_lift": -1.0}],
)
def test_impossible_values_are_refused(bad):
    with pytest.raises(ConfigurationError, match=next(iter(bad))):
        GroundAdaptationConfig(**bad)
