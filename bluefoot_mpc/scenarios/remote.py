"""A run that somebody commands from elsewhere: from a ground station, or by a script of steps."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bluefoot_mpc.io.station.steps import Steps, read_steps
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios import way_figures
from bluefoot_mpc.scenarios.base import Criterion, Scenario, ScenarioConfig, not_fallen
from bluefoot_mpc.scenarios.navigating import nearness_criteria, waypoint_criterion
from bluefoot_mpc.types import Guide, GuideTask, MotionCommand


@dataclass(frozen=True, kw_only=True, slots=True)
class RemoteConfig(ScenarioConfig):
    """What a commanded run can be told."""

    duration: float = 3600.0  # s, at most
    script: str = ""  # steps, e.g. "walk 5 forward=0.06; turn 3 left=20; sit 2", or a file of them


class Remote(Scenario):
    """Commands come from a ground station (--station ADDRESS) or a script of steps."""

    name = "remote"
    Config = RemoteConfig
    config: RemoteConfig

    def __init__(self, config: Any = None) -> None:
        super().__init__(config)
        self._steps: Steps | None = read_steps(self.config.script) if self.config.script else None

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """Of a script with waypoints: how near it came to them, and to things."""
        ways = [guide.waypoints for guide in self._guides if guide.task is GuideTask.GOTO]
        if not ways:
            return {}
        distances = [distance for way in ways for distance in way_figures.waypoint_distances(run, way)]
        return {**way_figures.nearness(run), "waypoint_distance_m": distances}

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet; the waypoints of a script reached, and nothing touched on the way."""
        if "waypoint_distance_m" not in summary["figures"]:
            return [not_fallen(summary)]
        return [not_fallen(summary), *nearness_criteria(summary), waypoint_criterion(summary)]

    @property
    def _guides(self) -> list[Guide]:
        """Tasks of the script."""
        commands = [] if self._steps is None else self._steps.commands
        return [command.guide for command in commands if command.guide is not None]

    @property
    def needs(self) -> tuple[str, ...]:
        """What the script's tasks are done with; a station may ask for tasks or not."""
        if not self._guides:
            return ()
        seeks = any(guide.task in (GuideTask.APPROACH, GuideTask.FOLLOW) for guide in self._guides)
        return ("lidar", "camera") if seeks else ("lidar",)

    @property
    def uses(self) -> tuple[str, ...]:
        """A station's waypoints are found by LIDAR."""
        return self.needs or (() if self.scripted else ("lidar",))

    @property
    def scripted(self) -> bool:
        """True where a script leads, and a station only looks on."""
        return self._steps is not None

    def command(self, time: float) -> MotionCommand:
        """The script's command; without a script the robot stands until a station takes over."""
        return self._steps.at(time) if self._steps is not None else MotionCommand()

    def source(self, time: float) -> MotionCommand | None:
        """The command, or None when script or time are over."""
        if self._steps is not None and time >= self._steps.duration:
            return None
        return super().source(time)

    def window(self) -> tuple[float, float]:
        """All of it: commands change too often for anything else."""
        return 0.0, self.config.duration
