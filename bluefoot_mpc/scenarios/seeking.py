"""Scenarios with a marker: finding it behind obstacles, and following a leader that carries it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios import way_figures
from bluefoot_mpc.scenarios.base import NOT_MEASURED, Criterion
from bluefoot_mpc.scenarios.navigating import GuidedConfig, GuidedScenario, safe_criteria, stuck_criterion
from bluefoot_mpc.settings import require_range
from bluefoot_mpc.sim.config import SimConfig
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.types import Guide, GuideTask
from bluefoot_mpc.wheels.ready import READY

DISTANCE_TOLERANCE = 0.05
"""m, of the wanted distance, that the robot may stop from it."""
FOLLOWING_TOLERANCE = 0.15
"""m, of the wanted distance, that the median of a run may differ from it."""
MIN_IN_VIEW = 90.0
"""Percent of the time that the leader has to be in view."""
MAX_LEADER_SPEED = 0.15
"""m/s; a leader any faster leaves the robot behind on its curves."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SeekConfig(GuidedConfig):
    """A marker to look for and to keep a distance from."""

    distance: float = 0.6  # m, horizontal, from the camera to the marker's centre

    def __post_init__(self) -> None:
        GuidedConfig.__post_init__(self)
        require_range(0.4, 2.0, distance=self.distance)


@dataclass(frozen=True, kw_only=True, slots=True)
class ApproachConfig(SeekConfig):
    """A marker that stands somewhere."""

    duration: float = 120.0  # s


class Approach(GuidedScenario):
    """Find a marker behind obstacles, walk up to it and stop."""

    name = "approach"
    Config = ApproachConfig
    config: ApproachConfig
    default_world = "hidden"

    @property
    def needs(self) -> tuple[str, ...]:
        """LIDAR and camera."""
        return ("lidar", "camera")

    def guide(self) -> Guide:
        """Approach."""
        return Guide(task=GuideTask.APPROACH, speed=self.config.speed, distance=self.config.distance)

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """When it saw the marker, where it stopped, and how near it came to things."""
        return {
            **way_figures.nearness(run),
            **way_figures.movement(run),
            **way_figures.distance_figures(run, self.config.distance),
            "first_seen_s": way_figures.first_sight(run),
            "arrived_s": way_figures.arrival(run),
        }

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, nothing touched, and stopped at the wanted distance."""
        error, arrived = summary["figures"]["distance_error_m"], summary["figures"]["arrived_s"]
        stopped = Criterion(
            name=f"stopped within {DISTANCE_TOLERANCE:g} m of the wanted distance",
            holds=arrived is not None and error is not None and abs(error) <= DISTANCE_TOLERANCE,
            detail=_stop_detail(error, arrived),
            figure="distance_error_m",
            goal=f"± {DISTANCE_TOLERANCE:g} m",
        )
        return [*safe_criteria(summary), stuck_criterion(summary), stopped]


@dataclass(frozen=True, kw_only=True, slots=True)
class FollowConfig(SeekConfig):
    """A wheeled leader that carries the marker."""

    duration: float = 120.0  # s
    leader: str = "differential"  # which of the ready wheeled robots
    leader_speed: float = 0.10  # m/s
    leader_path: str = "figure_of_eight"  # see sim.leader.path

    def __post_init__(self) -> None:
        SeekConfig.__post_init__(self)
        if self.leader not in READY:
            raise UnknownNameError("leader", self.leader, READY)
        if not 0.0 <= self.leader_speed <= MAX_LEADER_SPEED:
            raise ConfigurationError(
                f"leader_speed = {self.leader_speed:g} m/s must lie in 0..{MAX_LEADER_SPEED:g}"
            )


class Follow(GuidedScenario):
    """Follow a wheeled leader that carries a marker (--leader differential, mecanum, balancing ...)."""

    name = "follow"
    Config = FollowConfig
    config: FollowConfig
    default_world = "arena"

    @property
    def needs(self) -> tuple[str, ...]:
        """LIDAR and camera."""
        return ("lidar", "camera")

    def guide(self) -> Guide:
        """Follow."""
        return Guide(task=GuideTask.FOLLOW, speed=self.config.speed, distance=self.config.distance)

    def prepare(self, sim: SimConfig) -> SimConfig:
        """Put the leader into the world.

        Raises:
            ConfigurationError: the simulator's own section names another leader.
        """
        config, leader = self.config, LeaderConfig()
        names = {"kind": "leader", "speed": "leader_speed", "path": "leader_path"}
        chosen: dict[str, Any] = {key: getattr(config, name) for key, name in names.items()}
        for key, value in chosen.items():
            given = getattr(sim.leader, key)
            if given not in (value, getattr(leader, key)):
                raise ConfigurationError(
                    f"sim.leader.{key} = {given!r} has no effect here: set scenario.{names[key]} instead"
                )
        return replace(sim, leader=replace(sim.leader, **chosen))

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """How long the leader was in view, at what distance, and how near it came to things."""
        return {
            **way_figures.nearness(run),
            **way_figures.movement(run),
            **way_figures.distance_figures(run, self.config.distance),
            "in_view_percent": way_figures.in_view_percent(run),
        }

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, nothing touched, the leader in view."""
        seen = summary["figures"]["in_view_percent"]
        view = Criterion(
            name=f"leader in view for at least {MIN_IN_VIEW:g} % of the time",
            holds=seen is not None and seen >= MIN_IN_VIEW,
            detail=NOT_MEASURED if seen is None else f"{seen:.1f} %",
            figure="in_view_percent",
            goal=f"≥ {MIN_IN_VIEW:g} %",
        )
        return [*safe_criteria(summary), self._distance_criterion(summary), view]

    def _distance_criterion(self, summary: Mapping[str, Any]) -> Criterion:
        """Who only watches the leader does not follow it."""
        wanted, median = self.config.distance, summary["figures"]["distance_median_m"]
        return Criterion(
            name=f"median distance within {FOLLOWING_TOLERANCE:g} m of the wanted one",
            holds=median is not None and abs(median - wanted) <= FOLLOWING_TOLERANCE,
            detail=NOT_MEASURED if median is None else f"{median:.2f} of {wanted:g} m",
            figure="distance_median_m",
            goal=f"{wanted:g} ± {FOLLOWING_TOLERANCE:g} m",
        )


def _stop_detail(error: float | None, arrived: float | None) -> str:
    if error is None:
        return "there is no marker in this world"
    return f"{error:+.3f} m" if arrived is not None else f"it never stopped there ({error:+.2f} m)"
