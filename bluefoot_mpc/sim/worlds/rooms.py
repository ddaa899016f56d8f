"""Worlds of one room: cylinders to walk around, and the arena in which a leader is followed."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.sim.worlds.layout import (
    PARTITION,
    PASSAGE,
    WALL,
    Bounds,
    Colour,
    Layout,
    Point,
    box,
    cylinder,
    pick,
    wall,
)  # fmt: skip
from bluefoot_mpc.sim.worlds.plan import Solid

NEAR_MARKER: Colour = (0.80, 0.22, 0.52)
"""Colour of the arena's misleading wall: the marker's hue, a little paler."""

ARENA_FREE: Bounds = (-1.0, -2.4, 3.8, 2.4)
"""m, least x, least y, greatest x, greatest y: nothing stands here in the arena, whatever the seed."""

_TRIES = 100


def room(rng: np.random.Generator) -> Layout:
    """A rectangular room with upright cylinders and up to two stubs of wall."""
    layout = Layout(some_bounds(rng, (5.6, 7.0), (4.6, 5.8)))
    layout.enclose()
    for _ in range(int(rng.integers(0, 3))):
        add_stub(layout, rng)
    for _ in range(int(rng.integers(5, 9))):
        add_cylinder(layout, rng)
    return layout


def arena(rng: np.random.Generator) -> Layout:
    """A big room, free in the middle, things along its walls, one wall nearly of the marker's colour."""
    x0, y0, x1, y1 = ARENA_FREE
    room_left, room_ahead = float(rng.uniform(0.7, 1.0)), float(rng.uniform(0.7, 1.0))
    side = rng.uniform(0.7, 1.0, 2)
    layout = Layout((x0 - room_left, y0 - float(side[0]), x1 + room_ahead, y1 + float(side[1])))
    colours = [WALL] * 4
    # Mostly where the robot looks while it follows.
    colours[int(rng.choice(4, p=(0.4, 0.25, 0.1, 0.25)))] = NEAR_MARKER
    layout.enclose(colours)
    for _ in range(int(rng.integers(5, 8))):
        _add_along_wall(layout, rng)
    return layout


def some_bounds(rng: np.random.Generator, length: tuple[float, float], width: tuple[float, float]) -> Bounds:
    """A rectangle with the origin somewhere inside, at least 1.1 m from its sides; either way round."""
    sizes = [float(rng.uniform(*length)), float(rng.uniform(*width))]
    if rng.random() < 0.5:
        sizes.reverse()
    low = [-float(rng.uniform(1.1, size - 1.1)) for size in sizes]
    return low[0], low[1], low[0] + sizes[0], low[1] + sizes[1]


def random_point(layout: Layout, rng: np.random.Generator, margin: float) -> Point:
    """A point within the bounds, m in world.

    Args:
        layout: whose bounds count.
        rng: to draw from.
        margin: m, least distance from the bounds.
    """
    x0, y0, x1, y1 = layout.bounds
    return float(rng.uniform(x0 + margin, x1 - margin)), float(rng.uniform(y0 + margin, y1 - margin))


def by_wall(layout: Layout, rng: np.random.Generator, half: float, gap: float) -> tuple[Point, float]:
    """A place by an outer wall and a passage away from the others, m, and the yaw into the room, rad.

    Args:
        layout: whose bounds count.
        rng: to draw from.
        half: m, from the middle of what is to stand there to its sides.
        gap: m, to be left to the wall.
    """
    x0, y0, x1, y1 = layout.bounds
    x, y = random_point(layout, rng, half + PASSAGE)
    inset = half + gap
    return (
        ((x0 + inset, y), 0.0),
        ((x, y0 + inset), 0.5 * math.pi),
        ((x1 - inset, y), math.pi),
        ((x, y1 - inset), -0.5 * math.pi),
    )[int(rng.integers(4))]


def add_cylinder(layout: Layout, rng: np.random.Generator) -> bool:
    """Put a cylinder where there is room for it; False where none was found."""
    radius = float(rng.choice([0.05, 0.08, 0.12, 0.18, 0.25]))
    name, colour, height = layout.name("cylinder"), pick(rng), float(rng.uniform(0.4, 0.6))
    for _ in range(_TRIES):
        thing = cylinder(name, random_point(layout, rng, radius + PASSAGE), radius, height, colour)
        if layout.has_room([thing], by_walls=True):  # it is far enough from them already
            layout.add(thing)
            return True
    return False


def add_stub(layout: Layout, rng: np.random.Generator) -> bool:
    """Put a short wall that begins at an outer wall; False where there was no room for it."""
    x0, y0, x1, y1 = layout.bounds
    name = layout.name("partition")
    for _ in range(_TRIES):
        length = float(rng.uniform(0.8, 1.4))
        x, y = random_point(layout, rng, PASSAGE + 0.1)
        start, end = (
            ((x, y1), (x, y1 - length)),
            ((x, y0), (x, y0 + length)),
            ((x0, y), (x0 + length, y)),
            ((x1, y), (x1 - length, y)),
        )[int(rng.integers(4))]
        stub = wall(name, start, end, PARTITION)
        if layout.has_room([stub], by_walls=True):
            layout.add(stub)
            return True
    return False


def _add_along_wall(layout: Layout, rng: np.random.Generator) -> bool:
    """Put a cylinder or a box against an outer wall; False where there was no room for it."""
    kind = "cylinder" if rng.random() < 0.5 else "box"
    name, colour = layout.name(kind), pick(rng)
    for _ in range(_TRIES):
        half, height = float(rng.uniform(0.10, 0.30)), float(rng.uniform(0.35, 0.6))
        # Some touch the wall, some leave a gap that is clearly too narrow.
        at, _ = by_wall(layout, rng, half, float(rng.choice([0.02, 0.15])))
        thing = (
            cylinder(name, at, half, height, colour)
            if kind == "cylinder"
            else box(name, at, (2.0 * half, 2.0 * half, height), 0.0, colour)
        )
        if layout.has_room([thing], by_walls=True) and _outside(thing, ARENA_FREE):
            layout.add(thing)
            return True
    return False


def _outside(thing: Solid, bounds: Bounds) -> bool:
    reach = 0.5 * math.hypot(*thing.size[:2]) if thing.shape == "box" else 0.5 * thing.size[0]
    x0, y0, x1, y1 = bounds
    away = np.hypot(max(x0 - thing.x, 0.0, thing.x - x1), max(y0 - thing.y, 0.0, thing.y - y1))
    return bool(away >= reach)
