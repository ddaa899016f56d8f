"""The battery that a configuration must pass before it may move the robot: cases and limits, as data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.limits import Limit
from bluefoot_mpc.evaluation.validation_plan import Plan
from bluefoot_mpc.evaluation.validation_scenarios import ControlledStop, EmergencyStop
from bluefoot_mpc.scenarios.posing import Stand
from bluefoot_mpc.scenarios.walking import Push, Walk, tilt_limit_deg
from bluefoot_mpc.types import N_JOINTS

ROBOTS = ("sim", "emulator")
"""Where every situation is tried: the simulator alone, and the devices' drivers on emulated devices."""
IMPULSE = 1.5
"""N·s of the push, 0.1 s on the trunk; model-based control stands 2 from every side."""

NO_FALL = Limit(figure="falls", bound=0)
LEVEL = tuple(Limit(figure=f"{axis}_rms_deg", bound=1.0, unit="°") for axis in ("roll", "pitch"))
ON_SPEED = Limit(figure="speed_error_percent", bound=10.0, unit="%")
STRAIGHT = Limit(figure="drift_percent", bound=10.0, unit="%")
AT_REST = (
    Limit(figure="rest_s", bound=6.0, unit="s"),
    Limit(figure="rest_tilt_deg", bound=20.0, unit="°"),
    Limit(figure="torque_left", bound=0),
)
"""A controlled stop: in time (the loop's own patience), without tipping over, and limp at its end."""
CUT = (
    Limit(figure="emergency_ms", bound=100.0, unit="ms"),
    Limit(figure="goals_after", bound=0),
    Limit(figure="torque_left", bound=0),
)
"""An emergency stop: every torque off in time, and nothing that would move a servo afterwards."""
DRIVEN_WELL = (
    Limit(figure="protocol_violations", bound=0),
    Limit(figure="eeprom_writes", bound=0),
    # Arming itself: a goal where the joint is, once for each servo.
    Limit(figure="goal_writes_while_off", bound=N_JOINTS),
    Limit(figure="torque_left", bound=0),
)
"""What emulated servos must have seen of their driver, besides."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Situation:
    """One row of the battery, tried on each of `ROBOTS`.

    Attributes:
        name: title.
        scenario: what is run.
        duration: s; of a quick validation no more than `QUICK`.
        walks: takes the speed and the gait that are validated.
        options: of the run, besides.
        limits: what its figures must keep on every robot.
    """

    name: str
    scenario: str
    duration: float
    walks: bool = True
    options: Mapping[str, Any] = field(default_factory=dict)
    limits: tuple[Limit, ...] = (NO_FALL,)


QUICK = 12.0
"""s, longest run of a quick validation."""
SITUATIONS = (
    Situation(name="stand", scenario=Stand.name, duration=8.0, walks=False, limits=(NO_FALL, *LEVEL)),
    Situation(name="walk", scenario=Walk.name, duration=20.0, limits=(NO_FALL, ON_SPEED, STRAIGHT)),
    Situation(
        name="push", scenario=Push.name, duration=12.0,
        options={"impulse": IMPULSE, "direction": 90.0, "push_time": 8.0},
    ),
    Situation(
        name="controlled stop", scenario=ControlledStop.name, duration=8.0, limits=(NO_FALL, *AT_REST)
    ),
    Situation(name="emergency stop", scenario=EmergencyStop.name, duration=8.0, limits=CUT),
)  # fmt: skip
"""The battery. A row that is added here is part of every validation from then on."""


def validation_cases(plan: Plan, config: Path) -> tuple[Case, ...]:
    """The cases of a validation.

    Args:
        plan: how much, and which motion.
        config: file with the configuration under test.
    """
    return tuple(_case(situation, robot, plan, config) for situation in SITUATIONS for robot in ROBOTS)


def _case(situation: Situation, robot: str, plan: Plan, config: Path) -> Case:
    duration = min(situation.duration, QUICK) if plan.quick else situation.duration
    options = {
        "robot": robot, "config": str(config), "randomize": "standard", "duration": duration,
        **situation.options,
    }  # fmt: skip
    limits = situation.limits
    if situation.walks:
        options |= {"speed": plan.speed, "gait": plan.gait}
    if situation.scenario == Walk.name:
        limits = (*limits, *_walking_level(plan))
    if robot != "sim":
        limits = (*limits, *(limit for limit in DRIVEN_WELL if limit not in limits))
    return Case(
        name=f"{situation.name}, {robot}",
        scenario=situation.scenario,
        options=options,
        seeds=plan.numbers,
        limits=limits,
    )


def _walking_level(plan: Plan) -> tuple[Limit, ...]:
    """The bounds on tilt that `bluefoot run walk` has at that gait and speed."""
    bound = tilt_limit_deg(plan.gait, plan.speed)
    return tuple(Limit(figure=f"{axis}_rms_deg", bound=bound, unit="°") for axis in ("roll", "pitch"))
