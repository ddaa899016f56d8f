"""Last links as upright as the legs allow, for feet among stones.

The widest directions, which walk best on even ground, lean a last link outward by 30 to 50 degrees when
the foot is near the trunk: beside a stone as high as the foot's ball the link lies on it. Here the
direction nearest to the wanted one is taken that leaves the joints some room; where none does, the widest.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.model.legs import AnkleTable, LegGeometry
from bluefoot_mpc.model.legs.ankle_table import CELLS, SHAPE, coordinates
from bluefoot_mpc.model.legs.geometry import ALL_LEGS
from bluefoot_mpc.model.legs.widest import search
from bluefoot_mpc.types import FloatArray

_FROM_REACH, _FROM_HEIGHT = -0.15, -1.0
"""Corner of the table, as in `ankle_table`."""
_BENT = math.radians(20.0)
"""rad that the knee stays bent by, and the room besides: a stretched leg must turn fast to move little."""
_WAY = np.linspace(0.0, 1.0, 41)

_Key = tuple[tuple[float, float, float, float], tuple[tuple[float, float], ...], float, float]


class UprightAnkles(AnkleTable):
    """Directions of the last links near a wanted one, by bilinear interpolation.

    Args:
        geometry: lengths, hips and limits.
        direction: rad, wanted; -pi/2 is straight down.
        room: rad that it must leave to the limits.
    """

    def __init__(self, geometry: LegGeometry, direction: float, room: float) -> None:
        super().__init__(geometry)
        self._hips = geometry
        self._upright = [
            _cells((geometry.links, geometry.bounds[4 * leg + 1 : 4 * leg + 4], direction, room))
            for leg in ALL_LEGS
        ]

    @property
    def grid(self) -> FloatArray:
        """(4 n + 1, 4) rad, as `AnkleTable.grid`; NaN only outside."""
        grid = np.concatenate([*self._upright, np.full((1, 4), math.nan)])
        grid.flags.writeable = False
        return grid

    def directions(self, feet_in_base: FloatArray, legs: Sequence[int] = ALL_LEGS) -> FloatArray:
        """(n,) rad for (n, 3) m, foot points in the base frame; the widest ones outside of the table."""
        rows, columns = SHAPE
        values = super().directions(feet_in_base, legs).tolist()
        for k, (leg, (x, y, z)) in enumerate(zip(legs, feet_in_base.tolist(), strict=True)):
            hip = self._hips.hips[leg]
            row, column = coordinates(self._hips, math.hypot(x - hip.x, y - hip.y), z - hip.z)
            if 0.0 <= row < rows and 0.0 <= column < columns:
                i, j = int(row), int(column)
                corner, outward, upward, twist = self._upright[leg][i * columns + j].tolist()
                values[k] = corner + (row - i) * (outward + twist * (column - j)) + upward * (column - j)
        return np.array(values)


@functools.lru_cache(maxsize=8)
def _cells(key: _Key) -> FloatArray:
    """(n, 4) a corner's direction and its slopes, cell by cell, row by row."""
    links, bounds, direction, room = key
    rows, columns = SHAPE
    size = sum(links[1:]) / CELLS
    reach = size * (np.arange(rows + 1) + _FROM_REACH * CELLS)
    height: FloatArray = np.asarray(size * (np.arange(columns + 1) + _FROM_HEIGHT * CELLS), dtype=np.float64)
    nodes = np.stack([_row(r, height, links, bounds, (direction, room)) for r in reach.tolist()])
    corner = nodes[:-1, :-1]
    outward, upward = nodes[1:, :-1] - corner, nodes[:-1, 1:] - corner
    twist = nodes[1:, 1:] - corner - outward - upward
    cells = np.stack([part.ravel() for part in (corner, outward, upward, twist)], axis=1)
    cells.flags.writeable = False
    return cells


def _row(
    reach: float, height: FloatArray, links: tuple[float, float, float, float],
    bounds: tuple[tuple[float, float], ...], wish: tuple[float, float],
) -> FloatArray:  # fmt: skip
    """(k,) rad at one reach (m from the hip_pitch axis) and k heights (m)."""
    lower, upper = np.array(bounds).T[..., None]
    bearing, distance = np.arctan2(height, reach), np.maximum(np.hypot(reach, height), 1e-9)
    widest = search(links, (bearing, 0.5 * (lower + upper), 0.5 * (upper - lower)), distance, True, 2)
    room = wish[1]
    wanted = np.maximum(widest, wish[0])
    # From the widest direction towards the wanted one, as far as there is room all the way.
    way = widest[:, None] + (wanted - widest)[:, None] * _WAY
    margin = np.maximum(_margin(reach, height[:, None], way, links, bounds), -math.pi)
    short = margin < room
    first = np.where(short.any(axis=1), short.argmax(axis=1), len(_WAY))
    last = np.clip(first - 1, 0, len(_WAY) - 2)
    index = np.arange(len(height))
    inner, outer = margin[index, last], margin[index, last + 1]
    share = np.clip((inner - room) / np.maximum(inner - outer, 1e-9), 0.0, 1.0)
    passed = np.where(first == 0, 0.0, np.where(first == len(_WAY), 1.0, _WAY[last] + share * _WAY[1]))
    return np.asarray(widest + passed * (wanted - widest))


def _margin(
    reach: float, height: FloatArray, gamma: FloatArray,
    links: tuple[float, float, float, float], bounds: tuple[tuple[float, float], ...],
) -> FloatArray:  # fmt: skip
    """Least room of hip_pitch, knee and ankle to their limits, rad; -inf out of reach."""
    _, a2, a3, a4 = links
    along, up = reach - a4 * np.cos(gamma), height - a4 * np.sin(gamma)
    cosine = (along**2 + up**2 - a2 * a2 - a3 * a3) / (2.0 * a2 * a3)
    knee = -np.arccos(np.clip(cosine, -1.0, 1.0))
    pitch = np.arctan2(up, along) - np.arctan2(a3 * np.sin(knee), a2 + a3 * np.cos(knee))
    pitch = (pitch + math.pi) % (2.0 * math.pi) - math.pi
    room = -knee - _BENT
    for angle, (low, high) in zip((pitch, knee, gamma - pitch - knee), bounds, strict=True):
        room = np.minimum(room, np.minimum(angle - low, high - angle))
    return np.where(np.abs(cosine) <= 1.0, room, -math.inf)
