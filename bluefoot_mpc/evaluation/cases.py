"""What is measured: a case is a scenario with options, seeds and the limits its figures must keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from bluefoot_mpc.exceptions import UnknownNameError


@dataclass(frozen=True, kw_only=True, slots=True)
class Limit:
    """What one figure of every seed must keep.

    Attributes:
        figure: key of the figures (see `bluefoot_mpc.evaluation.measure`).
        bound: the value that may just be reached.
        side: whether the figure must stay at or below, or at or above it.
        unit: for tables.
    """

    figure: str
    bound: float
    side: Literal["max", "min"] = "max"
    unit: str = ""

    def holds(self, value: float | None) -> bool:
        """True when a seed's figure keeps the limit; an unknown figure does not."""
        if value is None:
            return False
        return value <= self.bound if self.side == "max" else value >= self.bound

    def describe(self) -> str:
        """The limit as a table shows it."""
        sign = "≤" if self.side == "max" else "≥"
        return f"{sign} {self.bound:g} {self.unit}".rstrip()


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """One row of a table of figures: a scenario under fixed options, over seeds.

    Attributes:
        name: row title, unique in its battery.
        scenario: scenario to run.
        options: fields of `RunOptions` beside the seed.
        seeds: seeds to run.
        limits: what every seed must keep.
    """

    name: str
    scenario: str
    options: Mapping[str, Any] = field(default_factory=dict)
    seeds: tuple[int, ...] = tuple(range(10))
    limits: tuple[Limit, ...] = ()


NO_FALL = Limit(figure="falls", bound=0)
SPEED = Limit(figure="speed_error_percent", bound=10.0, unit="%")
DRIFT = Limit(figure="drift_percent", bound=10.0, unit="%")
CLEARANCE = Limit(figure="clearance_mm", bound=8.0, side="min", unit="mm")


def _tilt(bound: float) -> tuple[Limit, Limit]:
    return (
        Limit(figure="roll_rms_deg", bound=bound, unit="°"),
        Limit(figure="pitch_rms_deg", bound=bound, unit="°"),
    )


def walking_cases(seeds: tuple[int, ...] = tuple(range(10)), duration: float = 60.0) -> tuple[Case, ...]:
    """Straight walking at every stated speed, both gaits."""
    bars = {
        ("trot", 0.04): 1.0, ("trot", 0.06): 1.0, ("trot", 0.08): 1.5, ("trot", 0.10): 1.5,
        ("walk", 0.03): 2.0, ("walk", 0.04): 2.0, ("walk", 0.06): None,
    }  # fmt: skip
    common = (NO_FALL, SPEED, DRIFT, CLEARANCE)
    return tuple(
        Case(
            name=f"{gait} {1e3 * speed:.0f} mm/s",
            scenario="walk",
            options={"gait": gait, "speed": speed, "duration": duration},
            seeds=seeds,
            limits=common if tilt is None else (*common, *_tilt(tilt)),
        )
        for (gait, speed), tilt in bars.items()
    )


def estimation_cases(seeds: tuple[int, ...] = tuple(range(10)), duration: float = 60.0) -> tuple[Case, ...]:
    """What the estimator must reach, from rest, walking fast and turning."""
    limits = (
        NO_FALL,
        Limit(figure="attitude_error_deg", bound=0.3, unit="°"),
        Limit(figure="odometry_error_percent", bound=5.0, unit="%"),
    )
    runs = {"straight, 100 mm/s": ("walk", 0.0), "turning 0.3 rad/s, 100 mm/s": ("turn", 0.3)}
    return tuple(
        Case(
            name=f"estimate, {name}",
            scenario=scenario,
            options={"speed": 0.1, "yaw_rate": yaw_rate, "duration": duration},
            seeds=seeds,
            limits=limits,
        )
        for name, (scenario, yaw_rate) in runs.items()
    )


def push_cases(seeds: tuple[int, ...] = tuple(range(10)), directions: int = 8) -> tuple[Case, ...]:
    """Pushes of 2 N·s over 0.1 s, standing and in a trot; the push falls on another phase with each seed."""
    return tuple(
        Case(
            name=f"push 2 N·s to {360.0 * k / directions:.0f}°, {what}",
            scenario="push",
            options={"speed": speed, "impulse": 2.0, "direction": 360.0 * k / directions, "duration": 10.0},
            seeds=seeds,
            limits=(NO_FALL,),
        )
        for what, speed in (("standing", 0.0), ("trot 60 mm/s", 0.06))
        for k in range(directions)
    )


def transition_cases(seeds: tuple[int, ...] = tuple(range(10))) -> tuple[Case, ...]:
    """Trot to walk to trot; the change falls on another phase with each seed."""
    return (
        Case(
            name="trot - walk - trot at 40 mm/s",
            scenario="transition",
            options={"speed": 0.04, "duration": 30.0},
            seeds=seeds,
            limits=(NO_FALL, *_tilt(2.0)),
        ),
    )


def other_robot_cases(seeds: tuple[int, ...] = tuple(range(3))) -> tuple[Case, ...]:
    """A robot 20 % larger walks with the same code."""
    return (
        Case(
            name="20 % larger robot, trot 60 mm/s",
            scenario="walk",
            options={"model": "bluefoot_large", "speed": 0.06, "duration": 30.0},
            seeds=seeds,
            limits=(NO_FALL, SPEED, DRIFT, *_tilt(1.0)),
        ),
    )


def robustness_cases(seeds: tuple[int, ...] = tuple(range(10))) -> tuple[Case, ...]:
    """Randomised robots, as deployment will meet them; reported, no bar but standing."""
    return (
        Case(
            name="trot 60 mm/s, randomised robot",
            scenario="walk",
            options={"speed": 0.06, "duration": 60.0, "randomize": "standard"},
            seeds=seeds,
            limits=(NO_FALL,),
        ),
    )


BATTERIES = {
    "walking": walking_cases,
    "estimation": estimation_cases,
    "pushes": push_cases,
    "transitions": transition_cases,
    "other robots": other_robot_cases,
    "robustness": robustness_cases,
}
"""Batteries by name; each function gives its cases."""


def battery(name: str) -> tuple[Case, ...]:
    """The cases of a battery.

    Raises:
        UnknownNameError: there is no such battery.
    """
    if name not in BATTERIES:
        raise UnknownNameError("battery", name, BATTERIES)
    return BATTERIES[name]()
