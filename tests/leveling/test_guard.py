"""What switches the compensator off by itself."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bluefoot_mpc.leveling.config import LevelingLimits
from bluefoot_mpc.leveling.guard import PAUSE, Guard

DT = 0.02
LIMITS = LevelingLimits(shift=0.2, tilt_deg=15.0, clamped=0.1)


@pytest.fixture
def guard():
    return Guard(LIMITS)


def well(guard, seconds):
    for _ in range(round(seconds / DT)):
        guard.watch(0.0, "", "", DT)


@given(shift=st.lists(st.floats(-1e300, 1e300), min_size=16, max_size=16), most=st.floats(1e-3, 2.0))
def test_a_shift_is_cut_to_its_limit_and_left_alone_inside(shift, most):
    shift = np.array(shift)
    cut = Guard(LevelingLimits(shift=most)).cut(shift, DT)
    assert np.abs(cut).max() <= most
    inside = np.abs(shift) <= most
    np.testing.assert_array_equal(cut[inside], shift[inside])
    np.testing.assert_array_equal(np.sign(cut), np.sign(shift))


@pytest.mark.parametrize(("joints", "stops"), [(7, False), (8, True), (16, True)])
def test_half_of_the_goals_at_the_limit_for_too_long_stop_it(guard, joints, stops):
    shift = np.zeros(16)
    shift[:joints] = 1.0
    for _ in range(5):
        guard.cut(shift, DT)
        assert guard.stopped == ""
    for _ in range(2):
        guard.cut(shift, DT)
    assert bool(guard.stopped) is stops
    well(guard, 10.0)
    assert bool(guard.stopped) is stops


def test_only_ticks_in_a_row_count(guard):
    for _ in range(20):
        for _ in range(4):
            guard.cut(np.full(16, 1.0), DT)
        guard.cut(np.zeros(16), DT)
    assert guard.stopped == ""


@pytest.mark.parametrize("tilt", [math.radians(15.1), math.pi, math.inf, math.nan])
def test_a_tilt_beyond_the_limit_pauses_it(guard, tilt):
    guard.watch(tilt, "", "", DT)
    assert "15 degrees" in guard.stopped


def test_a_tilt_below_the_limit_does_not(guard):
    guard.watch(math.radians(14.9), "", "", DT)
    assert guard.stopped == ""


def test_a_doubt_pauses_it_until_it_has_been_away_for_a_while(guard):
    guard.watch(0.0, "", "dark", DT)
    well(guard, 0.5 * PAUSE)
    assert guard.stopped == "dark"
    guard.watch(0.0, "", "darker", DT)
    well(guard, PAUSE - 2 * DT)
    assert guard.stopped == "darker"
    well(guard, 3 * DT)
    assert guard.stopped == ""


def test_a_doubt_is_named_before_a_tilt(guard):
    guard.watch(1.0, "", "dark", DT)
    assert guard.stopped == "dark"


def test_a_fault_stops_it_until_reset(guard):
    guard.watch(0.0, "", "dark", DT)
    guard.watch(0.0, "broken", "", DT)
    well(guard, 10.0)
    guard.watch(0.0, "", "dark", DT)
    assert guard.stopped == "broken"
    guard.reset()
    assert guard.stopped == ""
    well(guard, DT)
    assert guard.stopped == ""


def test_a_pause_ends_a_row_of_clamped_ticks(guard):
    for _ in range(5):
        guard.cut(np.full(16, 1.0), DT)
    guard.watch(0.0, "", "dark", DT)
    well(guard, 2 * PAUSE)
    for _ in range(5):
        guard.cut(np.full(16, 1.0), DT)
    assert guard.stopped == ""
    guard.cut(np.full(16, 1.0), DT)
    assert guard.stopped != ""
