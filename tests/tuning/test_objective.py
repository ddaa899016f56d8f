from dataclasses import replace

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.tuning.objective import Bars, Figures, attitude, cost, penalties

BARS = Bars(roll=0.2, pitch=0.4, worst=0.5, clearance=10.0, clearance_reserve=1.0)
GOOD = Figures(fell=False, roll=0.2, pitch=0.4, clearance=11.0, speed_error=4.0, drift=8.0, cuts=0.0)


def test_a_gait_at_its_bars_costs_its_share_of_them_and_no_penalty():
    # Median at the bar gives 0.65 x 1; the worst seed is at (0.2 + 0.4) / 2 / 0.5 of its bar.
    assert cost([GOOD, GOOD], BARS) == pytest.approx(0.65 + 0.35 * 0.6)
    assert sum(penalties([GOOD], BARS).values()) == 0.0


def test_attitude_uses_medians_and_the_worst_seed():
    rare = replace(GOOD, roll=0.8)
    base = attitude([GOOD, GOOD, GOOD], BARS)
    assert attitude([GOOD, GOOD, rare], BARS) == pytest.approx(base + 0.35 * 0.5 * 0.6 / 0.5)


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("fall", {"fell": True}, 5.0),
        ("clearance", {"clearance": 9.0}, 0.5),
        ("speed", {"speed_error": -14.0}, 1.0),
        ("speed", {"speed_error": 14.0}, 1.0),
        ("drift", {"drift": 28.0}, 1.0),
        ("cut", {"cuts": 1.0}, 0.1),
    ],
)
def test_each_broken_condition_adds_its_penalty(name, change, expected):
    found = penalties([GOOD, replace(GOOD, **change)], BARS)
    assert found.pop(name) == pytest.approx(expected)
    assert set(found.values()) == {0.0}


def test_a_fall_costs_more_than_any_gait_that_stands():
    shaky = replace(GOOD, roll=1.0, pitch=1.0, clearance=6.0, speed_error=-10.0)
    assert cost([GOOD] * 7 + [Figures.of_fall()], BARS) > cost([shaky] * 8, BARS)


def test_no_run_has_no_cost():
    with pytest.raises(ConfigurationError, match="at least one run"):
        cost([], BARS)


@pytest.mark.parametrize("change", [{"roll": 0.0}, {"worst_weight": 1.5}, {"clearance": -1.0}])
def test_impossible_bars_are_refused(change):
    with pytest.raises(ConfigurationError):
        replace(BARS, **change)
