"""The scenario in which the robot stands, sweeps the ground ahead with its LIDAR once, and maps it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios.base import Criterion, Scenario, ScenarioConfig, not_fallen
from bluefoot_mpc.scenarios.sweep_figures import OTHERWISE, REACH, sweep_figures
from bluefoot_mpc.settings import require_nonnegative
from bluefoot_mpc.types import Guide, GuideTask, Mode, MotionCommand

MAX_MEDIAN, MAX_95 = 5.0, 15.0
"""mm, error of the map's seen cells within `REACH`: the median, and what 95 % of them keep to."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SweepScenarioConfig(ScenarioConfig):
    """One sweep; its range and levels are of the controller: ``control.crossing.first_sweep``."""

    duration: float = 18.0  # s
    stand_time: float = 1.5  # s before the sweep, in which the attitude settles

    def __post_init__(self) -> None:
        ScenarioConfig.__post_init__(self)
        require_nonnegative(stand_time=self.stand_time)


class Sweep(Scenario):
    """Sweep the ground ahead with the LIDAR and map it, feet planted (--world rubble, kerb, flat ...)."""

    name = "sweep"
    Config = SweepScenarioConfig
    default_world = "rubble"
    config: SweepScenarioConfig

    @property
    def needs(self) -> tuple[str, ...]:
        """The LIDAR."""
        return ("lidar",)

    def command(self, time: float) -> MotionCommand:
        """Stand, then sweep."""
        if time < self.config.stand_time:
            return MotionCommand()
        return MotionCommand(mode=Mode.WALK, gait="walk", guide=Guide(task=GuideTask.SWEEP))

    def window(self) -> tuple[float, float]:
        """All of it."""
        return self.config.stand_time, self.config.duration

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """Points, levels, the map against the truth, and the LIDAR's mounting from a flat floor."""
        return sweep_figures(run)

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, every level reached, and the map as true as it has to be."""
        figures = summary["figures"]
        done = figures["sweeps"] > 0 and not figures["sweep_reason"]
        reason = figures["sweep_reason"] or f"{figures['levels']} levels in {figures['sweep_time_s']:g} s"
        if not figures["sweeps"] and not figures["sweep_reason"]:
            reason = "the run ended before the sweep did"
        whole = Criterion(name="every level of the sweep reached", holds=done, detail=reason)
        return [not_fallen(summary), whole, *_map_criteria(figures), *_mounting_criterion(figures)]


def _mounting_criterion(figures: Mapping[str, Any]) -> list[Criterion]:
    """The LIDAR is mounted as the parameter file says; nothing to say without a flat floor."""
    if "lidar_rpy_deg" not in figures:
        return []
    holds = figures["lidar_mounting"] != OTHERWISE
    angles = ", ".join(f"{angle:.2f}" for angle in figures["lidar_rpy_deg"])
    detail = f"put lidar_rpy_deg = [{angles}] into [sensors] of the parameter file"
    name = "LIDAR mounted as the parameter file says"
    return [Criterion(name=name, holds=holds, detail="yes" if holds else detail)]


def _map_criteria(figures: Mapping[str, Any]) -> list[Criterion]:
    """The map's errors; nothing to say where the true ground is not known."""
    limits = (("median", "map_error_median_mm", MAX_MEDIAN), ("95 %", "map_error_95_mm", MAX_95))
    return [
        Criterion(
            name=f"map within {REACH:g} m: {name} of the errors at most {limit:g} mm",
            holds=figures[key] <= limit, detail=f"{figures[key]:.1f} mm", figure=key, goal=f"≤ {limit:g} mm",
        )
        for name, key, limit in limits
        if figures[key] is not None
    ]  # fmt: skip
