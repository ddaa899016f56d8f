from dataclasses import replace

import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.tuning.cases import STAND, measure
from bluefoot_mpc.tuning.leveling import (
    LEARNING,
    OFF,
    PARTS,
    LevelCase,
    LevelJudge,
    level_cost,
    level_penalties,
    level_space,
    tilt,
)
from bluefoot_mpc.tuning.objective import Figures

WITHOUT = Figures(
    fell=False, roll=3.0, pitch=4.0, clearance=35.0, speed_error=0.0, drift=0.0, cuts=0.0,
    height=120.0, torque=0.25, joint_speed=1.0,
)  # fmt: skip
GAINS = {"tilt": 9000.0, "tilt_rate": 50.0}


def control(case, overrides=()):
    """The control configuration of a run of a case."""
    made = case.tuning_case()
    given = {**made.options, "overrides": (*made.options["overrides"], *overrides)}
    return resolve(
        find_scenario(made.scenario), RunOptions(**given, controller=case.controller)
    ).stages.control


def test_a_run_as_without_levelling_costs_one_and_half_the_tilt_a_half():
    half = replace(WITHOUT, roll=1.5, pitch=2.0)
    assert tilt([WITHOUT]) == pytest.approx(5.0)
    assert level_cost([WITHOUT, WITHOUT], [WITHOUT, WITHOUT]) == pytest.approx(1.0)
    assert level_cost([half, half], [WITHOUT, WITHOUT]) == pytest.approx(0.5)


def test_medians_over_the_seeds_are_compared():
    half = replace(WITHOUT, roll=1.5, pitch=2.0)
    wild = replace(WITHOUT, roll=9.0, pitch=9.0)
    assert level_cost([half, half, wild], [WITHOUT] * 3) == pytest.approx(0.5)


def test_only_the_seeds_that_ran_are_compared():
    other = replace(WITHOUT, roll=30.0, pitch=40.0)
    assert level_cost([WITHOUT], [WITHOUT, other, other]) == pytest.approx(1.0)
    with pytest.raises(ConfigurationError, match="same seeds"):
        level_cost([WITHOUT, WITHOUT], [WITHOUT])
    with pytest.raises(ConfigurationError):
        level_cost([], [WITHOUT])


@pytest.mark.parametrize(
    ("name", "change", "expected"),
    [
        ("fall", {"fell": True}, 10.0),
        ("stop", {"stopped": 0.5}, 1.0),
        ("sink", {"height": 115.0}, 0.1),
        ("clearance", {"clearance": 30.0}, 0.06),
        ("speed", {"speed_error": -5.0}, 0.1),
        ("ring", {"joint_speed": 1.5}, 0.3),
        ("ring", {"torque": 0.5}, 0.8),
    ],
)
def test_each_broken_condition_adds_its_penalty(name, change, expected):
    found = level_penalties([replace(WITHOUT, **change)], [WITHOUT])
    assert found.pop(name) == pytest.approx(expected)
    assert set(found.values()) == {0.0}


def test_what_stays_within_the_limits_costs_nothing():
    better = replace(WITHOUT, height=116.5, clearance=33.0, speed_error=-2.5, joint_speed=1.15, torque=0.2)
    assert set(level_penalties([better], [WITHOUT]).values()) == {0.0}


def test_the_worst_case_counts():
    easy, hard = (LevelCase(speed=speed).tuning_case() for speed in (0.06, 0.1))
    judge = LevelJudge(without={easy.name: [WITHOUT], hard.name: [replace(WITHOUT, roll=6.0, pitch=8.0)]})
    figures = replace(WITHOUT, roll=2.4, pitch=3.2)
    assert judge([easy, hard], {easy.name: [figures], hard.name: [figures]}) == pytest.approx(0.8)
    assert judge([hard], {hard.name: [figures]}) == pytest.approx(0.4)


def test_a_case_levels_only_after_the_network_has_learnt():
    case = LevelCase(speed=0.08, mix=0.35, payload=(0.2, 0.05, 0.04, 0.03))
    made, found = case.tuning_case(), control(case).leveling
    assert found.enabled
    assert found.mix == 0.35
    assert found.schedule.start == STAND + LEARNING < made.start
    assert found.schedule.on == found.schedule.off == 0.0
    assert found.schedule.learn_time < LEARNING
    assert made.options["payload"] == case.payload
    assert made.options["duration"] > made.start
    assert case.name != LevelCase(speed=0.08, mix=0.35).name
    assert not control(case, OFF).leveling.enabled


def test_the_papers_laws_get_a_gait_that_tilts_and_model_based_control_keeps_its_own():
    tilting = control(LevelCase())
    assert not tilting.zmp.enabled
    assert not tilting.gait.reflex.enabled
    assert tilting.gait.trot.cycle_min == tilting.gait.trot.cycle_max == 1.0
    # Gains are searched on the walk that they are judged by.
    judged = resolve(find_scenario("level"), RunOptions()).stages.control
    assert replace(tilting, leveling=judged.leveling) == judged
    own = control(LevelCase(controller="mpc"))
    plain = resolve(find_scenario("walk"), RunOptions(controller="mpc")).stages.control
    assert replace(own, leveling=plain.leveling) == plain
    assert own.leveling.form == "residual"


@pytest.mark.parametrize(
    ("part", "psi", "attitude"),
    [
        ("mixing", "zero", False),
        ("pd", "zero", True),
        ("network", "network", True),
        ("persistence", "persistence", True),
        ("model", "model", True),
    ],
)
def test_a_part_is_what_the_compensator_gets(part, psi, attitude):
    found = control(LevelCase(), level_space(part).overrides(GAINS)).leveling
    assert (found.psi, found.attitude) == (psi, attitude)
    assert (found.gains.tilt, found.gains.tilt_rate) == (9000.0, 50.0)


def test_an_unknown_part_is_named():
    assert len(PARTS) == 5
    with pytest.raises(UnknownNameError, match="magic"):
        level_space("magic")


@pytest.mark.parametrize("change", [{"speed": 0.0}, {"mix": -0.1}])
def test_impossible_cases_are_refused(change):
    with pytest.raises(ConfigurationError):
        LevelCase(**change)


def test_levelling_is_seen_to_help_in_a_short_run():
    case = LevelCase(randomize="none").tuning_case()
    early = (*case.options["overrides"], "control.leveling.schedule.start=2.0")
    case = replace(case, options={**case.options, "overrides": early, "duration": 8.0}, start=4.0)
    without = measure(case, "cpg", OFF, 100)
    levelled = measure(case, "cpg", level_space("pd").overrides({"tilt": 6000.0, "tilt_rate": 50.0}), 100)
    assert 1.5 < without.roll < 4.0
    assert level_cost([levelled], [without]) < 0.8
    assert 110.0 < levelled.height < 125.0
    assert 0.1 < levelled.torque < 0.5
    assert 0.5 < levelled.joint_speed < 2.0
    assert levelled.stopped == 0.0
