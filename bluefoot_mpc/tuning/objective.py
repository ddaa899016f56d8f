"""What makes a gait good: figures of some runs in, one cost out.

The cost of a set of seeds is a sum of ratios to bars, so 1 means "at the bar"::

    cost = attitude + penalties
    attitude = (1 - w) mean(median_roll / bar_roll, median_pitch / bar_pitch)
                   + w mean(worst_roll, worst_pitch) / bar_worst
    penalties = FALL       x share of seeds that fell
              + CLEARANCE  x (millimetres that the lowest seed's clearance lacks to bar + reserve)
              + SPEED      x (excess of the worst seed's speed error over the tolerance, percent)
              + DRIFT      x (excess of the worst seed's drift over the tolerance, percent)
              + CUT        x (joint goals cut at a limit per second, mean)

A search without the clearance term learns to shuffle; without the one on cut
goals it leaves the workspace.
"""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range

FALL, CLEARANCE, SPEED, DRIFT, CUT = 10.0, 0.25, 0.1, 0.05, 0.2
"""Weights of the penalties, see above."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Figures:
    """What one run showed inside its window."""

    fell: bool
    roll: float  # degrees RMS, unsmoothed truth
    pitch: float  # degrees RMS
    clearance: float  # mm, median over swings
    speed_error: float  # percent of the command, signed
    drift: float  # percent of the distance, magnitude
    cuts: float  # events of joint goals cut at a limit, per second
    height: float = 0.0  # mm, mean of the trunk's origin over the world's floor
    torque: float = 0.0  # N·m RMS over the motors
    joint_speed: float = 0.0  # rad/s RMS over the joints
    stopped: float = 0.0  # share of the ticks on which levelling had disengaged itself

    @classmethod
    def of_fall(cls) -> Figures:
        """A run without a window to measure."""
        return cls(fell=True, roll=45.0, pitch=45.0, clearance=0.0, speed_error=-100.0, drift=100.0, cuts=0.0)


@dataclass(frozen=True, kw_only=True, slots=True)
class Bars:
    """What is asked of a case."""

    roll: float  # degrees RMS, median over the seeds
    pitch: float  # degrees RMS, median
    worst: float  # degrees RMS, worst seed, either axis
    clearance: float = 10.0  # mm, lowest seed
    clearance_reserve: float = 1.0  # mm that the search keeps beyond the bar
    speed_tolerance: float = 4.0  # percent
    drift_tolerance: float = 8.0  # percent
    worst_weight: float = 0.35  # share of the worst seed in the attitude's cost

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(roll=self.roll, pitch=self.pitch, worst=self.worst)
        require_nonnegative(
            clearance=self.clearance,
            clearance_reserve=self.clearance_reserve,
            speed_tolerance=self.speed_tolerance,
            drift_tolerance=self.drift_tolerance,
        )
        require_range(0.0, 1.0, worst_weight=self.worst_weight)


def cost(figures: Sequence[Figures], bars: Bars) -> float:
    """Cost of a set of seeds, smaller is better.

    Args:
        figures: one entry for each seed.
        bars: what is asked.

    Raises:
        ConfigurationError: there is no seed.
    """
    if not figures:
        raise ConfigurationError("a cost needs at least one run")
    return attitude(figures, bars) + sum(penalties(figures, bars).values())


def attitude(figures: Sequence[Figures], bars: Bars) -> float:
    """Roll and pitch over their bars: 1 where median and worst seed just reach them."""
    roll, pitch = [f.roll for f in figures], [f.pitch for f in figures]
    middle = 0.5 * (statistics.median(roll) / bars.roll + statistics.median(pitch) / bars.pitch)
    worst = 0.5 * (max(roll) + max(pitch)) / bars.worst
    return (1.0 - bars.worst_weight) * middle + bars.worst_weight * worst


def penalties(figures: Sequence[Figures], bars: Bars) -> dict[str, float]:
    """What each broken condition adds, by name."""
    lowest = min(f.clearance for f in figures)
    speed = max(abs(f.speed_error) for f in figures)
    drift = max(f.drift for f in figures)
    return {
        "fall": FALL * statistics.fmean(f.fell for f in figures),
        "clearance": CLEARANCE * max(0.0, bars.clearance + bars.clearance_reserve - lowest),
        "speed": SPEED * max(0.0, speed - bars.speed_tolerance),
        "drift": DRIFT * max(0.0, drift - bars.drift_tolerance),
        "cut": CUT * statistics.fmean(f.cuts for f in figures),
    }
