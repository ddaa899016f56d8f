"""A corridor with rooms on both sides, joined by doors."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bluefoot_mpc.sim.worlds.layout import PASSAGE, WALL_THICKNESS, Layout, Point

_DOOR = (1.15, 1.35)  # m wide
_FROM_CORNER = 0.15  # m, least, from a door to the next corner
_LEAST_ROOM = 2.3  # m along the corridor


def corridors(rng: np.random.Generator) -> Layout:
    """Three or four rooms along a corridor, each with a door; two neighbours may have one between them."""
    length, width = float(rng.uniform(5.6, 6.4)), float(rng.uniform(1.4, 1.7))
    depths = rng.uniform(2.1, 2.5, 2)
    bounds = (0.0, -float(depths[0]), length, width + float(depths[1]))
    layout = Layout(bounds)
    layout.enclose()
    counts = ((1, 2), (2, 1), (2, 2))[int(rng.integers(3))]
    half = 0.5 * WALL_THICKNESS
    for count, face, back in ((counts[0], -half, bounds[1]), (counts[1], width + half, bounds[3])):
        ends = _split(length, count, rng)
        doors = [_door(low, high, rng) for low, high in pairwise(ends)]
        _wall_with_doors(layout, (0.0, face), (length, face), doors)
        if count == 2:
            across = [_door(0.0, abs(back - face), rng)] if rng.random() < 0.4 else []
            _wall_with_doors(layout, (ends[1], face), (ends[1], back), across)
    return layout.moved(-float(rng.uniform(0.9, length - 0.9)), -0.5 * width).turned(int(rng.integers(4)))


def _split(length: float, count: int, rng: np.random.Generator) -> list[float]:
    """Where the rooms along a corridor begin and end, m."""
    if count == 1:
        return [0.0, length]
    return [0.0, float(rng.uniform(_LEAST_ROOM, length - _LEAST_ROOM)), length]


def _door(low: float, high: float, rng: np.random.Generator) -> tuple[float, float]:
    """Edges of a door somewhere between two corners, m."""
    width = float(rng.uniform(*_DOOR))
    margin = _FROM_CORNER + 0.5 * WALL_THICKNESS
    width = max(PASSAGE, min(width, high - low - 2.0 * margin))
    start = float(rng.uniform(low + margin, high - margin - width))
    return start, start + width


def _wall_with_doors(layout: Layout, start: Point, end: Point, doors: list[tuple[float, float]]) -> None:
    """A wall from point to point, open where the doors are (m from the start, rising)."""
    reach = np.subtract(end, start)
    length = float(np.hypot(*reach))
    along = reach / length
    half = 0.5 * WALL_THICKNESS
    edges = [-half, *(edge for door in doors for edge in door), length + half]
    for low, high in zip(edges[::2], edges[1::2], strict=True):
        # A wall goes on for half its thickness beyond its line's ends.
        one, other = np.array(start) + along * (low + half), np.array(start) + along * (high - half)
        layout.line((float(one[0]), float(one[1])), (float(other[0]), float(other[1])), "partition")
