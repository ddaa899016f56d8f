"""A world while it is being made: walls, things, and the room that must stay between them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

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
MARKER_CLEARANCE = 0.90
"""m, least distance from a marker to anything."""

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


_SIDES = ("wall_front", "wall_left", "wall_back", "wall_right")
"""Outer walls, leftward round, as seen from the start."""
_TURNED_LEFT = dict(zip(_SIDES, (*_SIDES[1:], _SIDES[0]), strict=True))


class Layout:
    """Solids of a world under construction.

    Attributes:
        bounds: m, inner faces of the outer walls.
        solids: placed so far.
        marker: to look for, or None.
    """

    def __init__(self, bounds: Bounds) -> None:
        x0, y0, x1, y1 = bounds
        self.bounds: Bounds = (_round(x0), _round(y0), _round(x1), _round(y1))
        self.solids: list[Solid] = []
        self.marker: Marker | None = None
        self._counts: dict[str, int] = {}

    def name(self, kind: str) -> str:
        """The next free name of a kind: chair1, chair2 ..."""
        self._counts[kind] = self._counts.get(kind, 0) + 1
        return f"{kind}{self._counts[kind]}"

    def add(self, *solids: Solid) -> None:
        """Put solids down, whatever is there."""
        self.solids.extend(solids)

    def line(self, start: Point, end: Point, kind: str = "wall", colour: Colour = WALL) -> None:
        """Put a wall down from point to point."""
        self.add(wall(self.name(kind), start, end, colour))

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
        for name, (start, end), colour in zip(_SIDES, ends, colours, strict=True):
            self.add(wall(name, start, end, colour))

    def has_room(self, things: Sequence[Solid], *, by_walls: bool = False) -> bool:
        """True where new things leave passages to all others, and start and marker free.

        Args:
            things: new ones; the gaps among themselves do not matter.
            by_walls: True where they may touch or be near the outer walls.
        """
        places = [(np.zeros((1, 2)), START_RADIUS)]
        if self.marker is not None:
            places.append((np.array([[self.marker.x, self.marker.y]]), MARKER_CLEARANCE))
        for place, least in places:
            if footprint.nearest(place, things)[0] < least:
                return False
        others = [s for s in self.solids if not (by_walls and s.name.startswith("wall_"))]
        return all(footprint.are_apart(thing, other, PASSAGE) for thing in things for other in others)

    def moved(self, x: float, y: float) -> Layout:
        """The same, shifted by some metres; without a marker."""
        x0, y0, x1, y1 = self.bounds
        layout = Layout((x0 + x, y0 + y, x1 + x, y1 + y))
        layout.add(*(replace(s, x=_round(s.x + x), y=_round(s.y + y)) for s in self.solids))
        return layout

    def turned(self, quarters: int) -> Layout:
        """The same, turned left about the origin by quarter turns."""
        if quarters % 4 == 0:
            return self
        x0, y0, x1, y1 = self.bounds
        layout = Layout((-y1, x0, -y0, x1))
        layout.add(*(_turned_left(solid) for solid in self.solids))
        if self.marker is not None:
            layout.marker = replace(self.marker, x=-self.marker.y, y=self.marker.x)
        return layout.turned(quarters % 4 - 1)

    def plan(self, name: str, seed: int) -> WorldPlan:
        """What was built; the bounds are those of the floor within the outer walls."""
        return WorldPlan(
            name=name, seed=seed, bounds=self.bounds, solids=tuple(self.solids), marker=self.marker
        )


def wall(name: str, start: Point, end: Point, colour: Colour = WALL) -> Solid:
    """A wall along a line, its ends half a thickness beyond the line's."""
    reach = (end[0] - start[0], end[1] - start[1])
    length = math.hypot(*reach) + WALL_THICKNESS
    middle = (0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1]))
    if abs(reach[0]) < 1e-9:  # along y without a turn: easier to read in a file
        return box(name, middle, (WALL_THICKNESS, length, WALL_HEIGHT), 0.0, colour)
    return box(name, middle, (length, WALL_THICKNESS, WALL_HEIGHT), math.atan2(reach[1], reach[0]), colour)


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
        size=(length, width, height), yaw=_turn(yaw), colour=colour,
    )  # fmt: skip


def pick(rng: np.random.Generator, colours: Sequence[Colour] = THINGS) -> Colour:
    """One of the colours."""
    return colours[int(rng.integers(len(colours)))]


def _turned_left(solid: Solid) -> Solid:
    """A solid, turned left about the origin by a quarter."""
    solid = replace(solid, name=_TURNED_LEFT.get(solid.name, solid.name))
    length, width, height = solid.size
    if solid.yaw == 0.0:
        return replace(solid, x=-solid.y, y=solid.x, size=(width, length, height))
    return replace(solid, x=-solid.y, y=solid.x, yaw=_turn(solid.yaw + 0.5 * math.pi))


def _turn(angle: float) -> float:
    """Within ±180°, to a thousandth of a milliradian."""
    return round((angle + math.pi) % (2.0 * math.pi) - math.pi, 6)


def _round(value: float) -> float:
    """To a millimetre: a file stays readable and gives back the same world."""
    return round(float(value), 3)
