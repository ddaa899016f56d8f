"""What a scenario is: commands over time, a world, and criteria of success."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.names import DEFAULT_CONTROLLER
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.sim.config import SimConfig, WorldConfig
from bluefoot_mpc.types import MotionCommand

MAX_DURATION = 7200.0
"""s; a run is held in memory for its summary and report, about 1.3 GB an hour."""
NOT_MEASURED = "not measured: the run ended within 2 s of the last change of command"


@dataclass(frozen=True, kw_only=True, slots=True)
class ScenarioConfig:
    """What every scenario can be told."""

    duration: float = 20.0  # s, of the whole run

    def __post_init__(self) -> None:
        require_positive(duration=self.duration)
        if self.duration > MAX_DURATION:
            raise ConfigurationError(f"duration = {self.duration:g} s must be at most {MAX_DURATION:g} s")


@dataclass(frozen=True, kw_only=True, slots=True)
class Criterion:
    """One condition of success, and whether it holds.

    Attributes:
        name: what is asked, as a person would say it.
        holds: True when it does.
        detail: the figure that was seen.
        figure: key of the summary's figure that it judges; may be empty.
        goal: what that figure has to be, in few words.
    """

    name: str
    holds: bool
    detail: str
    figure: str = ""
    goal: str = ""


class Scenario(ABC):
    """Base class of scenarios: subclass it, give a name, a configuration and commands.

    A scenario sees the time only: what it commands cannot depend on the
    simulator's truth.

    Attributes:
        name: what it is called on the command line.
        Config: its configuration.
        default_controller: what decides where nobody chooses.
        default_world: where it runs where nobody chooses.
        config: the configuration in force.
        world: the world that it runs in, for criteria that depend on the ground.
    """

    name: ClassVar[str]
    Config: ClassVar[type[ScenarioConfig]] = ScenarioConfig
    default_controller: ClassVar[str] = DEFAULT_CONTROLLER
    default_world: ClassVar[str] = "flat"

    config: Any
    world: WorldConfig = WorldConfig()

    def __init__(self, config: Any = None) -> None:
        self.config = config if config is not None else self.Config()

    @abstractmethod
    def command(self, time: float) -> MotionCommand:
        """The wanted motion at `time` (s since the start)."""

    def control(self, controller: str) -> Mapping[str, Any]:
        """What of the controller's configuration this scenario changes; by default nothing.

        A nested table, on top of the controller's preset and under what the user
        asks for, by file or by override.

        Args:
            controller: name of the controller.
        """
        return {}

    def prepare(self, sim: SimConfig) -> SimConfig:
        """The simulator's configuration for this scenario; by default unchanged."""
        return sim

    def check(self, robot: RobotModel, control: ControlConfig) -> None:  # noqa: B027 - optional
        """Refuse a configuration that this robot cannot do; by default nothing is refused.

        Raises:
            ConfigurationError: the scenario asks for the impossible.
        """

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """The conditions of success, judged from the run's summary."""
        return [not_fallen(summary)]

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """Figures of its own for the summary, by name; by default none."""
        return {}

    @property
    def needs(self) -> tuple[str, ...]:
        """Sensors without which it cannot be done: ``"lidar"``, ``"camera"``; by default none."""
        return ()

    @property
    def uses(self) -> tuple[str, ...]:
        """Sensors that a simulated robot gets for it: those that it needs, or can make use of."""
        return self.needs

    @property
    def scripted(self) -> bool:
        """False where the commands come from a ground station; by default they come from here."""
        return True

    def source(self, time: float) -> MotionCommand | None:
        """The command, or None when the scenario is over."""
        return None if time >= self.config.duration else self.command(time)

    def window(self) -> tuple[float, float] | None:
        """Start and end (s) of what is measured; None: from 2 s after the last change of command."""
        return None

    @classmethod
    def describe(cls) -> str:
        """One line for lists: the first line of the class's docstring."""
        return (cls.__doc__ or "").strip().splitlines()[0] if cls.__doc__ else ""

    def with_duration(self, duration: float) -> Scenario:
        """The same scenario with another duration (s)."""
        return type(self)(replace(self.config, duration=duration))


def not_fallen(summary: Mapping[str, Any]) -> Criterion:
    """The robot did not fall, and nothing stopped it before the end."""
    reason = str(summary["stop_reason"])
    if summary["fell"]:
        how = "the trunk or a link above a foot touched the ground" if reason == "completed" else reason
        return Criterion(name="stays on its feet", holds=False, detail=f"it fell ({how})")
    holds = reason == "completed"
    return Criterion(name="stays on its feet to the end", holds=holds, detail="yes" if holds else reason)


def at_most(summary: Mapping[str, Any], key: str, limit: float, name: str, unit: str) -> Criterion:
    """A figure of the summary is at most `limit`; a missing one does not hold."""
    value = summary.get(key)
    return Criterion(
        name=f"{name} at most {limit:g} {unit}",
        holds=value is not None and value <= limit,
        detail=NOT_MEASURED if value is None else f"{value:.2f} {unit}",
        figure=key,
        goal=f"≤ {limit:g} {unit}",
    )
