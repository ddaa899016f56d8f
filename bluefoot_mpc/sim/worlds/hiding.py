"""A room with a marker that screens and cabinets hide from where the robot starts."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bluefoot_mpc.sim.worlds.coverage import visible
from bluefoot_mpc.sim.worlds.layout import PARTITION, Layout, Point, wall
from bluefoot_mpc.sim.worlds.plan import Marker, Solid
from bluefoot_mpc.sim.worlds.rooms import add_cylinder
from bluefoot_mpc.types import FloatArray

_START_RING = 0.30
"""m around the origin from where the marker must be hidden too: the robot moves as it turns."""


def hidden(rng: np.random.Generator) -> Layout:
    """A room with a marker three to five metres away, behind one or two screens."""
    while True:
        layout = _try(rng)
        if layout is not None:
            return layout.turned(int(rng.choice(4, p=(0.55, 0.15, 0.15, 0.15))))


def is_hidden(solids: Sequence[Solid], marker: Marker) -> bool:
    """True where no part of the marker can be seen from about the origin."""
    angles = np.linspace(0.0, 2.0 * math.pi, 16, endpoint=False)
    circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    ball = np.array([marker.x, marker.y]) + np.concatenate([[[0.0, 0.0]], marker.radius * circle])
    eyes: FloatArray = np.concatenate([[[0.0, 0.0]], _START_RING * circle])
    return not any(visible(solids, eye, ball, marker.z).any() for eye in eyes)


def _try(rng: np.random.Generator) -> Layout | None:
    back, ahead = float(rng.uniform(1.2, 1.8)), float(rng.uniform(4.4, 5.4))
    right, left = float(rng.uniform(2.2, 2.9)), float(rng.uniform(2.2, 2.9))
    layout = Layout((-back, -right, ahead, left))
    layout.enclose()
    layout.marker = Marker(
        x=round(float(rng.uniform(2.9, ahead - 1.0)), 3),
        y=round(float(rng.uniform(1.0 - right, left - 1.0)), 3),
    )
    if rng.random() < 0.35:
        things, by_walls = [_stub(layout, layout.marker, rng)], True
    else:
        things, by_walls = _screen(layout, layout.marker, rng), False
    if not layout.has_room(things, by_walls=by_walls):
        return None
    layout.add(*things)
    if not is_hidden(layout.solids, layout.marker):
        return None
    for _ in range(int(rng.integers(2, 5))):
        add_cylinder(layout, rng)
    return layout


def _screen(layout: Layout, marker: Marker, rng: np.random.Generator) -> list[Solid]:
    """A wall between start and marker that stands free, often with a wing at one end."""
    share, length = float(rng.uniform(0.40, 0.60)), float(rng.uniform(1.2, 1.9))
    middle = np.array([marker.x, marker.y]) * share
    angle = math.atan2(marker.y, marker.x) + 0.5 * math.pi + float(rng.uniform(-0.35, 0.35))
    along = 0.5 * length * np.array([math.cos(angle), math.sin(angle)])
    ends = [middle - along, middle + along]
    screen = [wall(layout.name("screen"), _point(ends[0]), _point(ends[1]), PARTITION)]
    if rng.random() < 0.5:
        end, side = ends[int(rng.integers(2))], float(rng.choice([-1.0, 1.0]))
        wing = float(rng.uniform(0.4, 0.7)) * side * np.array([math.sin(angle), -math.cos(angle)])
        screen.append(wall(layout.name("screen"), _point(end), _point(end + wing), PARTITION))
    return screen


def _stub(layout: Layout, marker: Marker, rng: np.random.Generator) -> Solid:
    """A wall between start and marker that begins at the right or the left wall of the room."""
    _, y0, _, y1 = layout.bounds
    x = marker.x * float(rng.uniform(0.40, 0.60))
    wide = float(rng.uniform(1.2, 1.7))
    ends = ((x, y0), (x, y1 - wide)) if rng.random() < 0.5 else ((x, y0 + wide), (x, y1))
    return wall(layout.name("screen"), *ends, PARTITION)


def _point(place: FloatArray) -> Point:
    return float(place[0]), float(place[1])
