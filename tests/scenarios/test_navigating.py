"""Scenarios that find their own way, in short runs; the figures over seeds are batteries."""

import math

import pytest

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import simulate
from bluefoot_mpc.types import GuideTask, Mode


def resolved(name, **options):
    return resolve(find_scenario(name), RunOptions(**options))


def test_a_scenario_brings_its_world_and_its_sensors_and_the_user_may_choose_others():
    sim = resolved("wander").stages.sim
    assert (sim.world.name, sim.lidar.enabled, sim.camera.enabled) == ("room", True, False)
    assert resolved("wander", world="maze").stages.sim.world.name == "maze"
    chosen = resolved("wander", overrides=("sim.world.name=flat", "sim.lidar.enabled=false")).stages.sim
    assert (chosen.world.name, chosen.lidar.enabled) == ("flat", False)
    assert resolved("walk").stages.sim.world.name == "flat"
    assert not resolved("walk").stages.sim.lidar.enabled


def test_an_emulated_robot_gets_the_lidar_that_the_scenario_needs():
    assert resolved("wander", robot="emulator").stages.devices.emulate_lidar
    assert not resolved("walk", robot="emulator").stages.devices.emulate_lidar


def test_a_real_robot_is_told_which_sensor_is_missing():
    with pytest.raises(ConfigurationError, match="lidar_port"):
        resolved("wander", robot="hardware", port=("/dev/null",))


def test_the_task_starts_after_the_standing():
    scenario = resolved("wander", speed=0.15).scenario
    assert scenario.command(0.5).mode is Mode.STAND
    command = scenario.command(2.0)
    assert (command.mode, command.guide.task, command.guide.speed) == (Mode.WALK, GuideTask.WANDER, 0.15)


@pytest.mark.parametrize(
    ("name", "override"),
    [
        ("wander", "scenario.speed=0.9"),
        ("wander", "scenario.speed=-0.1"),
        ("goto", "scenario.waypoints=[]"),
        ("goto", "scenario.waypoints=[[nan, 1.0]]"),
        ("goto", "scenario.waypoints=[[1e300, 1.0]]"),
        ("follow", "scenario.leader_speed=0.5"),
        ("follow", "scenario.leader_path='spiral'"),
        ("follow", "sim.leader.speed=0.3"),
        ("follow", "sim.leader.kind='mecanum'"),
        ("approach", "scenario.distance=0.1"),
    ],
)
def test_impossible_values_are_refused(name, override):
    with pytest.raises(ConfigurationError):
        resolved(name, overrides=(override,))


def test_an_unknown_leader_is_refused_with_the_valid_ones():
    with pytest.raises(ConfigurationError, match="mecanum"):
        resolved("follow", leader="hovercraft")


def test_leader_is_an_option_of_follow_alone():
    with pytest.raises(ConfigurationError, match="--leader"):
        resolved("wander", leader="mecanum")


@pytest.mark.slow
def test_wandering_moves_and_touches_nothing():
    result = simulate("wander", RunOptions(duration=20.0, seed=1))
    figures = result.summary["figures"]
    assert figures["path_m"] > 1.0
    assert figures["collisions"] == []
    assert figures["closest_approach_m"] >= 0.10
    assert 0.0 < figures["seen_percent"] <= 100.0
    assert result.success


@pytest.mark.slow
def test_without_a_lidar_the_robot_stands_and_says_why():
    result = simulate("wander", RunOptions(duration=6.0, overrides=("sim.lidar.enabled=false",)))
    assert result.summary["figures"]["path_m"] < 0.02
    assert set(result.summary["figures"]["led_by_percent"]) == {"blind"}
    assert not result.summary["fell"]
    assert not result.success
    last = result.data.telemetry[-1].navigation
    assert "LIDAR" in last.reason


@pytest.mark.slow
def test_waypoints_are_reached_in_order():
    overrides = ("scenario.waypoints=[[0.8, 0.0], [0.8, 0.4]]",)
    result = simulate("goto", RunOptions(duration=30.0, overrides=overrides))
    assert result.success, result.criteria
    assert result.summary["figures"]["waypoints_left"] == 0
    assert math.isfinite(result.summary["figures"]["arrived_s"])
