"""What solids cover of the floor: distances in the plane, and which solids stand in a robot's way."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from bluefoot_mpc.sim.worlds.plan import Solid
from bluefoot_mpc.types import FloatArray

HEADROOM = 0.40
"""m; what hangs higher than this is not in the robot's way (it is 0.32 m high with its LIDAR)."""

_SPACING = 0.02  # m between points of an outline


def in_the_way(solids: Iterable[Solid]) -> tuple[Solid, ...]:
    """The solids that begin below the robot's head and are no ground to walk on."""
    return tuple(s for s in solids if not s.is_ground and s.z - 0.5 * s.size[2] < HEADROOM)


def crossing(solids: Iterable[Solid], height: float) -> tuple[Solid, ...]:
    """The solids that a level plane cuts.

    Args:
        solids: to choose from.
        height: m, of the plane above the floor.
    """
    return tuple(s for s in solids if abs(s.z - height) < 0.5 * s.size[2])


def unseen(solids: Iterable[Solid], height: float) -> tuple[Solid, ...]:
    """The solids in the robot's way that a level plane passes over or under: a LIDAR never sees them.

    Args:
        solids: to choose from.
        height: m, of the plane above the floor.
    """
    return tuple(s for s in in_the_way(solids) if abs(s.z - height) >= 0.5 * s.size[2])


def distance(points: FloatArray, solid: Solid) -> FloatArray:
    """Distance of points in the plane from a solid's footprint (n,), m; negative inside.

    Args:
        points: (n, 2) m in world.
        solid: seen from above.
    """
    offset = points - (solid.x, solid.y)
    if solid.shape == "cylinder":
        return np.asarray(np.hypot(offset[:, 0], offset[:, 1]) - 0.5 * solid.size[0])
    cosine, sine = math.cos(solid.yaw), math.sin(solid.yaw)
    along = np.abs(offset[:, 0] * cosine + offset[:, 1] * sine) - 0.5 * solid.size[0]
    across = np.abs(offset[:, 1] * cosine - offset[:, 0] * sine) - 0.5 * solid.size[1]
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(along, across), 0.0))


def corners(solid: Solid) -> FloatArray:
    """Corners (4, 2) of a box's footprint, or of the square around a cylinder's, m, leftward round."""
    half = 0.5 * np.array(solid.size[:2])
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    cosine, sine = math.cos(solid.yaw), math.sin(solid.yaw)
    turned = (signs * half) @ np.array([[cosine, sine], [-sine, cosine]])
    return np.asarray(turned + np.array([solid.x, solid.y]))


def outline(solid: Solid) -> FloatArray:
    """Points (n, 2) along the edge of a solid's footprint, 2 cm apart or closer, m in world."""
    if solid.shape == "cylinder":
        radius = 0.5 * solid.size[0]
        angle = np.linspace(0.0, 2.0 * math.pi, max(8, math.ceil(2.0 * math.pi * radius / _SPACING)))
        return np.stack([solid.x + radius * np.cos(angle), solid.y + radius * np.sin(angle)], axis=1)
    ends = corners(solid)
    sides = zip(ends, np.roll(ends, -1, axis=0), strict=True)
    return np.concatenate(
        [np.linspace(a, b, math.ceil(float(np.hypot(*(b - a))) / _SPACING) + 1) for a, b in sides]
    )


def are_apart(one: Solid, other: Solid, least: float) -> bool:
    """True where two solids seen from above keep a distance (m) of each other."""
    between = math.hypot(one.x - other.x, one.y - other.y)
    if between - 0.5 * (math.hypot(*one.size[:2]) + math.hypot(*other.size[:2])) >= least:
        return True
    return gap(one, other) >= least


def gap(one: Solid, other: Solid) -> float:
    """Distance between two solids seen from above, m, to about a millimetre; negative where they overlap."""
    for solid, around in ((one, other), (other, one)):
        if solid.shape == "cylinder":
            return float(distance(np.array([[solid.x, solid.y]]), around)[0]) - 0.5 * solid.size[0]
    return float(min(distance(outline(one), other).min(), distance(outline(other), one).min()))


def nearest(points: FloatArray, solids: Iterable[Solid]) -> FloatArray:
    """Distance of points in the plane from the nearest footprint (n,), m; infinite without solids.

    Args:
        points: (n, 2) m in world.
        solids: seen from above.
    """
    least = np.full(len(points), np.inf)
    for solid in solids:
        np.minimum(least, distance(points, solid), out=least)
    return least
