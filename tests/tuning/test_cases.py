from dataclasses import replace

import pytest

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.tuning.cases import figures_of, measure, walking_case


def short_walk():
    case = walking_case("trot", 0.06)
    return replace(case, options={**case.options, "duration": 4.5})


def test_a_short_walk_gives_its_figures():
    figures = measure(short_walk(), "cpg", ("control.gait.trot.height_min=0.02",), 100)
    assert not figures.fell
    assert 0.0 < figures.roll < 2.0
    assert 0.0 < figures.pitch < 2.0
    assert 5.0 < figures.clearance < 25.0
    assert abs(figures.speed_error) < 30.0
    assert figures.cuts == 0.0


def test_a_run_that_ends_before_its_window_counts_as_a_fall():
    result = simulate("stand", RunOptions(duration=0.5))
    assert figures_of(result, 10.0).fell


def test_cut_joint_goals_are_counted():
    case = replace(short_walk(), start=2.0)
    near = ("control.posture.trunk_height=0.134", "control.posture.stance_x=0.15")
    fixed = (
        "control.ankle.policy=fixed",
        "control.ankle.direction_deg=-110",
        "control.posture.stance_y=0.146",
    )
    assert measure(case, "cpg", near + fixed, 100).cuts > 1.0


def test_a_posture_out_of_reach_counts_as_a_fall_but_a_wrong_setting_is_an_error():
    far = ("control.ankle.policy=fixed", "control.ankle.direction_deg=-60")
    assert measure(short_walk(), "cpg", far, 100).fell
    with pytest.raises(UnknownNameError, match="stance_z"):
        measure(short_walk(), "cpg", ("control.posture.stance_z=0.1",), 100)
