"""Scenarios that walk: straight, turning, from gait to gait, under a push."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.scenarios.base import (
    NOT_MEASURED,
    Criterion,
    Scenario,
    ScenarioConfig,
    at_most,
    not_fallen,
)
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.sim.config import PushConfig, SimConfig, WorldConfig
from bluefoot_mpc.types import Mode, MotionCommand

GaitName = Literal["trot", "walk"]

TILT_LIMIT_DEG = 3.0
"""RMS roll and pitch that the original robot showed; ours must not be worse anywhere."""
FLAT_TILT_LIMITS_DEG = {"trot": ((0.060, 1.0), (0.100, 1.5)), "walk": ((0.040, 2.0),)}
"""By gait: (m/s up to which it holds, degrees RMS) on flat floor."""
MIN_CLEARANCE = 0.008
"""m, median height of a swing on flat floor."""
MAX_IMPULSE = 100.0
"""N·s: throws the robot at 50 m/s; what is beyond tells nothing and breaks the physics."""
_SPEED_TOLERANCE = 1e-9


@dataclass(frozen=True, kw_only=True, slots=True)
class WalkConfig(ScenarioConfig):
    """A constant walking command after a moment of standing."""

    gait: GaitName = "trot"
    speed: float = 0.06  # m/s, forward
    lateral_speed: float = 0.0  # m/s, left
    yaw_rate: float = 0.0  # rad/s, left
    stand_time: float = 1.5  # s before the first step

    def __post_init__(self) -> None:
        ScenarioConfig.__post_init__(self)
        require_nonnegative(stand_time=self.stand_time)
        for name, limit in (("speed", 0.5), ("lateral_speed", 0.3), ("yaw_rate", 1.5)):
            if not abs(getattr(self, name)) <= limit:
                raise ConfigurationError(
                    f"{name} = {getattr(self, name)!r} is beyond what the robot can do (±{limit:g})"
                )


def motion(config: WalkConfig) -> MotionCommand:
    """The walking command of a configuration."""
    return MotionCommand(
        mode=Mode.WALK,
        velocity=np.array([config.speed, config.lateral_speed]),
        yaw_rate=config.yaw_rate,
        gait=config.gait,
    )


class Walk(Scenario):
    """Walk straight at a constant speed."""

    name = "walk"
    Config = WalkConfig

    def command(self, time: float) -> MotionCommand:
        """Stand, then walk."""
        return motion(self.config) if time >= self.config.stand_time else MotionCommand()

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, at the commanded speed, straight, level, lifting its feet."""
        config = self.config
        limit = TILT_LIMIT_DEG
        if is_flat(self.world):
            limit = tilt_limit_deg(config.gait, math.hypot(config.speed, config.lateral_speed))
        found = [not_fallen(summary), *speed_criteria(summary), *level_criteria(summary, limit)]
        moves = config.speed or config.lateral_speed or config.yaw_rate
        return [*found, clearance_criterion(summary)] if moves and is_flat(self.world) else found


def is_flat(world: WorldConfig) -> bool:
    """True for the flat, level floor."""
    return world.name == "flat" and world.slope == 0.0


def tilt_limit_deg(gait: str, speed: float) -> float:
    """Degrees RMS that roll and pitch may have on flat floor, by gait and speed (m/s)."""
    for fastest, limit in FLAT_TILT_LIMITS_DEG[gait]:
        if speed <= fastest + _SPEED_TOLERANCE:
            return limit
    return TILT_LIMIT_DEG


def level_criteria(summary: Mapping[str, Any], limit: float = TILT_LIMIT_DEG) -> list[Criterion]:
    """Roll and pitch RMS of at most `limit` degrees."""
    return [at_most(summary, f"{axis}_rms_deg", limit, f"{axis} RMS", "deg") for axis in ("roll", "pitch")]


def clearance_criterion(summary: Mapping[str, Any]) -> Criterion:
    """The feet swing high enough."""
    seen = summary.get("swing_clearance_median_m")
    return Criterion(
        name=f"swing clearance at least {1e3 * MIN_CLEARANCE:g} mm",
        holds=seen is not None and seen >= MIN_CLEARANCE,
        detail=NOT_MEASURED if seen is None else f"{1e3 * seen:.1f} mm",
        figure="swing_clearance_median_m",
        goal=f"median, ≥ {1e3 * MIN_CLEARANCE:g} mm",
    )


def speed_criteria(summary: Mapping[str, Any]) -> list[Criterion]:
    """Mean speed within 10 % of the command, drift under 10 % of the distance."""
    wanted, seen = summary.get("speed_ref_mps"), summary.get("speed_mps")
    drift, distance = summary.get("lateral_drift_m"), summary.get("distance_m")
    if not wanted:
        return []
    speed = Criterion(
        name="mean speed within 10 % of the command",
        holds=seen is not None and abs(seen - wanted) <= 0.1 * abs(wanted),
        detail=NOT_MEASURED if seen is None else f"{1e3 * seen:.1f} of {1e3 * wanted:.1f} mm/s",
        figure="speed_mps",
        goal=f"commanded {1e3 * wanted:.0f} ± 10 %",
    )
    if drift is None or distance is None:
        return [speed]
    straight = Criterion(
        name="drift under 10 % of the distance",
        holds=abs(drift) <= 0.1 * abs(distance),
        detail=f"{drift:+.3f} m over {distance:.2f} m",
        figure="lateral_drift_m",
        goal="≤ 10 % of the distance",
    )
    return [speed, straight]


@dataclass(frozen=True, kw_only=True, slots=True)
class TurnConfig(WalkConfig):
    """A circle: forward speed and yaw rate together."""

    yaw_rate: float = 0.3  # rad/s


class Turn(Walk):
    """Walk a circle, or turn in place with --speed 0."""

    name = "turn"
    Config = TurnConfig

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, level, and turning as fast as commanded."""
        wanted = self.config.yaw_rate
        seen = (summary.get("figures") or {}).get("yaw_rate_radps")
        close = seen is not None and abs(seen - wanted) <= 0.1 * abs(wanted)
        detail = NOT_MEASURED if seen is None else f"{seen:.3f} of {wanted:.3f} rad/s"
        turns = Criterion(name="yaw rate within 10 % of the command", holds=close, detail=detail)
        return [not_fallen(summary), turns, *level_criteria(summary)]


@dataclass(frozen=True, kw_only=True, slots=True)
class TransitionConfig(WalkConfig):
    """Trot, walk, trot; the shares of the walking time are equal."""

    duration: float = 30.0  # s
    speed: float = 0.04  # m/s


class Transition(Scenario):
    """Change from trot to walk and back without stopping."""

    name = "transition"
    Config = TransitionConfig

    def command(self, time: float) -> MotionCommand:
        """Trot for a third of the walking time, walk for a third, trot again."""
        config = self.config
        if time < config.stand_time:
            return MotionCommand()
        share = (time - config.stand_time) / max(1e-9, config.duration - config.stand_time)
        gait = "walk" if 1.0 / 3.0 <= share < 2.0 / 3.0 else "trot"
        return replace(motion(config), gait=gait)

    def window(self) -> tuple[float, float]:
        """All of the walking, both changes of gait included."""
        return self.config.stand_time + 2.0, self.config.duration

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, level, and as fast as commanded, the changes of gait included."""
        return [not_fallen(summary), *speed_criteria(summary), *level_criteria(summary)]


@dataclass(frozen=True, kw_only=True, slots=True)
class PushScenarioConfig(WalkConfig):
    """A push on the trunk while trotting, or standing with ``speed = 0``."""

    impulse: float = 2.0  # N·s
    direction: float = 90.0  # degrees from forward, left positive
    push_time: float = 6.0  # s
    push_duration: float = 0.1  # s
    duration: float = 12.0  # s

    def __post_init__(self) -> None:
        WalkConfig.__post_init__(self)
        require_positive(impulse=self.impulse, push_duration=self.push_duration)
        if self.impulse > MAX_IMPULSE:
            raise ConfigurationError(f"impulse = {self.impulse:g} N·s must be at most {MAX_IMPULSE:g} N·s")
        require_nonnegative(push_time=self.push_time)
        if self.push_time + self.push_duration >= self.duration:
            raise ConfigurationError(
                f"push_time = {self.push_time:g} s lies beyond the end of the run ({self.duration:g} s)"
            )


class Push(Scenario):
    """Be pushed while trotting (or while standing with --speed 0)."""

    name = "push"
    Config = PushScenarioConfig

    def command(self, time: float) -> MotionCommand:
        """Stand, then walk when there is a speed."""
        moving = self.config.speed or self.config.lateral_speed or self.config.yaw_rate
        return motion(self.config) if moving and time >= self.config.stand_time else MotionCommand()

    def prepare(self, sim: SimConfig) -> SimConfig:
        """Schedule the push."""
        config = self.config
        push = PushConfig(
            time=config.push_time, impulse=config.impulse, direction_deg=config.direction,
            duration=config.push_duration,
        )  # fmt: skip
        return replace(sim, pushes=(*sim.pushes, push))
