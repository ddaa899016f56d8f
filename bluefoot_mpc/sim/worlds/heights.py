"""Heights of the ground of a plan, by geometry: the truth that maps of the ground are measured against."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.sim.worlds.footprint import HEADROOM
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import FloatArray

_ROW = np.dtype(
    [
        (name, np.float64)
        for name in (
            *("x", "y"),  # m, the middle
            "reach",  # m around the middle
            "radius",  # m, of a cylinder; 0 of a box
            *("half", "half_width"),  # m, half of length and width from above
            *("along_x", "along_y"),  # direction of its length; a tilted one rises along it
            *("cosine", "sine"),  # of the tilt
            "top",  # m, the upper side over the middle
            "foot",  # m, lower edge of the high end
        )
    ]
)
"""What is worked out of a solid."""

_Rows = NDArray[np.void]

_AT_ONCE = 200_000
"""Pairs of places and solids that are looked at together: more takes more memory, and no less time."""


def heights(plan: WorldPlan, places: FloatArray) -> FloatArray:
    """(...,) m in world, the top of what stands at places: ground, things, or the floor.

    What hangs over the robot's head does not count.

    Args:
        plan: of the world.
        places: (..., 2) m in world.
    """
    return Relief(plan.solids, plan.floor).height(places)


class Relief:
    """The upper side of solids on a floor.

    Args:
        solids: those that stand; what hangs over the robot's head is left out.
        floor: m, height of the floor in world.
    """

    def __init__(self, solids: Iterable[Solid], floor: float) -> None:
        standing = [s for s in solids if s.z - 0.5 * s.size[2] < floor + HEADROOM]
        self._floor = floor
        self._solids = np.array([_row(s) for s in standing], dtype=_ROW)
        self._x, self._y, self._reach = (self._solids[name].copy() for name in ("x", "y", "reach"))

    def height(self, places: FloatArray) -> FloatArray:
        """(...,) m in world, the highest point at places (..., 2) m in world."""
        wanted = np.asarray(places, dtype=np.float64)
        flat = wanted.reshape(-1, 2)
        found = np.full(len(flat), self._floor)
        chunk = max(1, _AT_ONCE // max(1, len(self._solids)))
        for start in range(0, len(flat), chunk):
            self._raise(flat[start : start + chunk], found[start : start + chunk])
        found[~np.isfinite(flat).all(axis=1)] = math.nan
        return found.reshape(wanted.shape[:-1])

    def clearance(self, points: FloatArray, radius: float) -> FloatArray:
        """(n,) m, how far balls can sink straight down until they touch something; negative inside it.

        A ball over the brim of a gap rests on the brim; a ball beside a block that is higher than its
        middle is beside it, however near, and stands over what is under it.

        Args:
            points: (n, 3) m in world, centres of the balls.
            radius: m, of the balls.
        """
        sunk = points[:, 2] - self._floor - radius
        ball, solid = self._near(points, radius)
        if not len(ball):
            return np.asarray(sunk)
        row, z = self._solids[solid], points[ball, 2]
        u, v = _inside(row, points[ball])
        outside, top = _away(row, u, v), _top(row, u)
        touches = (outside <= 0.0) | ((outside < radius) & (z >= top))
        # A tilted side is met before the ball's lowest point is.
        under = np.sqrt(np.maximum(radius**2 - np.maximum(outside, 0.0) ** 2, 0.0))
        np.minimum.at(sunk, ball[touches], (z - top - under / row["cosine"])[touches])
        return np.asarray(sunk)

    def _raise(self, places: FloatArray, found: FloatArray) -> None:
        """Lift heights (n,) to the tops of what stands at places (n, 2)."""
        place, solid = self._near(places, 0.0)
        row = self._solids[solid]
        u, v = _inside(row, places[place])
        on = _away(row, u, v) <= 0.0
        np.maximum.at(found, place[on], _top(row, u)[on])

    def _near(self, places: FloatArray, margin: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Places and solids, in pairs, that may be within a margin (m) of each other."""
        reach = self._reach + margin
        near = np.abs(places[:, 0, None] - self._x) <= reach
        near &= np.abs(places[:, 1, None] - self._y) <= reach
        place, solid = np.nonzero(near)
        return place, solid


def _row(solid: Solid) -> tuple[float, ...]:
    """A solid as a row of `_ROW`."""
    length, width, height = solid.size
    c, s = math.cos(solid.pitch), math.sin(abs(solid.pitch))
    half = 0.5 * (length * c + height * s)
    radius = half if solid.shape == "cylinder" else 0.0
    sign = -1.0 if solid.pitch > 0.0 else 1.0
    return (
        solid.x, solid.y, radius or math.hypot(half, 0.5 * width), radius, half, 0.5 * width,
        sign * math.cos(solid.yaw), sign * math.sin(solid.yaw), c, s,
        solid.z + 0.5 * height / c, solid.z + 0.5 * (length * s - height * c),
    )  # fmt: skip


def _inside(row: _Rows, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Coordinates (k,) along and across solids of places (k, 2 or 3), m; a tilted one rises ahead."""
    x, y = places[:, 0] - row["x"], places[:, 1] - row["y"]
    return x * row["along_x"] + y * row["along_y"], y * row["along_x"] - x * row["along_y"]


def _away(row: _Rows, u: FloatArray, v: FloatArray) -> FloatArray:
    """(k,) m, distance from solids' outlines from above; zero or less on them."""
    along, across = np.abs(u) - row["half"], np.abs(v) - row["half_width"]
    box = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return np.asarray(np.where(row["radius"] > 0.0, np.hypot(u, v) - row["radius"], box))


def _top(row: _Rows, u: FloatArray) -> FloatArray:
    """(k,) m in world, upper sides of solids at places along them; beyond their ends that of the end."""
    along = np.clip(u, -row["half"], row["half"])
    top = row["top"] + along * row["sine"] / row["cosine"]
    # The high end of a tilted box leans out: there its end is the upper side.
    leaning = row["sine"] > 0.0
    end = row[leaning]
    fall = (end["half"] - along[leaning]) * end["cosine"] / end["sine"]
    top[leaning] = np.minimum(top[leaning], end["foot"] + fall)
    return np.asarray(top)
