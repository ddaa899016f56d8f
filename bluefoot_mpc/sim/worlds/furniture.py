"""A room with furniture: thin legs that are hard to see, seats that hang above the LIDAR's plane."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bluefoot_mpc.sim.worlds.layout import PASSAGE, WOOD, Colour, Layout, Point, box, cylinder, pick
from bluefoot_mpc.sim.worlds.plan import Solid
from bluefoot_mpc.sim.worlds.rooms import by_wall, random_point, some_bounds

SEAT_HEIGHT = 0.45
"""m, middle of a seat."""

Make = Callable[[Point, float], list[Solid]]
"""Makes a thing of several solids at a place (m) and a yaw (rad)."""

_TRIES = 150
_BY_WALL = 0.03  # m between a wall and what stands by it
_SEAT, _SEAT_THICKNESS, _LEG = 0.42, 0.04, 0.018  # m: edge, height, radius of a leg
_BACK_HEIGHT = 0.40
_TABLE_HEIGHT, _TABLE_THICKNESS, _TABLE_LEG = 0.72, 0.03, 0.03
_DARK_WOOD: Colour = (0.45, 0.31, 0.20)


@dataclass(frozen=True, kw_only=True, slots=True)
class _Thing:
    """What is to be placed."""

    make: Make
    reach: float  # m from its middle to its farthest corner
    half: float  # m from its middle to its back, which may stand by a wall
    by_wall: float  # share of those that stand by a wall


def chairs(rng: np.random.Generator) -> Layout:
    """A room with a table, chairs about the room, by its walls and one at the table, and boxes."""
    layout = Layout(some_bounds(rng, (6.0, 6.9), (5.2, 5.9)))
    layout.enclose()
    _place_table(layout, rng)
    for _ in range(int(rng.integers(3, 6))):
        make = partial(chair, layout.name("chair"))
        _place(layout, rng, _Thing(make=make, reach=0.35, half=0.5 * _SEAT + 0.01, by_wall=0.4))
    for _ in range(int(rng.integers(1, 4))):
        size = (
            float(rng.uniform(0.30, 0.55)),
            float(rng.uniform(0.30, 0.40)),
            float(rng.uniform(0.35, 0.55)),
        )
        make = partial(_crate, layout.name("box"), pick(rng), size)
        reach, half = 0.5 * math.hypot(*size[:2]), 0.5 * size[0]
        _place(layout, rng, _Thing(make=make, reach=reach, half=half, by_wall=0.6))
    return layout


def chair(name: str, at: Point, yaw: float) -> list[Solid]:
    """Four legs, a seat and a back; it looks along its yaw."""
    seat = box(f"{name}_seat", at, (_SEAT, _SEAT, _SEAT_THICKNESS), yaw, WOOD)
    height = SEAT_HEIGHT - 0.5 * _SEAT_THICKNESS
    legs = _legs(name, at, yaw, 0.5 * _SEAT - 0.03, (_LEG, height))
    back_at = _shifted(at, yaw, (-0.5 * _SEAT + 0.015, 0.0))
    back = box(f"{name}_back", back_at, (0.03, _SEAT, _BACK_HEIGHT), yaw, WOOD)
    return [
        *legs,
        _raised(seat, SEAT_HEIGHT),
        _raised(back, SEAT_HEIGHT + 0.5 * (_SEAT_THICKNESS + _BACK_HEIGHT)),
    ]


def table(name: str, at: Point, yaw: float, edge: float) -> list[Solid]:
    """A square table on four legs, which the robot can pass under."""
    top = box(f"{name}_top", at, (edge, edge, _TABLE_THICKNESS), yaw, _DARK_WOOD)
    legs = _legs(name, at, yaw, 0.5 * edge - 0.05, (_TABLE_LEG, _TABLE_HEIGHT))
    return [*legs, _raised(top, _TABLE_HEIGHT + 0.5 * _TABLE_THICKNESS)]


def round_table(name: str, at: Point, radius: float) -> list[Solid]:
    """A round table on one post."""
    top = cylinder(f"{name}_top", at, radius, _TABLE_THICKNESS, _DARK_WOOD)
    post = cylinder(f"{name}_post", at, 0.05, _TABLE_HEIGHT, _DARK_WOOD)
    return [post, _raised(top, _TABLE_HEIGHT + 0.5 * _TABLE_THICKNESS)]


def _place_table(layout: Layout, rng: np.random.Generator) -> None:
    name = layout.name("table")
    if rng.random() < 0.3:
        radius = float(rng.uniform(0.40, 0.55))
        top = _Thing(make=lambda at, _: round_table(name, at, radius), reach=radius, half=radius, by_wall=0.0)
        _place(layout, rng, top)
        return
    edge = float(rng.uniform(1.38, 1.50))
    drawn_up = layout.name("chair") if rng.random() < 0.6 else ""

    def make(at: Point, yaw: float) -> list[Solid]:
        solids = table(name, at, yaw, edge)
        if drawn_up:
            # In the middle of a side, half under the top: too narrow on both sides to slip by.
            solids += chair(drawn_up, _shifted(at, yaw, (0.5 * edge + 0.02, 0.0)), yaw + math.pi)
        return solids

    _place(layout, rng, _Thing(make=make, reach=0.75 * edge, half=0.5 * edge, by_wall=0.5))


def _place(layout: Layout, rng: np.random.Generator, thing: _Thing) -> bool:
    """Put a thing where there is room for it; False where none was found."""
    for _ in range(_TRIES):
        if rng.random() < thing.by_wall:
            at, yaw = by_wall(layout, rng, thing.half, _BY_WALL)
        else:
            at, yaw = random_point(layout, rng, thing.reach + PASSAGE), float(rng.uniform(-math.pi, math.pi))
        solids = thing.make(at, yaw)
        # From the outer walls they are far enough away already, or close to one on purpose.
        if layout.has_room(solids, by_walls=True):
            layout.add(*solids)
            return True
    return False


def _crate(name: str, colour: Colour, size: tuple[float, float, float], at: Point, yaw: float) -> list[Solid]:
    return [box(name, at, size, yaw, colour)]


def _legs(name: str, at: Point, yaw: float, reach: float, size: tuple[float, float]) -> list[Solid]:
    """Four legs at the corners of a square; size is radius and height, m."""
    signs = ((1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0))
    return [
        cylinder(f"{name}_leg{k}", _shifted(at, yaw, (reach * x, reach * y)), size[0], size[1], _DARK_WOOD)
        for k, (x, y) in enumerate(signs, start=1)
    ]


def _shifted(at: Point, yaw: float, by: Point) -> Point:
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return at[0] + cosine * by[0] - sine * by[1], at[1] + sine * by[0] + cosine * by[1]


def _raised(solid: Solid, z: float) -> Solid:
    """The same with its middle at another height."""
    return replace(solid, z=round(z, 4))
