"""Gait diagrams as data: who stands when, for two, four and six legs.

A gait is a share of the cycle that each foot stands (duty factor) and the moment
at which each lands, as a share of the cycle. BlueFoot's own gaits are in
`bluefoot_mpc.gait`; these are the textbook's, to draw and to compare.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_range
from bluefoot_mpc.types import LEGS, BoolArray, FloatArray
from bluefoot_mpc.wheels.legs import stability_margin

BIPED: tuple[str, ...] = ("left", "right")
HEXAPOD: tuple[str, ...] = ("L1", "L2", "L3", "R1", "R2", "R3")
"""Legs of a hexapod, left and right, from front to rear."""

_ROUNDED = 1e-9  # share of the cycle within which two events count as one


@dataclass(frozen=True, kw_only=True, slots=True)
class Gait:
    """A periodic gait.

    Attributes:
        name: of the gait.
        legs: names.
        duty: share of the cycle that each foot stands, above 0 and at most 1.
        landing: moment at which each foot lands, as a share of the cycle.
    """

    name: str
    legs: tuple[str, ...]
    duty: float
    landing: tuple[float, ...]

    def __post_init__(self) -> None:
        if not self.legs or len(self.legs) != len(self.landing):
            raise ConfigurationError(
                f"gait '{self.name}': {len(self.legs)} legs need as many landings, not {len(self.landing)}"
            )
        require_range(1e-6, 1.0, duty=self.duty)
        for moment in self.landing:
            require_range(0.0, 1.0, landing=moment)

    def standing(self, phase: FloatArray) -> BoolArray:
        """(n, legs) which feet are on the floor at (n,) shares of the cycle."""
        since = (np.asarray(phase, dtype=np.float64)[:, None] - np.array(self.landing) + _ROUNDED) % 1.0
        return np.asarray(since < self.duty)

    def intervals(self, leg: int) -> list[tuple[float, float]]:
        """Parts of the cycle 0..1 in which one foot stands: a bar of the gait diagram, cut at the end."""
        start = self.landing[leg] % 1.0
        end = start + self.duty
        if self.duty >= 1.0:
            return [(0.0, 1.0)]
        return [(start, end)] if end <= 1.0 + _ROUNDED else [(0.0, end - 1.0), (start, 1.0)]

    def states(self) -> list[tuple[float, tuple[bool, ...]]]:
        """Sequence of support patterns over a cycle: the moment at which each begins, and who stands."""
        moments = sorted({round(m % 1.0, 9) % 1.0 for land in self.landing for m in (land, land + self.duty)})
        patterns = self.standing(np.array(moments))
        states: list[tuple[float, tuple[bool, ...]]] = []
        for moment, pattern in zip(moments, patterns.tolist(), strict=True):
            if not states or states[-1][1] != tuple(pattern):
                states.append((moment, tuple(pattern)))
        return states

    @property
    def support(self) -> tuple[int, int]:
        """Fewest and most feet on the floor."""
        counts = [sum(pattern) for _, pattern in self.states()]
        return min(counts), max(counts)


def wave(duty: float, name: str = "wave") -> Gait:
    """Hexapod gait in which waves of steps run forward, both sides half a cycle apart.

    Args:
        duty: 5/6 lifts one leg at a time, 2/3 is the ripple gait, 1/2 the alternating tripod.
        name: of the gait.
    """
    lag = 1.0 - duty
    left = [(2.0 - i) * lag for i in range(3)]
    return Gait(
        name=name, legs=HEXAPOD, duty=duty,
        landing=tuple(float(round(m % 1.0, 12)) for m in (*left, *(m + 0.5 for m in left))),
    )  # fmt: skip


GAITS: dict[str, Gait] = {
    gait.name: gait
    for gait in (
        Gait(name="biped walk", legs=BIPED, duty=0.6, landing=(0.0, 0.5)),
        Gait(name="biped run", legs=BIPED, duty=0.35, landing=(0.0, 0.5)),
        Gait(name="biped hop", legs=BIPED, duty=0.5, landing=(0.0, 0.0)),
        # Lateral sequence, each hind foot before the fore foot of its side: changeover walking.
        Gait(name="walk", legs=LEGS, duty=0.75, landing=(0.25, 0.75, 0.0, 0.5)),
        Gait(name="crawl", legs=LEGS, duty=0.85, landing=(0.25, 0.75, 0.0, 0.5)),
        Gait(name="trot", legs=LEGS, duty=0.5, landing=(0.0, 0.5, 0.5, 0.0)),
        Gait(name="pace", legs=LEGS, duty=0.5, landing=(0.0, 0.5, 0.0, 0.5)),
        Gait(name="bound", legs=LEGS, duty=0.4, landing=(0.5, 0.5, 0.0, 0.0)),
        Gait(name="transverse gallop", legs=LEGS, duty=0.3, landing=(0.5, 0.6, 0.0, 0.1)),
        Gait(name="rotary gallop", legs=LEGS, duty=0.3, landing=(0.6, 0.5, 0.0, 0.1)),
        Gait(name="pronk", legs=LEGS, duty=0.5, landing=(0.0, 0.0, 0.0, 0.0)),
        wave(1.0 / 2.0, "tripod"),
        wave(2.0 / 3.0, "ripple"),
        wave(5.0 / 6.0, "wave"),
    )
}


def feet_over_cycle(gait: Gait, home: FloatArray, stride: float, phase: FloatArray) -> FloatArray:
    """(n, legs, 2) m, feet relative to a trunk that moves evenly along x.

    Args:
        gait: of k legs.
        home: (k, 2) m, middle of each foot's way on the floor.
        stride: m that the trunk moves in one cycle.
        phase: (n,) shares of the cycle.
    """
    since = (phase[:, None] - np.array(gait.landing) + _ROUNDED) % 1.0
    way = gait.duty * stride
    stance = way * (0.5 - since / gait.duty)
    swing = way * ((since - gait.duty) / max(1.0 - gait.duty, _ROUNDED) - 0.5)
    feet = np.repeat(np.asarray(home, dtype=np.float64)[None], len(phase), axis=0)
    feet[:, :, 0] += np.where(since < gait.duty, stance, swing)
    return feet


def margin_over_cycle(
    gait: Gait, home: FloatArray, stride: float, phase: FloatArray, centre: FloatArray | None = None
) -> FloatArray:
    """(n,) m, static stability margin at shares of the cycle; arguments as in `feet_over_cycle`.

    Args:
        gait: of k legs.
        home: (k, 2) m.
        stride: m.
        phase: (n,).
        centre: (2,) m, centre of mass relative to the trunk; None: at its origin.
    """
    middle = np.zeros(2) if centre is None else centre
    feet, down = feet_over_cycle(gait, home, stride, phase), gait.standing(phase)
    return np.array([stability_margin(f, middle, d) for f, d in zip(feet, down, strict=True)])
