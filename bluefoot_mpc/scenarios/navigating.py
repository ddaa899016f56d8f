"""Scenarios in which the robot finds its own way by LIDAR: wandering, and going to waypoints."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios import way_figures
from bluefoot_mpc.scenarios.base import NOT_MEASURED, Criterion, Scenario, ScenarioConfig, not_fallen
from bluefoot_mpc.scenarios.coverage import seen_figures
from bluefoot_mpc.settings import require_nonnegative, require_range
from bluefoot_mpc.types import Guide, GuideTask, Mode, MotionCommand

MAX_SPEED = 0.40
"""m/s, the fastest that a trot does."""
MAX_WAY = 1000.0
"""m from the start, along either axis; odometry leads no robot so far."""
MIN_APPROACH = 0.10
"""m, nearest that any part of the robot may come to anything but the floor."""
MAX_STUCK = 10.0
"""s."""
MAX_BLIND = 10.0
"""Percent of the time that the robot may stand because its sensors tell nothing."""
MIN_SEEN = 60.0
"""Percent of the floor that the robot can get at, to be seen by the LIDAR in `SEEN_TIME`."""
SEEN_TIME = 100.0
"""s; shorter runs are not judged by how much they saw."""
ARRIVED = 0.15
"""m, true distance from a waypoint that counts as reached: its tolerance, and what odometry may err."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GuidedConfig(ScenarioConfig):
    """A task for which the robot chooses its motion itself, after a moment of standing."""

    speed: float = 0.20  # m/s, at most
    stand_time: float = 1.5  # s before the first step

    def __post_init__(self) -> None:
        ScenarioConfig.__post_init__(self)
        require_range(0.01, MAX_SPEED, speed=self.speed)
        require_nonnegative(stand_time=self.stand_time)


class GuidedScenario(Scenario):
    """Base of scenarios with a guided task."""

    config: GuidedConfig

    @property
    def needs(self) -> tuple[str, ...]:
        """The LIDAR."""
        return ("lidar",)

    @abstractmethod
    def guide(self) -> Guide:
        """The task."""

    def command(self, time: float) -> MotionCommand:
        """Stand, then do the task."""
        if time < self.config.stand_time:
            return MotionCommand()
        return MotionCommand(mode=Mode.WALK, guide=self.guide())

    def window(self) -> tuple[float, float]:
        """All of it: the robot changes its motion all the time."""
        return self.config.stand_time, self.config.duration


@dataclass(frozen=True, kw_only=True, slots=True)
class WanderConfig(GuidedConfig):
    """Wandering."""

    duration: float = 120.0  # s


class Wander(GuidedScenario):
    """Wander through rooms by LIDAR without touching anything (--world room, corridors, maze ...)."""

    name = "wander"
    Config = WanderConfig
    default_world = "room"

    def guide(self) -> Guide:
        """Wander."""
        return Guide(task=GuideTask.WANDER, speed=self.config.speed)

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """How near it came to things, how far it went, and what its LIDAR saw of the floor."""
        return {**way_figures.nearness(run), **way_figures.movement(run), **seen_figures(run)}

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, nothing touched, never stuck, and most of the floor seen."""
        found = [*safe_criteria(summary), stuck_criterion(summary)]
        seen = summary["figures"].get("seen_percent")
        if self.config.duration < SEEN_TIME or seen is None:
            return found
        named = f"at least {MIN_SEEN:g} % of the reachable floor seen"
        saw = Criterion(
            name=named, holds=seen >= MIN_SEEN, detail=f"{seen:.0f} %",
            figure="seen_percent", goal=f"≥ {MIN_SEEN:g} %",
        )  # fmt: skip
        return [*found, saw]


@dataclass(frozen=True, kw_only=True, slots=True)
class GotoConfig(GuidedConfig):
    """Going to waypoints."""

    duration: float = 60.0  # s, at most
    waypoints: tuple[tuple[float, float], ...] = ((1.5, 0.8), (2.6, -0.8), (0.0, 0.0))  # m from the start

    def __post_init__(self) -> None:
        GuidedConfig.__post_init__(self)
        if not self.waypoints:
            raise ConfigurationError("waypoints: give at least one, e.g. scenario.waypoints=[[1.0, 0.5]]")
        if not all(abs(x) <= MAX_WAY and abs(y) <= MAX_WAY for x, y in self.waypoints):
            raise ConfigurationError(f"waypoints = {self.waypoints} must be numbers within ±{MAX_WAY:g} m")


class Goto(GuidedScenario):
    """Go to waypoints in the odometry frame, around what stands in the way."""

    name = "goto"
    Config = GotoConfig
    config: GotoConfig
    default_world = "arena"

    def guide(self) -> Guide:
        """Go to the waypoints."""
        points = np.array(self.config.waypoints, dtype=np.float64)
        return Guide(task=GuideTask.GOTO, speed=self.config.speed, waypoints=points)

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """How near it came to the waypoints and to things."""
        left = [t.navigation.waypoints_left for t in run.telemetry if t.navigation is not None]
        return {
            **way_figures.nearness(run),
            **way_figures.movement(run),
            "waypoint_distance_m": way_figures.waypoint_distances(run, np.array(self.config.waypoints)),
            "waypoints_left": left[-1] if left else None,
            "arrived_s": way_figures.arrival(run),
        }

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, nothing touched, every waypoint reached."""
        return [*safe_criteria(summary), waypoint_criterion(summary)]


def safe_criteria(summary: Mapping[str, Any]) -> list[Criterion]:
    """On its feet, nothing touched, and not without sensors to go by."""
    led = summary["figures"]["led_by_percent"]
    blind = led.get("blind", 0.0) if led else 100.0
    sighted = Criterion(
        name=f"something to go by for {100.0 - MAX_BLIND:g} % of the time",
        holds=blind <= MAX_BLIND,
        detail=f"{100.0 - blind:.0f} %",
    )
    return [not_fallen(summary), sighted, *nearness_criteria(summary)]


def nearness_criteria(summary: Mapping[str, Any]) -> list[Criterion]:
    """Nothing touched, nothing nearer than `MIN_APPROACH`; nothing to say without truth."""
    figures = summary["figures"]
    touched, near = figures["collisions"], figures["closest_approach_m"]
    if touched is None:
        return []
    found = [
        Criterion(
            name="nothing but the floor touched", holds=not touched, detail=", ".join(touched) or "nothing"
        )
    ]
    if near is not None:
        name = f"nothing nearer than {MIN_APPROACH:g} m"
        kept = Criterion(
            name=name, holds=near >= MIN_APPROACH, detail=f"{near:.3f} m",
            figure="closest_approach_m", goal=f"≥ {MIN_APPROACH:g} m",
        )  # fmt: skip
        found.append(kept)
    return found


def waypoint_criterion(summary: Mapping[str, Any]) -> Criterion:
    """Every waypoint was reached, not given up."""
    distances = summary["figures"]["waypoint_distance_m"]
    worst = max(distances) if distances else None
    return Criterion(
        name=f"every waypoint reached within {ARRIVED:g} m",
        holds=worst is not None and worst <= ARRIVED,
        detail=NOT_MEASURED if worst is None else f"worst {worst:.2f} m",
        figure="waypoint_distance_m",
        goal=f"≤ {ARRIVED:g} m",
    )


def stuck_criterion(summary: Mapping[str, Any]) -> Criterion:
    """Never in one place for more than `MAX_STUCK` while it should move."""
    stuck = summary["figures"]["stuck_longest_s"]
    name = f"never stuck for more than {MAX_STUCK:g} s"
    return Criterion(
        name=name, holds=stuck <= MAX_STUCK, detail=f"{stuck:.1f} s at most",
        figure="stuck_longest_s", goal=f"≤ {MAX_STUCK:g} s",
    )  # fmt: skip
