"""How much is validated, and for which motion; light, so that a command line can use it."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.settings import require_range

LEAST_SEEDS = 3
"""Robots that a record must have been made with to allow a deployment."""
GAITS = ("trot", "walk")


@dataclass(frozen=True, kw_only=True, slots=True)
class Plan:
    """How much is validated, and for which motion.

    Raises:
        ConfigurationError: a value is impossible.
        UnknownNameError: there is no such gait.
    """

    speed: float = 0.06  # m/s, forward
    gait: str = "trot"
    seeds: int = LEAST_SEEDS
    quick: bool = False  # one robot, shorter walks: for development, allows no deployment

    def __post_init__(self) -> None:
        require_range(0.01, 0.5, speed=self.speed)
        require_range(1, 1000, seeds=self.seeds)
        if self.gait not in GAITS:
            raise UnknownNameError("gait", self.gait, GAITS)

    @property
    def is_full(self) -> bool:
        """Whether a record of it may allow a deployment."""
        return not self.quick and self.seeds >= LEAST_SEEDS

    @property
    def numbers(self) -> tuple[int, ...]:
        """The seeds."""
        return (0,) if self.quick else tuple(range(self.seeds))
