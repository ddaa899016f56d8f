"""Settings of the network and of its on-line training, and the law of the learning rate."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range

MOST_NEURONS = 1000
"""Of one hidden layer: two of these take some 3 ms a tick on one core, sixty times the default."""
MOST_DELAYS = 100
"""Samples of a delay line: two seconds at the 50 Hz of the servos."""


@dataclass(frozen=True, kw_only=True, slots=True)
class NarxConfig:
    """Size, feedback and training of the network; errors and values count in the stated scales."""

    hidden: tuple[int, int] = (50, 50)  # neurons of the two hidden layers
    delays: int = 1  # n, samples of the inputs and of the outputs that the network sees
    feedback: Literal["output", "target"] = "output"  # its own predictions (paper), or measured targets
    rate: float = 0.01  # γ, learning rate at the start, 1
    rate_min: float = 1e-5  # floor of γ, 1
    rate_max: float = 0.03  # ceiling of γ, 1; an outer layer of 50 sigmoids is unstable above 2/51
    beta: float = 1e-4  # β, γ shrinks by this share per step while the error grows, 1
    zeta: float = 5e-4  # ζ, γ grows by the share ζβ per step while the error shrinks, 1
    mse_weight: float = 0.01  # λ, weight of the newest error in the low-passed MSE, 1
    weight_scale: float = 1.0  # first weights: standard deviation times the root of a neuron's inputs, 1
    seed: int = 0  # of the first weights
    gradient_bound: float = 20.0  # longer gradients are shortened to this norm; 0 = never, 1
    value_bound: float = 20.0  # scaled inputs and targets are clamped to ± this, 1
    weight_bound: float = 1e3  # norm of all weights from which the network counts as diverged, 1
    error_bound: float = 3.0  # low-passed RMS error per output from which it counts as diverged, 1

    def __post_init__(self) -> None:
        """Check ranges."""
        if len(self.hidden) != 2:
            raise ConfigurationError(f"hidden = {self.hidden!r} must name the sizes of two layers")
        for index, count in enumerate(self.hidden):
            _require_count(f"hidden[{index}]", count, MOST_NEURONS)
        _require_count("delays", self.delays, MOST_DELAYS)
        if self.seed < 0:
            raise ConfigurationError(f"seed = {self.seed!r} must not be negative")
        require_positive(
            rate_min=self.rate_min,
            rate_max=self.rate_max,
            rate=self.rate,
            value_bound=self.value_bound,
            weight_bound=self.weight_bound,
            error_bound=self.error_bound,
            mse_weight=self.mse_weight,
        )
        require_range(0.0, 1.0, mse_weight=self.mse_weight)
        require_nonnegative(
            beta=self.beta, zeta=self.zeta, weight_scale=self.weight_scale, gradient_bound=self.gradient_bound
        )
        if self.beta >= 1.0:
            raise ConfigurationError(f"beta = {self.beta!r} must be below 1: the rate shrinks by this share")
        self._check_rates()

    def _check_rates(self) -> None:
        if self.rate_min >= self.rate_max:
            raise ConfigurationError(
                f"learning rate bounds are empty: rate_min = {self.rate_min:g} is not below "
                f"rate_max = {self.rate_max:g}; lower rate_min or raise rate_max "
                f"(for a constant rate set beta = 0)"
            )
        if not self.rate_min <= self.rate <= self.rate_max:
            raise ConfigurationError(
                f"rate = {self.rate:g} lies outside of its bounds {self.rate_min:g}..{self.rate_max:g}; "
                f"start inside, or move rate_min or rate_max"
            )


def bold_driver(rate: float, grew: bool, config: NarxConfig) -> float:
    """Learning rate of this step: γ(1-β) after a growing error, else γ(1+ζβ), within its bounds.

    Paper, section on the NARX compensator. With the paper's β and ζ the rate
    falls unless the error shrinks on all but one step in 2000: choose ζ > 1 to
    let it rise.

    Args:
        rate: γ of the step before.
        grew: whether the low-passed MSE is larger than on the step before.
        config: β, ζ and the bounds.
    """
    factor = 1.0 - config.beta if grew else 1.0 + config.zeta * config.beta
    return min(max(rate * factor, config.rate_min), config.rate_max)


def low_pass(mse: float, square: float, weight: float) -> float:
    """Low-passed squared error: λ|e|² + (1-λ) MSE (the sign of a printed (λ-1) corrected).

    Args:
        mse: value of the step before.
        square: |e|² of this step.
        weight: λ.
    """
    return weight * square + (1.0 - weight) * mse


def _require_count(name: str, count: int, most: int) -> None:
    if not 1 <= count <= most:
        raise ConfigurationError(f"{name} = {count!r} must be at least 1 and at most {most}")
