"""Scenarios: what the robot is asked to do, in which world, and when that counts as a success."""

from bluefoot_mpc.scenarios.base import Criterion, Scenario, ScenarioConfig
from bluefoot_mpc.scenarios.from_log import pipeline_from_log
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.registry import find_scenario, scenario_names
from bluefoot_mpc.scenarios.runner import Presentation, RunResult, run, run_commanded

__all__ = [
    "Criterion",
    "Presentation",
    "RunOptions",
    "RunResult",
    "Scenario",
    "ScenarioConfig",
    "find_scenario",
    "pipeline_from_log",
    "run",
    "run_commanded",
    "scenario_names",
]
