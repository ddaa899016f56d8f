"""The scenario rough: what it asks of the robot, and what it refuses."""

from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.evaluation.ground_measure import ground_figures
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import quaternion_from_rpy
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.crossing_figures import toppled, touched
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.types import GuideTask, Mode


def made(**options):
    return resolve(find_scenario("rough"), RunOptions(**options))


def test_it_stands_and_then_crosses_to_the_goal_line_by_lidar():
    found = made(overrides=("scenario.goal=2",))
    assert (found.stages.sim.world.name, found.stages.sim.lidar.enabled) == ("rubble", True)
    assert found.scenario.command(0.5).mode is Mode.STAND
    command = found.scenario.command(2.0)
    assert (command.mode, command.gait, command.guide.task) == (Mode.WALK, "walk", GuideTask.CROSS)
    assert command.guide.waypoints.tolist() == [[2.0, 0.0]]


def test_blind_it_walks_straight_on_at_one_step_height():
    found = made(blind=True, gait="trot", overrides=("scenario.step_height=0.05",))
    command = found.scenario.command(2.0)
    assert command.guide is None
    assert command.velocity[0] == found.scenario.config.speed
    assert set(found.stages.control.gait.trot_table.step_height) == {0.05}


@pytest.mark.parametrize(
    ("options", "cause"),
    [
        ({"gait": "trot"}, "blind"),
        ({"speed": 0.0}, "speed"),
        ({"overrides": ('scenario.gait="gallop"',)}, "unknown gait"),
        ({"overrides": ("scenario.goal=100",)}, "goal"),
        ({"overrides": ("scenario.blind=true", "scenario.incremental=true")}, "exclude"),
    ],
)
def test_what_makes_no_sense_is_refused(options, cause):
    with pytest.raises(ConfigurationError, match=cause):
        made(**options)


def test_a_run_that_ends_before_the_first_sweep_has_its_figures_and_fails():
    result = simulate("rough", RunOptions(duration=0.6, world="gap"))
    figures = result.summary["figures"]
    assert not result.success
    assert (figures["sweeps"], figures["map_cells"], figures["footholds"]) == (0, 0, 0)
    assert figures["goal_left_m"] == pytest.approx(1.5, abs=0.05)
    assert figures["reached_s"] is None


def test_who_lies_on_the_trunk_or_on_the_side_has_toppled_and_a_brush_of_a_link_has_not():
    run = simulate("rough", RunOptions(duration=0.6, world="gap")).data
    assert toppled(run) is False
    sample = run.truth[-1]
    for changes, expected in (
        ({"touching": ("FL_link4",)}, False),
        ({"touching": ("FL_link4", "trunk")}, True),
        ({"q": np.r_[sample.q[:3], quaternion_from_rpy(np.radians((0.0, 34.0, 0.0))), sample.q[7:]]}, False),
        ({"q": np.r_[sample.q[:3], quaternion_from_rpy(np.radians((60.0, 0.0, 0.0))), sample.q[7:]]}, True),
    ):
        assert toppled(replace(run, truth=[*run.truth, replace(sample, **changes)])) is expected
    assert toppled(replace(run, truth=[])) is None


def test_what_touched_is_told_with_how_long():
    run = simulate("rough", RunOptions(duration=0.6, world="gap")).data
    sample = run.truth[-1]
    brushes = [replace(sample, touching=("FL_link4",)), replace(sample, touching=("FL_link4", "trunk"))]
    assert touched(replace(run, truth=[*run.truth, *brushes])) == {"FL_link4": 0.04, "trunk": 0.02}


@pytest.mark.parametrize(
    ("links", "reached", "expected"),
    [({}, 9.0, 1.0), ({"FL_link4": 0.2}, 9.0, 1.0), ({"FL_link3": 0.2}, 9.0, 0.0), ({}, None, 0.0)],
)
def test_who_reached_the_line_and_brushed_with_last_links_only(links, reached, expected):
    figures = {"goal_left_m": 0.0, "reached_s": reached, "touched": links, "toppled": False}
    assert ground_figures({"success": False, "figures": figures})["brushed_at_most"] == expected
    assert ground_figures({"success": True, "figures": {}})["brushed_at_most"] is None
