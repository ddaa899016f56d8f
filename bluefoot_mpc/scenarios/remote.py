"""A run that somebody commands from elsewhere: from a ground station, or by a script of steps."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bluefoot_mpc.io.station.steps import Steps, read_steps
from bluefoot_mpc.scenarios.base import Scenario, ScenarioConfig
from bluefoot_mpc.types import GuideTask, MotionCommand


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

    @property
    def needs(self) -> tuple[str, ...]:
        """What the script's tasks are done with; a station may ask for tasks or not."""
        guides = [] if self._steps is None else [c.guide for c in self._steps.commands if c.guide is not None]
        if not guides:
            return ()
        seeks = any(guide.task in (GuideTask.APPROACH, GuideTask.FOLLOW) for guide in guides)
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
