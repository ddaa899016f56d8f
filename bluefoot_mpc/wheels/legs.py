"""Legs on paper: how many gaits there are, what two legs can do, and when a stance is stable."""

from __future__ import annotations

import itertools
import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.geometry import convex_hull, signed_margin
from bluefoot_mpc.types import BoolArray, FloatArray

LEG_FUNCTIONS: tuple[str, ...] = ("lift", "swing", "position", "balance")
"""What a leg's first, second, third and fourth joint are for; two are the least that walks."""

LEAST_FEET_FOR_STATIC_STABILITY = 3
"""Feet on the floor, not on one line, that hold a robot without moving."""

HUMANOID_FREEDOM: dict[str, int] = {"leg": 5, "arm": 5, "camera": 2}
"""Joints that a humanoid needs at least for each leg, for each arm, and for pan and tilt of its camera."""


class BipedState(NamedTuple):
    """Which legs of a biped are down."""

    left: bool
    right: bool


class BipedSequence(NamedTuple):
    """From one state to another and back.

    Attributes:
        states: numbers of both, in `BIPED_STATES`.
        name: what the biped does when it repeats this.
    """

    states: tuple[int, int]
    name: str


BIPED_STATES: dict[int, BipedState] = {
    1: BipedState(left=True, right=True),
    2: BipedState(left=False, right=True),
    3: BipedState(left=True, right=False),
    4: BipedState(left=False, right=False),
}
"""Todd's four states of two legs."""

_BIPED_NAMES: dict[tuple[int, int], str] = {
    (1, 2): "turning on the right leg",
    (1, 3): "turning on the left leg",
    (1, 4): "hopping with both legs",
    (2, 3): "walking or running",
    (2, 4): "hopping on the right leg",
    (3, 4): "hopping on the left leg",
}


def event_count(legs: int) -> int:
    """Distinct sequences of events of `legs` legs after Todd, (2 k - 1)!.

    Raises:
        ConfigurationError: not a whole number of at least one leg.
    """
    return math.factorial(2 * _checked_legs(legs) - 1)


def alternative_count(legs: int) -> int:
    """The document's other count, 2^(3 (k - 1)), for k legs.

    Raises:
        ConfigurationError: not a whole number of at least one leg.
    """
    return int(2 ** (3 * (_checked_legs(legs) - 1)))


def contact_states(legs: int) -> int:
    """Number of patterns of feet on the floor, 2^k.

    Raises:
        ConfigurationError: not a whole number of at least one leg.
    """
    return int(2 ** _checked_legs(legs))


def biped_sequences() -> tuple[BipedSequence, ...]:
    """The six ways of two legs: each pair of the four states, there and back."""
    return tuple(
        BipedSequence(pair, _BIPED_NAMES[pair]) for pair in itertools.combinations(sorted(BIPED_STATES), 2)
    )


def humanoid_freedom(legs: int = 2, arms: int = 2) -> int:
    """Joints that a humanoid needs at least, with a camera that pans and tilts."""
    parts = HUMANOID_FREEDOM
    return parts["leg"] * legs + parts["arm"] * arms + parts["camera"]


def support_polygon(feet: FloatArray, down: BoolArray | None = None) -> FloatArray:
    """(j, 2) m, corners of the hull of the feet on the floor, counter-clockwise; none without a foot.

    Args:
        feet: (k, 2) or (k, 3) m.
        down: (k,) which of them are on the floor; None: all.

    Raises:
        ConfigurationError: shapes do not fit, or a foot on the floor is not finite.
    """
    points = np.asarray(feet, dtype=np.float64)
    if points.ndim != 2 or points.shape[1] not in (2, 3):
        raise ConfigurationError(f"feet: rows of 2 or 3 coordinates wanted (m), not shape {points.shape}")
    mask = np.ones(len(points), dtype=bool) if down is None else np.asarray(down, dtype=bool)
    if mask.shape != (len(points),):
        raise ConfigurationError(
            f"down: one entry for each of {len(points)} feet wanted, not shape {mask.shape}"
        )
    points = points[mask, :2]
    if not np.isfinite(points).all():
        raise ConfigurationError("feet: a foot on the floor has a coordinate that is not finite")
    return convex_hull(points)


def stability_margin(feet: FloatArray, centre: FloatArray, down: BoolArray | None = None) -> float:
    """Static stability margin: way from the centre of mass to the nearest edge of the support polygon (m).

    Args:
        feet: (k, 2) or (k, 3) m.
        centre: (2,) or (3,) m, centre of mass, same frame; its height plays no part.
        down: (k,) which feet are on the floor; None: all.

    Returns:
        Positive inside; negative outside, and with fewer than three feet down or three on a line, where
        only a point has no margin left; minus infinity without a foot on the floor.

    Raises:
        ConfigurationError: shapes do not fit, or a number is not finite.
    """
    corners = support_polygon(feet, down)
    point = np.asarray(centre, dtype=np.float64)[:2]
    if point.shape != (2,) or not np.isfinite(point).all():
        raise ConfigurationError(f"centre: two finite coordinates wanted (m), not {centre}")
    return signed_margin(point, corners) if len(corners) else -math.inf


def statically_stable(feet: FloatArray, centre: FloatArray, down: BoolArray | None = None) -> bool:
    """Whether the robot would stay as it is: its centre of mass lies over the support polygon."""
    return stability_margin(feet, centre, down) > 0.0


def _checked_legs(legs: int) -> int:
    if not isinstance(legs, (int, np.integer)) or isinstance(legs, bool) or legs < 1:
        raise ConfigurationError(f"legs = {legs!r} must be a whole number of at least 1")
    return int(legs)
