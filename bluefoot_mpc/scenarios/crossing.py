"""The scenario in which the robot crosses rough ground, looking where it steps or blind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios.base import Criterion, Scenario, ScenarioConfig, not_fallen
from bluefoot_mpc.scenarios.crossing_figures import crossing_figures
from bluefoot_mpc.scenarios.options import GAITS
from bluefoot_mpc.settings import require_nonnegative, require_range
from bluefoot_mpc.types import Guide, GuideTask, Mode, MotionCommand

GOAL_TOLERANCE = 0.05
"""m before the goal line at which the true trunk counts as there: what odometry may err."""


@dataclass(frozen=True, kw_only=True, slots=True)
class RoughConfig(ScenarioConfig):
    """Crossing rough ground."""

    duration: float = 140.0  # s
    speed: float = 0.022  # m/s, at most
    goal: float = 1.5  # m ahead of the start, where the goal line lies
    stand_time: float = 1.5  # s before the first step
    blind: bool = False  # walk straight on at one step height, without looking
    incremental: bool = False  # map while walking, with the nose down, rather than stop and sweep
    step_height: float = 0.035  # m, of a blind walk
    gait: str = "walk"  # of a blind walk

    def __post_init__(self) -> None:
        ScenarioConfig.__post_init__(self)
        require_range(0.005, 0.40, speed=self.speed)
        require_range(0.1, 20.0, goal=self.goal)
        require_range(0.005, 0.08, step_height=self.step_height)
        require_nonnegative(stand_time=self.stand_time)
        if self.gait not in GAITS:
            raise UnknownNameError("gait", self.gait, GAITS)
        if self.gait != "walk" and not self.blind:
            raise ConfigurationError(
                f"gait = '{self.gait}' is for a blind walk: footholds are chosen for the gait 'walk' only; "
                "leave it out, or add --blind"
            )
        if self.blind and self.incremental:
            raise ConfigurationError("blind and incremental exclude one another: leave one of them out")


class Rough(Scenario):
    """Cross rough ground: sweep, map, plan, step where it is good (--world rubble, kerb, stones; --blind)."""

    name = "rough"
    Config = RoughConfig
    default_world = "rubble"
    config: RoughConfig

    @property
    def needs(self) -> tuple[str, ...]:
        """The LIDAR, to look where to step."""
        return () if self.config.blind else ("lidar",)

    def control(self, controller: str) -> Mapping[str, Any]:
        """One step height for a blind walk; otherwise how the ground is mapped."""
        if self.config.blind:
            return {"gait": {f"{self.config.gait}_table": {"step_height": [self.config.step_height]}}}
        return {"crossing": {"incremental": self.config.incremental}}

    def command(self, time: float) -> MotionCommand:
        """Stand, then go to the goal line."""
        config = self.config
        if time < config.stand_time:
            return MotionCommand()
        if config.blind:
            return MotionCommand(mode=Mode.WALK, velocity=np.array([config.speed, 0.0]), gait=config.gait)
        guide = Guide(task=GuideTask.CROSS, speed=config.speed, waypoints=np.array([[config.goal, 0.0]]))
        return MotionCommand(mode=Mode.WALK, gait="walk", guide=guide)

    def window(self) -> tuple[float, float]:
        """All of it."""
        return self.config.stand_time, self.config.duration

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """Whether and when it got there, what its map was worth, and where its feet came down."""
        return crossing_figures(run, self.config.goal, GOAL_TOLERANCE)

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, and over the goal line."""
        figures = summary["figures"]
        left = figures["goal_left_m"]
        there = Criterion(
            name=f"the goal line, {self.config.goal:g} m ahead, reached within {GOAL_TOLERANCE:g} m",
            holds=left is not None and left <= GOAL_TOLERANCE,
            detail="no truth" if left is None else f"{max(left, 0.0):.2f} m short of it at best",
            figure="goal_left_m",
            goal=f"≤ {GOAL_TOLERANCE:g} m",
        )
        return [not_fallen(summary), there]
