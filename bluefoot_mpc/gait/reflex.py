"""Reflex of the pattern generator: legs towards which the trunk falls land sooner.

Paper, chapter 5, with two signs corrected: the direction of the fall is that in
which the trunk tips (falling nose-down is a positive pitch rate and points
forward), and legs in flight react, with a lower step.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.gait.cpg import ONES, Four
from bluefoot_mpc.settings import require_nonnegative, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class ReflexConfig:
    """Reflex on unwanted tilt rates; on level ground it is silent, switched off it costs nothing."""

    enabled: bool = True
    sharpness: float = 20.0  # w, slope of the activation, s/rad
    threshold: float = 1.0  # c, activation half way at this v_i, rad/s
    speed_gain: float = 0.5  # A_ω, how much faster the leg's oscillator turns, 1
    lower_gain: float = 0.5  # A_μ, how much Ψ_M grows (a lower step), 1
    shift: float = 0.0  # a_ε/k_c, displacement of the foothold, m per rad/s
    shift_limit: float = 0.03  # largest displacement, m

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(sharpness=self.sharpness)
        require_nonnegative(
            threshold=self.threshold,
            speed_gain=self.speed_gain,
            lower_gain=self.lower_gain,
            shift=self.shift,
            shift_limit=self.shift_limit,
        )


@dataclass(frozen=True, kw_only=True, slots=True)
class ReflexOutput:
    """Effect on the network and on the footholds.

    Attributes:
        psi_omega: (4,) diagonal of Ψ_ω.
        psi_m: (4,) diagonal of Ψ_M.
        shift: displacement of swinging feet as x + iy, m, heading frame.
    """

    psi_omega: Four = ONES
    psi_m: Four = ONES
    shift: complex = 0j


IDLE = ReflexOutput()
NEGLIGIBLE = -12.0
"""Exponent of an activation that counts as none: 6e-6."""


def fall_direction(tilt_rate_error: Sequence[float]) -> complex:
    """Velocity of the fall as x + iy, rad/s: ε̇ = (e_y, -e_x) of e = ω_est - ω_ref.

    Args:
        tilt_rate_error: (2,) rad/s about x and y of the heading frame.
    """
    return complex(tilt_rate_error[1], -tilt_rate_error[0])


def activation(fall: complex, foot: complex, contact: bool, config: ReflexConfig) -> float:
    """ψ_i of one leg, in [0, 1): how strongly it reacts.

    Args:
        fall: ε̇ as x + iy, rad/s.
        foot: horizontal position of the foot from the trunk as x + iy, m.
        contact: True when the foot stands; then it does not react.
        config: sharpness and threshold.
    """
    if contact:
        return 0.0
    reach = abs(foot)
    along = (foot.real * fall.real + foot.imag * fall.imag) / reach if reach > 0.0 else 0.0
    exponent = config.sharpness * (abs(fall) + along - config.threshold)
    return 0.5 * (1.0 + math.tanh(0.5 * exponent))


def is_quiet(tilt_rate_error: Sequence[float], config: ReflexConfig) -> bool:
    """Whether no leg, wherever it is, would react: no v_i is above twice the speed of the fall."""
    fastest = 2.0 * abs(fall_direction(tilt_rate_error))
    return config.shift == 0.0 and config.sharpness * (fastest - config.threshold) < NEGLIGIBLE


def reflex(
    tilt_rate_error: Sequence[float],
    feet: Sequence[complex],
    contact: Sequence[bool],
    config: ReflexConfig,
) -> ReflexOutput:
    """Reflex of all four legs.

    Args:
        tilt_rate_error: (2,) rad/s, ω_est - ω_ref about x and y of the heading frame.
        feet: (4,) feet from the trunk as x + iy, m, heading frame.
        contact: (4,) True where the foot stands.
        config: gains; disabled gives the idle output.
    """
    if not config.enabled:
        return IDLE
    fall = fall_direction(tilt_rate_error)
    psi = [activation(fall, foot, bool(mu), config) for foot, mu in zip(feet, contact, strict=True)]
    a, b, c, d = psi
    speed, lower = config.speed_gain, config.lower_gain
    shift = config.shift * fall
    size = abs(shift)
    if size > config.shift_limit:
        shift *= config.shift_limit / size
    return ReflexOutput(
        psi_omega=(1.0 + speed * a, 1.0 + speed * b, 1.0 + speed * c, 1.0 + speed * d),
        psi_m=(1.0 + lower * a, 1.0 + lower * b, 1.0 + lower * c, 1.0 + lower * d),
        shift=shift,
    )
