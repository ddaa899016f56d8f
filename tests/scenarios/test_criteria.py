"""What counts as a success, by gait, speed and ground."""

import pytest

from bluefoot_mpc.scenarios.base import NOT_MEASURED
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.posing import POSITION_ERROR, Pose, Stand
from bluefoot_mpc.scenarios.walking import Transition, Turn, Walk

GOOD = {
    "fell": False,
    "stop_reason": "completed",
    "speed_ref_mps": 0.06,
    "speed_mps": 0.059,
    "distance_m": 1.0,
    "lateral_drift_m": 0.05,
    "roll_rms_deg": 0.9,
    "pitch_rms_deg": 0.9,
    "roll_peak_deg": 1.5,
    "pitch_peak_deg": 1.5,
    "swing_clearance_median_m": 0.0081,
    "figures": {"yaw_rate_radps": 0.29, POSITION_ERROR: 0.004},
}


def missed(scenario, **changes):
    return [criterion.name for criterion in scenario.criteria({**GOOD, **changes}) if not criterion.holds]


def walk(**options):
    return resolve(Walk, RunOptions(**options)).scenario


def test_a_good_walk_misses_nothing():
    assert missed(walk()) == []


@pytest.mark.parametrize(
    ("options", "limit"),
    [
        ({"speed": 0.04}, 1.0),
        ({"speed": 0.06}, 1.0),
        ({"speed": 0.0, "lateral_speed": 0.04}, 1.0),
        ({"speed": 0.08}, 1.5),
        ({"speed": 0.1}, 1.5),
        ({"speed": 0.12}, 3.0),
        ({"gait": "walk", "speed": 0.03}, 2.0),
        ({"gait": "walk", "speed": 0.04}, 2.0),
        ({"gait": "walk", "speed": 0.06}, 3.0),
        ({"speed": 0.06, "slope": 5.0}, 3.0),
        ({"speed": 0.06, "world": "slope"}, 3.0),
        ({"speed": 0.06, "world": "rough"}, 3.0),
    ],
)
@pytest.mark.parametrize("axis", ["roll", "pitch"])
def test_the_tilt_allowed_follows_gait_speed_and_ground(options, limit, axis):
    scenario = walk(**options)
    assert missed(scenario, **{f"{axis}_rms_deg": limit}) == []
    assert missed(scenario, **{f"{axis}_rms_deg": limit + 0.01}) == [f"{axis} RMS at most {limit:g} deg"]


@pytest.mark.parametrize(
    ("change", "name"),
    [
        ({"fell": True, "stop_reason": "stopped at 6.2 s: tilted"}, "stays on its feet"),
        ({"fell": True}, "stays on its feet"),
        ({"stop_reason": "interrupted"}, "stays on its feet to the end"),
        ({"speed_mps": 0.0539}, "mean speed within 10 % of the command"),
        ({"speed_mps": 0.0661}, "mean speed within 10 % of the command"),
        ({"lateral_drift_m": -0.11}, "drift under 10 % of the distance"),
        ({"swing_clearance_median_m": 0.0079}, "swing clearance at least 8 mm"),
    ],
)
def test_each_fault_misses_its_own_criterion(change, name):
    assert missed(walk(), **change) == [name]


def test_clearance_is_asked_of_walking_on_flat_floor_only():
    low = {"swing_clearance_median_m": 0.001}
    assert missed(walk(world="rough"), **low) == []
    assert missed(walk(speed=0.0), **low, speed_ref_mps=0.0) == []


def test_what_a_short_run_does_not_measure_does_not_hold_and_says_why():
    nothing = dict.fromkeys(GOOD) | {"fell": False, "stop_reason": "completed", "speed_ref_mps": 0.06}
    for scenario in (walk(), Stand(), Pose(), Turn(), Transition()):
        first, *others = scenario.criteria(nothing)
        assert first.holds
        assert others
        assert all(not c.holds and c.detail == NOT_MEASURED for c in others)


def test_a_trunk_out_of_its_place_fails_the_pose():
    assert missed(Pose()) == []
    (name,) = missed(Pose(), figures={POSITION_ERROR: 0.0101})
    assert "trunk position error" in name


def test_a_criterion_names_the_figure_it_judges():
    figures = {criterion.figure for criterion in walk().criteria(GOOD)}
    assert figures == {
        "", "speed_mps", "lateral_drift_m", "roll_rms_deg", "pitch_rms_deg", "swing_clearance_median_m"
    }  # fmt: skip
