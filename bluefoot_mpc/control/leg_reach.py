"""Which places a leg holds, with some room to its limits: a table in the leg's vertical plane."""

from __future__ import annotations

import functools
import math

import numpy as np

from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.types import BoolArray, FloatArray

_CELL = 0.004
_BENT = math.radians(15.0)
"""rad that the knee stays bent by, and the room besides."""
_DIRECTIONS = np.radians(np.arange(-175.0, 1.0, 2.5))


class LegReach:
    """Room to the joint limits at foot places, for the best direction of the last link.

    Args:
        geometry: lengths, hips and limits.
    """

    def __init__(self, geometry: LegGeometry) -> None:
        self._hips = geometry.hips
        self._bounds = geometry.bounds
        self._tables = [
            _table(geometry.links, geometry.bounds[4 * leg + 1 : 4 * leg + 4]) for leg in range(4)
        ]

    def holds(self, leg: int, feet: FloatArray, room: float) -> BoolArray:
        """(k,) whether the leg is at (k, 3) places, m in the trunk's axes, with `room` rad to its limits."""
        hip = self._hips[leg]
        x, y, z = (feet[:, axis] - offset for axis, offset in enumerate((hip.x, hip.y, hip.z)))
        low, high = self._bounds[4 * leg]
        yaw = (np.arctan2(y, x) - hip.azimuth + math.pi) % (2.0 * math.pi) - math.pi
        table, least_z = self._tables[leg]
        row = (np.hypot(x, y) / _CELL).astype(np.intp)
        column = np.floor((z - least_z) / _CELL).astype(np.intp)
        inside = (row < table.shape[0]) & (column >= 0) & (column < table.shape[1])
        found = table[np.where(inside, row, 0), np.where(inside, column, 0)]
        return np.asarray(inside & (found >= room) & (yaw >= low + room) & (yaw <= high - room))


@functools.lru_cache(maxsize=8)
def _table(
    links: tuple[float, float, float, float], bounds: tuple[tuple[float, float], ...]
) -> tuple[FloatArray, float]:
    """Least room to a limit, rad (-inf out of reach), outward by upward cells; height of the lowest."""
    length = sum(links)
    outward = (np.arange(math.ceil(length / _CELL)) + 0.5) * _CELL
    count = math.ceil(1.3 * length / _CELL)
    least_z = -length
    upward = least_z + (np.arange(count) + 0.5) * _CELL
    r, z, gamma = np.meshgrid(outward, upward, _DIRECTIONS, indexing="ij")
    _, a2, a3, a4 = links
    reach, rise = r - links[0] - a4 * np.cos(gamma), z - a4 * np.sin(gamma)
    cosine = (reach**2 + rise**2 - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
    knee = -np.arccos(np.clip(cosine, -1.0, 1.0))
    pitch = np.arctan2(rise, reach) - np.arctan2(a3 * np.sin(knee), a2 + a3 * np.cos(knee))
    pitch = (pitch + math.pi) % (2.0 * math.pi) - math.pi
    ankle = gamma - pitch - knee
    room = -knee - _BENT
    for angle, (low, high) in zip((pitch, knee, ankle), bounds, strict=True):
        room = np.minimum(room, np.minimum(angle - low, high - angle))
    room = np.where(np.abs(cosine) <= 1.0, room, -math.inf).max(axis=2)
    room.flags.writeable = False
    return room, least_z
