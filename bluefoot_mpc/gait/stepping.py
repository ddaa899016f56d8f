"""Steps over rough ground: up first, then across, then down nearly straight.

The usual swings move and lift at once, which is what level ground wants. Between
stones a foot has to leave its hole, pass above all that stands in between, and
come down on a small place. All profiles are quintics, at rest at both ends.
"""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.swing import smooth_step
from bluefoot_mpc.settings import require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class SteppingConfig:
    """When, as shares of a swing's time, a foot on rough ground goes up, across and down."""

    up: float = 0.40  # by then it is highest, 1
    depart: float = 0.12  # it begins to go across, 1
    arrive: float = 0.82  # it is above where it lands, 1
    down: float = 0.45  # it begins to come down, 1

    def __post_init__(self) -> None:
        """Check ranges and order."""
        require_range(0.05, 0.95, up=self.up, arrive=self.arrive, down=self.down)
        require_range(0.0, 0.95, depart=self.depart)
        if not (self.up <= self.down and self.depart < self.arrive):
            raise ConfigurationError(
                f"a step goes up (until {self.up!r}) before it comes down (from {self.down!r}), "
                f"and departs ({self.depart!r}) before it arrives ({self.arrive!r})"
            )


def across(s: float, config: SteppingConfig) -> float:
    """Share of the way across at progress `s` of the swing, both in [0, 1]."""
    u = (s - config.depart) / (config.arrive - config.depart)
    return smooth_step(min(1.0, max(0.0, u)))


def height(s: float, start: float, top: float, goal: float, config: SteppingConfig) -> float:
    """Height at progress `s` of the swing, m.

    Args:
        s: progress in [0, 1].
        start: m, where the foot lifts off.
        top: m, highest point.
        goal: m, where it lands.
        config: when it goes up and down.
    """
    if s <= config.up:
        return start + (top - start) * smooth_step(max(0.0, s / config.up))
    if s <= config.down:
        return top
    return goal + (top - goal) * smooth_step(max(0.0, (1.0 - s) / (1.0 - config.down)))
