"""Worlds of rough ground: terraces, a ramp, a kerb, a gap and stepping stones, each from a seed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np

from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.ground_pieces import END, HALF_WIDTH, START, cut, shade, slab
from bluefoot_mpc.sim.worlds.ground_rubble import rubble
from bluefoot_mpc.sim.worlds.layout import Bounds, Point
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan

DEPTH = 0.08
"""m, of the floor in a gap and between stepping stones."""

STONES_END = 1.75
"""m along x, where the last row of stepping stones ends at the latest, nearly."""

_FAR = 3.0  # m along x, where the world ends
_MORE = 0.5  # m, by which platforms are longer and wider than the world, so that they fill it when turned
_BACK = -1.6  # m along x, where a platform begins behind the robot
_PLATE = (0.15, 0.30)  # m, sides of a terrace
_RAMP = (0.47, 0.55)  # m along x, where a ramp begins
_EDGE = (0.55, 0.80)  # m along x, where a kerb or a gap begins
_TOP = (0.30, 0.40)  # m, level top of a ramp
_MOST_YAW = math.radians(15.0)


def random_steps(rng: np.random.Generator, config: WorldConfig) -> list[Solid]:
    """Terraces side by side; neighbours in a row differ by a quarter of the greatest height or more."""
    yaw = float(rng.uniform(-1.0, 1.0)) * math.radians(4.0)
    # Turned about its front's middle, the field must not come nearer than `START`.
    x = START + HALF_WIDTH * math.sin(abs(yaw))
    plates: list[Solid] = []
    while x < END:
        depth = cut(rng.uniform(*_PLATE))
        y, last = -HALF_WIDTH - float(rng.uniform(0.0, _PLATE[0])), -1.0
        while y < HALF_WIDTH:
            width = cut(rng.uniform(*_PLATE))
            last = _other_share(rng, last)
            top = max(0.001, last * config.relief)
            middle = _turned((x + 0.5 * depth, y + 0.5 * width), (START, 0.0), yaw)
            name = f"plate{len(plates) + 1}"
            plates.append(slab(name, middle, (depth, width), (0.0, top), yaw, shade(top, config.relief)))
            y += width
        x += depth
    return plates


def ramp(rng: np.random.Generator, config: WorldConfig) -> list[Solid]:
    """A ramp up, a level top, and a ramp down; turned a little."""
    x, yaw = _front(rng, _RAMP)
    angle, rise = math.radians(config.ramp_deg), config.relief
    run, level = rise / math.tan(angle), cut(rng.uniform(*_TOP))
    colour = shade(0.5, 1.0)
    top = slab("top", _ahead(x, yaw, run + 0.5 * level), (level, 2.0 * HALF_WIDTH), (0.0, rise), yaw, colour)
    # As thick as the ramp is high, so that nothing is hollow under it.
    thick = rise + 0.01
    inwards = 0.5 * thick * math.sin(angle)
    size = (run / math.cos(angle), 2.0 * HALF_WIDTH, thick)
    height = 0.5 * rise - 0.5 * thick * math.cos(angle)
    sides = []
    for name, away, pitch in (
        ("up", 0.5 * run + inwards, -angle),
        ("down", 1.5 * run + level - inwards, angle),
    ):
        at = _ahead(x, yaw, away)
        sides.append(
            Solid(
                name=name, shape="box", x=at[0], y=at[1], z=height, size=size, yaw=yaw, pitch=pitch,
                is_ground=True, colour=shade(0.0, 1.0),
            )
        )  # fmt: skip
    return [sides[0], top, sides[1]]


def kerb(rng: np.random.Generator, config: WorldConfig) -> list[Solid]:
    """One step up across the whole way, turned a little; the ground stays up behind it."""
    x, yaw = _front(rng, _EDGE)
    size = (_FAR + _MORE - x, 2.0 * (HALF_WIDTH + _MORE))
    return [slab("kerb", _ahead(x, yaw, 0.5 * size[0]), size, (0.0, config.relief), yaw, shade(0.5, 1.0))]


def gap(rng: np.random.Generator, config: WorldConfig) -> list[Solid]:
    """Two platforms with a gap between them across the whole way, turned a little."""
    x, yaw = _front(rng, _EDGE)
    before, behind = x - _BACK, _FAR + _MORE - x
    width = 2.0 * (HALF_WIDTH + _MORE)
    platforms = (("start", before, -0.5 * before), ("end", behind, config.gap + 0.5 * behind))
    return [
        slab(name, _ahead(x, yaw, away), (length, width), (-DEPTH, 0.0), yaw, shade(0.5, 1.0))
        for name, length, away in platforms
    ]


def stones(rng: np.random.Generator, config: WorldConfig) -> list[Solid]:
    """Rows of square stones between two platforms; gaps are a quarter narrower or wider than asked for.

    Each row begins somewhere else sideways, so that no gait that fits one row fits the next.
    """
    pitch, half = config.stone + config.gap, 0.5 * config.relief
    rows = max(1, int((STONES_END + 1e-9 - START - config.gap) / pitch))
    x = START
    found: list[Solid] = []
    for _ in range(rows):
        x += config.gap * float(rng.uniform(0.75, 1.25))
        y = -HALF_WIDTH - float(rng.uniform(0.0, pitch))
        while y < HALF_WIDTH - config.stone:
            y += config.gap * float(rng.uniform(0.75, 1.25))
            at = (x + 0.5 * config.stone, y + 0.5 * config.stone)
            top = float(rng.uniform(-half, half))
            yaw = float(rng.uniform(-1.0, 1.0)) * math.radians(4.0)
            colour, name = shade(top + half, config.relief), f"stone{len(found) + 1}"
            found.append(slab(name, at, (config.stone,) * 2, (-DEPTH, top), yaw, colour))
            y += config.stone
        x += config.stone
    x += config.gap * float(rng.uniform(0.75, 1.25))
    platforms = (("start", _BACK, START), ("end", x, max(_FAR, x + 1.0)))
    ends = [
        slab(name, (0.5 * (low + high), 0.0), (high - low, 2.0 * HALF_WIDTH), (-DEPTH, 0.0))
        for name, low, high in platforms
    ]
    return [ends[0], *found, ends[1]]


TERRAINS: Mapping[str, Callable[[np.random.Generator, WorldConfig], list[Solid]]] = {
    "rubble": rubble,
    "random_steps": random_steps,
    "ramp": ramp,
    "kerb": kerb,
    "gap": gap,
    "stones": stones,
}
"""What makes the pieces of each kind of rough ground."""


def terrain_plan(config: WorldConfig, rng: np.random.Generator, seed: int) -> WorldPlan:
    """A world of rough ground.

    Args:
        config: its kind and its sizes.
        rng: to draw from.
        seed: that it came from, for the plan.
    """
    pieces = TERRAINS[config.name](rng, config)
    floor = -DEPTH if config.name in {"gap", "stones"} else 0.0
    last = pieces[-1]
    farthest = max(_FAR, last.x + 0.5 * last.size[0] if config.name in {"ramp", "stones"} else 0.0)
    bounds: Bounds = (-1.0, -HALF_WIDTH, round(farthest, 3), HALF_WIDTH)
    return WorldPlan(name=config.name, seed=seed, bounds=bounds, solids=tuple(pieces), floor=floor)


def _front(rng: np.random.Generator, where: tuple[float, float]) -> tuple[float, float]:
    """Where an edge across the way crosses the x axis, m, and its yaw, rad: never nearer than `START`."""
    x = cut(rng.uniform(*where))
    most = min(_MOST_YAW, math.asin((x - START) / HALF_WIDTH))
    return x, round(float(rng.uniform(-most, most)), 6)


def _ahead(x: float, yaw: float, distance: float) -> Point:
    """The point a distance (m) behind the middle of an edge, seen from the start, m in world."""
    return x + distance * math.cos(yaw), distance * math.sin(yaw)


def _turned(point: Point, about: Point, yaw: float) -> Point:
    """A point turned left about another, m in world."""
    x, y = point[0] - about[0], point[1] - about[1]
    c, s = math.cos(yaw), math.sin(yaw)
    return about[0] + c * x - s * y, about[1] + s * x + c * y


def _other_share(rng: np.random.Generator, last: float) -> float:
    """A share of the greatest height, 0..1, that differs from the neighbour's."""
    share = float(rng.random())
    while abs(share - last) < 0.25:
        share = float(rng.random())
    return share
