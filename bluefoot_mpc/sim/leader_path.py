"""The ways a leader goes: lines and arcs in a row, by the distance along them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple


class Piece(NamedTuple):
    """A line or an arc.

    Attributes:
        length: m.
        curvature: 1/m, left positive; 0 is a line.
    """

    length: float
    curvature: float


class Point(NamedTuple):
    """A place on a way, in the way's frame: it begins at the origin, along x.

    Attributes:
        x: m.
        y: m.
        heading: rad, of the tangent, left positive; not wrapped.
        curvature: 1/m, left positive.
    """

    x: float
    y: float
    heading: float
    curvature: float


@dataclass(frozen=True, slots=True)
class Way:
    """Lines and arcs, each going on where the one before ends, in its direction.

    Attributes:
        pieces: in their order.
        starts: (n + 1,) m along the way, where each piece begins and the last ends.
        places: (n,) where each piece begins.
        closed: whether the end is the beginning, so that it goes round and round.
    """

    pieces: tuple[Piece, ...]
    starts: tuple[float, ...]
    places: tuple[Point, ...]
    closed: bool

    @property
    def length(self) -> float:
        """m, once around or to the end."""
        return self.starts[-1]

    def at(self, distance: float) -> Point:
        """The place `distance` (m) along the way; beyond the ends of an open one, as its pieces go on."""
        turns, rest = divmod(distance, self.length) if self.closed else (0.0, distance)
        index = 0
        while index < len(self.pieces) - 1 and rest >= self.starts[index + 1]:
            index += 1
        place = self.places[index]
        point = _along(place, rest - self.starts[index], place.curvature)
        if not turns:
            return point
        around = sum(piece.length * piece.curvature for piece in self.pieces)
        return point._replace(heading=point.heading + turns * around)


def line(length: float) -> Way:
    """Straight on for `length` (m), to an end."""
    return _chain((Piece(length, 0.0),), closed=False)


def circle(radius: float) -> Way:
    """A circle to the left of `radius` (m)."""
    return _chain((Piece(2.0 * math.pi * radius, 1.0 / radius),), closed=True)


def figure_of_eight(radius: float) -> Way:
    """A circle to the left and one to the right of `radius` (m), which touch at the beginning.

    It lies within ± radius along x and ± 2 radius along y.
    """
    around = 2.0 * math.pi * radius
    return _chain((Piece(around, 1.0 / radius), Piece(around, -1.0 / radius)), closed=True)


def _chain(pieces: tuple[Piece, ...], *, closed: bool) -> Way:
    starts, places = [0.0], [Point(0.0, 0.0, 0.0, pieces[0].curvature)]
    for index, piece in enumerate(pieces):
        starts.append(starts[-1] + piece.length)
        if index + 1 < len(pieces):
            end = _along(places[-1], piece.length, piece.curvature)
            places.append(end._replace(curvature=pieces[index + 1].curvature))
    return Way(pieces, tuple(starts), tuple(places), closed)


def _along(start: Point, distance: float, curvature: float) -> Point:
    """The place `distance` (m) after `start` on an arc of `curvature` (1/m)."""
    turn = curvature * distance
    heading = start.heading + turn
    if curvature == 0.0:
        x = start.x + distance * math.cos(start.heading)
        y = start.y + distance * math.sin(start.heading)
    else:
        x = start.x + (math.sin(heading) - math.sin(start.heading)) / curvature
        y = start.y - (math.cos(heading) - math.cos(start.heading)) / curvature
    return Point(x, y, heading, curvature)
