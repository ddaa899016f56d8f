"""Timing and step-height laws of a gait (paper, chapter 5): both follow the commanded speed."""

from __future__ import annotations

import math
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitTiming:
    """Timing, coupling and step height of one gait."""

    swing_share: float = 0.34  # share of the cycle in swing, measured in the coupled network, 1
    coupling_gain: float = 0.15  # strength of K over ω_s, 1
    a_v: float = 380.0  # ω_s per speed, rad/m
    a_omega: float = 40.0  # ω_s per yaw rate, rad/rad
    cycle_min: float = 0.34  # shortest cycle, s
    cycle_max: float = 0.38  # longest cycle, s
    height_v: float = 0.15  # α_v, step height per speed, m per m/s
    height_omega: float = 0.02  # α_ω, step height per yaw rate, m per rad/s
    height_min: float = 0.017  # lowest step, m
    height_max: float = 0.035  # highest step, m

    def __post_init__(self) -> None:
        """Check ranges and order of the bounds."""
        require_range(0.05, 0.5, swing_share=self.swing_share)
        require_range(0.0, 1.0, coupling_gain=self.coupling_gain)
        require_nonnegative(
            a_v=self.a_v,
            a_omega=self.a_omega,
            height_v=self.height_v,
            height_omega=self.height_omega,
            height_min=self.height_min,
        )
        require_positive(cycle_min=self.cycle_min)
        for low, high in (("cycle_min", "cycle_max"), ("height_min", "height_max")):
            if not getattr(self, low) <= getattr(self, high) < math.inf:
                raise ConfigurationError(
                    f"{low} = {getattr(self, low)!r} must not exceed {high} = {getattr(self, high)!r}"
                )


def uncoupled_period(omega: float, alpha: float) -> float:
    """Cycle time T = π / (ω_s α (1 - α)) of one oscillator alone, s."""
    return math.pi / (omega * alpha * (1.0 - alpha))


def cycle_time(speed: float, yaw_rate: float, timing: GaitTiming) -> float:
    """Wanted cycle time, s: the uncoupled period at ω_s = a_v |v| + a_ω |ω|, within its bounds.

    Args:
        speed: m/s.
        yaw_rate: rad/s.
        timing: gains and bounds.
    """
    omega = timing.a_v * abs(speed) + timing.a_omega * abs(yaw_rate)
    if omega <= 0.0:
        return timing.cycle_max
    return min(timing.cycle_max, max(timing.cycle_min, uncoupled_period(omega, timing.swing_share)))


def step_height(speed: float, yaw_rate: float, timing: GaitTiming) -> float:
    """Step height α_v |v| + α_ω |ω| within its bounds, m."""
    height = timing.height_v * abs(speed) + timing.height_omega * abs(yaw_rate)
    return min(timing.height_max, max(timing.height_min, height))
