"""Gait parameters over speed: a table in the configuration, read by interpolation."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_range

Law = Literal["virtual_force", "minimum_jerk"]
Vertical = Literal["sine", "quintic"]

# Bounds of each column, checked entry by entry.
BOUNDS = {
    "cycle_time": (0.1, 10.0),
    "swing_share": (0.05, 0.5),
    "step_height": (0.0, 0.1),
    "apex": (0.1, 0.9),
    "ground_matching": (-1.5, 1.5),
    "swing_rate": (1.0, 50.0),
    "stance_lead": (-1.0, 1.0),
    "stance_x": (0.01, 1.0),
    "stance_y": (0.01, 1.0),
    "trunk_height": (0.01, 1.0),
    "trunk_forward": (-0.2, 0.2),
    "ankle_shift": (-1.5, 1.5),
    "level_gain": (0.0, 100.0),
    "mixing": (0.0, 1.0),
    "back_emf": (0.0, 1.0),
}
LENGTHS = ("step_height", "stance_x", "stance_y", "trunk_height", "trunk_forward")  # grow with the robot
NAMES = ("law", "vertical")  # columns of words: the nearest knot's holds, from the next lift-off on


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitTable:
    """Parameters of one gait over the effective speed.

    A column holds one value a knot, one value for all knots, or nothing; then
    the gait's timing laws, the foothold configuration and the posture decide, as
    they do without a table. Between knots values are interpolated linearly,
    beyond them the last one holds.
    """

    speed: tuple[float, ...] = ()  # knots of the effective speed, rising, m/s
    cycle_time: tuple[float, ...] = ()  # s
    swing_share: tuple[float, ...] = ()  # share of the cycle in swing, 1
    step_height: tuple[float, ...] = ()  # m
    apex: tuple[float, ...] = ()  # quintic: progress of the highest point, 1
    ground_matching: tuple[float, ...] = ()  # minimum_jerk: 1 lands at rest on the ground, 0 in b'
    swing_rate: tuple[float, ...] = ()  # virtual_force: sqrt(k_c/m) times the swing time, 1
    stance_lead: tuple[float, ...] = ()  # share of the stance's travel by which feet land ahead, 1
    law: tuple[Law, ...] = ()  # horizontal profile
    vertical: tuple[Vertical, ...] = ()  # vertical profile
    stance_x: tuple[float, ...] = ()  # m, foot from the centre, forward
    stance_y: tuple[float, ...] = ()  # m, foot from the centre, sideways
    trunk_height: tuple[float, ...] = ()  # m, trunk origin above the foot points
    trunk_forward: tuple[float, ...] = ()  # m, trunk origin ahead of the middle of the feet
    ankle_shift: tuple[float, ...] = ()  # rad, added to the ankle direction
    level_gain: tuple[float, ...] = ()  # 1/s, slow integral levelling
    mixing: tuple[float, ...] = ()  # share of the planned torque that the goals feed forward, 1
    back_emf: tuple[float, ...] = ()  # the same of what back-EMF takes, 1
    turn_lever: float = 0.15  # m, effective speed per yaw rate
    lateral_weight: float = 1.0  # how much sideways speed counts in the effective speed, 1

    def __post_init__(self) -> None:
        """Check knots, lengths and ranges."""
        require_nonnegative(turn_lever=self.turn_lever, lateral_weight=self.lateral_weight)
        knots = self.speed
        if any(not math.isfinite(knot) or knot < 0.0 for knot in knots):
            raise ConfigurationError(f"speed = {knots!r} must hold speeds of 0 or more")
        if any(b <= a for a, b in itertools.pairwise(knots)):
            raise ConfigurationError(f"speed = {knots!r} must rise from knot to knot")
        for name in (*BOUNDS, *NAMES):
            column: tuple[Any, ...] = getattr(self, name)
            if len(column) not in (0, 1, len(knots)):
                raise ConfigurationError(
                    f"{name} must hold one value for each of the {len(knots)} speeds, one for all, or none;"
                    f" not {len(column)}"
                )
            if column and not knots:
                raise ConfigurationError(f"{name} needs knots: set speed, too")
        for name, (low, high) in BOUNDS.items():
            for k, value in enumerate(getattr(self, name)):
                require_range(low, high, **{f"{name}[{k}]": value})

    @property
    def empty(self) -> bool:
        """Whether nothing is tabulated."""
        return not any(getattr(self, name) for name in (*BOUNDS, *NAMES))

    def column(self, name: str) -> tuple[Any, ...]:
        """One value a knot; () when the column is empty."""
        values: tuple[Any, ...] = getattr(self, name)
        return values * len(self.speed) if len(values) == 1 else values

    def scaled(self, factor: float) -> GaitTable:
        """The table with every length `factor` times as long, for a robot of that size."""
        if factor == 1.0:
            return self
        lengths: dict[str, Any] = {
            name: tuple(factor * value for value in getattr(self, name)) for name in LENGTHS
        }
        return replace(self, **lengths)

    def effective_speed(self, velocity: complex, yaw_rate: float) -> float:
        """Speed at which the table is read, m/s.

        Args:
            velocity: forward + i left, m/s.
            yaw_rate: rad/s.
        """
        planar = abs(complex(velocity.real, self.lateral_weight * velocity.imag))
        return planar + self.turn_lever * abs(yaw_rate)


def interpolator(
    knots: Sequence[float], rows: Sequence[tuple[float, ...]]
) -> Callable[[float], tuple[float, ...]]:
    """A function that reads rows over knots: linear between them, constant beyond.

    Args:
        knots: (n,) rising.
        rows: (n, m) values.
    """
    last = len(knots) - 1

    def read(place: float) -> tuple[float, ...]:
        if place <= knots[0]:
            return rows[0]
        if place >= knots[last]:
            return rows[last]
        k = 1
        while place > knots[k]:
            k += 1
        low, high = rows[k - 1], rows[k]
        weight = (place - knots[k - 1]) / (knots[k] - knots[k - 1])
        return tuple([a + weight * (b - a) for a, b in zip(low, high, strict=True)])

    return read
