"""The batteries by name: what ``make figures`` measures."""

from __future__ import annotations

from collections.abc import Callable

from bluefoot_mpc.evaluation import ground_cases, law_cases, level_cases, model_cases, way_cases
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.exceptions import UnknownNameError

BATTERIES: dict[str, Callable[[], tuple[Case, ...]]] = {
    "walking": law_cases.walking_cases,
    "estimation": law_cases.estimation_cases,
    "pushes": law_cases.push_cases,
    "transitions": law_cases.transition_cases,
    "other robots": law_cases.other_robot_cases,
    "robustness": law_cases.robustness_cases,
    "mpc trot": model_cases.trot_cases,
    "mpc walk": model_cases.slow_walk_cases,
    "mpc disturbed": model_cases.disturbed_cases,
    "mpc pushes": model_cases.push_battery,
    "mpc manoeuvres": model_cases.manoeuvre_cases,
    "levelling": level_cases.level_battery,
    "wander": way_cases.wander_cases,
    "approach": way_cases.approach_cases,
    "follow": way_cases.follow_cases,
    "sweep": ground_cases.sweep_cases,
    "rough": ground_cases.crossing_cases,
    "rough blind": ground_cases.blind_cases,
    "rough incremental": ground_cases.incremental_cases,
    "rough errors": ground_cases.error_cases,
}
"""Each function gives the cases of its battery."""


def battery(name: str) -> tuple[Case, ...]:
    """The cases of a battery.

    Raises:
        UnknownNameError: there is no such battery.
    """
    if name not in BATTERIES:
        raise UnknownNameError("battery", name, BATTERIES)
    return BATTERIES[name]()
