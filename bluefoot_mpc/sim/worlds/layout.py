"""A world while it is being made: walls, things, and the room that must stay between them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.plan import Marker, Solid, WorldPlan

Colour = tuple[float, float, float]
Point = tuple[float, float]
Bounds = tuple[float, float, float, float]

WALL_HEIGHT = 0.5
WALL_THICKNESS = 0.10
PASSAGE = 1.05
"""m, least width of what the robot is meant to pass."""
START_RADIUS = 0.70
"""m around the origin that stay free."""

WALL: Colour = (0.80, 0.78, 0.73)
PARTITION: Colour = (0.66, 0.69, 0.72)
WOOD: Colour = (0.62, 0.44, 0.27)
THINGS: tuple[Colour, ...] = (
    (0.25, 0.42, 0.62),
    (0.33, 0.52, 0.36),
    (0.80, 0.58, 0.22),
    (0.45, 0.42, 0.50),
    (0.30, 0.55, 0.58),
)
"""Colours of things: none of them near the marker's."""


class Layout:
    """Solids of a world under construction.

    Attributes:
        bounds: m, inner faces of the outer walls.
        solids: placed so far.
    """

    def __init__(self, bounds: Bounds) -> None:
        self.bounds = bounds
        self.solids: list[Solid] = []
        self._counts: dict[str, int] = {}

    def name(self, kind: str) -> str:
        """The next free name of a kind: chair1, chair2 ..."""
        self._counts[kind] = self._counts.get(kind, 0) + 1
        return f"{kind}{self._counts[kind]}"

    def add(self, *solids: Solid) -> None:
        """Put solids down, whatever is there."""
        self.solids.extend(solids)

    def enclose(self, colours: Sequence[Colour] = (WALL,) * 4) -> None:
        """Outer walls around the bounds: front, left, back and right, seen from the start."""
        x0, y0, x1, y1 = self.bounds
        half = 0.5 * WALL_THICKNESS
        ends = (
            ((x1 + half, y0 - half), (x1 + half, y1 + half)),
            ((x0 - half, y1 + half), (x1 + half, y1 + half)),
            ((x0 - half, y0 - half), (x0 - half, y1 + half)),
            ((x0 - half, y0 - half), (x1 + half, y0 - half)),
        )
        for name, (start, end), colour in zip(("front", "left", "back", "right"), ends, colours, strict=True):
            self.add(wall(f"wall_{name}", start, end, colour))

    def partition(self, start: Point, end: Point) -> Solid:
        """A wall inside the bounds, from point to point."""
        solid = wall(self.name("partition"), start, end, PARTITION)
        self.add(solid)
        return solid

    def has_room(self, things: Sequence[Solid], gap: float = PASSAGE, start: float = START_RADIUS) -> bool:
        """True where new things stay away from all others, from each other's business, and from the start.

        Args:
            things: new ones; their gaps among themselves do not matter.
            gap: m, least distance from what is there.
            start: m, least distance from the origin.
        """
        origin = np.zeros((1, 2))
        for thing in things:
            if footprint.distance(origin, thing)[0] < start:
                return False
            if any(footprint.gap(thing, other) < gap for other in self.solids):
                return False
        return True

    def plan(self, name: str, seed: int, marker: Marker | None = None) -> WorldPlan:
        """What was built; the bounds are those of the floor within the outer walls."""
        return WorldPlan(name=name, seed=seed, bounds=self.bounds, solids=tuple(self.solids), marker=marker)


def wall(name: str, start: Point, end: Point, colour: Colour = WALL) -> Solid:
    """A wall along a line, its ends half a thickness beyond the line's."""
    length = math.hypot(end[0] - start[0], end[1] - start[1])
    return Solid(
        name=name,
        shape="box",
        x=_round(0.5 * (start[0] + end[0])),
        y=_round(0.5 * (start[1] + end[1])),
        z=0.5 * WALL_HEIGHT,
        size=(_round(length + WALL_THICKNESS), WALL_THICKNESS, WALL_HEIGHT),
        yaw=math.atan2(end[1] - start[1], end[0] - start[0]),
        colour=colour,
    )


def cylinder(name: str, at: Point, radius: float, height: float, colour: Colour) -> Solid:
    """An upright cylinder on the floor."""
    diameter, height = _round(2.0 * radius), _round(height)
    return Solid(
        name=name, shape="cylinder", x=_round(at[0]), y=_round(at[1]), z=0.5 * height,
        size=(diameter, diameter, height), colour=colour,
    )  # fmt: skip


def box(name: str, at: Point, size: tuple[float, float, float], yaw: float, colour: Colour) -> Solid:
    """A box on the floor."""
    length, width, height = (_round(value) for value in size)
    return Solid(
        name=name, shape="box", x=_round(at[0]), y=_round(at[1]), z=0.5 * height,
        size=(length, width, height), yaw=_round(yaw), colour=colour,
    )  # fmt: skip


def pick(rng: np.random.Generator, colours: Sequence[Colour] = THINGS) -> Colour:
    """One of the colours."""
    return colours[int(rng.integers(len(colours)))]


def _round(value: float) -> float:
    """To a millimetre: a file stays readable and gives back the same world."""
    return round(float(value), 3)
