"""Rubble: blocks of many sizes on the floor, turned at random, none over another."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.ground_pieces import END, HALF_WIDTH, START, shade, slab
from bluefoot_mpc.sim.worlds.plan import Solid
from bluefoot_mpc.types import BoolArray, FloatArray

COVER = (0.55, 0.58)
"""Share of the rough ground that blocks cover, drawn from this range by the seed."""

_SIZES = ((0.15, 0.11, 0.72), (0.11, 0.08, 0.88), (0.08, 0.055, 0.97), (0.055, 0.04, 1.0))
"""Greatest and least length of blocks (m), and the share of the cover reached with them.

Great ones are put down first, small ones fill what is left.
"""
_SLIMMEST = 0.7  # width over length, at the least
_SMALLEST = 0.04  # m
_LOWEST = 0.002  # m
_TRIES = 300  # at once
_ROUNDS = 8  # at the most, for each range of sides


def rubble(rng: np.random.Generator, config: WorldConfig) -> list[Solid]:
    """Blocks with sides of 4 to 15 cm and heights, all equally likely, up to the greatest."""
    blocks = _scatter(rng, float(rng.uniform(*COVER)) * (END - START) * 2.0 * HALF_WIDTH)
    tops = rng.uniform(min(_LOWEST, config.relief), config.relief, len(blocks))
    return [
        slab(f"block{k + 1}", (x, y), (length, width), (0.0, top), yaw, shade(top, config.relief))
        for k, ((x, y, length, width, yaw), top) in enumerate(
            zip(blocks.tolist(), tops.tolist(), strict=True)
        )
    ]


def _scatter(rng: np.random.Generator, area: float) -> FloatArray:
    """Rectangles (n, 5) that keep off each other: x, y, length, width (m) and yaw (rad).

    Args:
        rng: to draw from.
        area: m², wanted sum of their areas.
    """
    placed = np.zeros((0, 5))
    for high, low, share in _SIZES:
        for _ in range(_ROUNDS):
            placed = _add(placed, _draw(rng, low, high))
            covered = np.cumsum(placed[:, 2] * placed[:, 3])
            if covered[-1] >= share * area:
                placed = placed[: int(np.argmax(covered >= share * area)) + 1]
                break
    return np.asarray(placed)


def _draw(rng: np.random.Generator, low: float, high: float) -> FloatArray:
    """Rectangles (n, 5) within the rough ground, whatever is there: x, y, length, width (m), yaw (rad)."""
    length = rng.uniform(low, high, _TRIES)
    width = np.maximum(length * rng.uniform(_SLIMMEST, 1.0, _TRIES), _SMALLEST)
    sides = np.round(np.column_stack((length, width)), 3)
    yaw = np.round(rng.uniform(-0.5 * math.pi, 0.5 * math.pi, _TRIES), 4)
    c, s = np.abs(np.cos(yaw)), np.abs(np.sin(yaw))
    reach = 0.5 * np.stack((c * sides[:, 0] + s * sides[:, 1], s * sides[:, 0] + c * sides[:, 1]), axis=1)
    least, greatest = np.array((START, -HALF_WIDTH)) + reach, np.array((END, HALF_WIDTH)) - reach
    at = np.round(rng.uniform(least, greatest), 4)
    return np.column_stack((np.clip(at, least, greatest), sides, yaw))


def _add(placed: FloatArray, tried: FloatArray) -> FloatArray:
    """The placed ones and those tried, in their order, that touch none of them nor one taken before."""
    free = tried[~_touching(tried, placed).any(axis=1)]
    conflicts = _touching(free, free)
    taken: list[int] = []
    for k in range(len(free)):
        if not conflicts[k, taken].any():
            taken.append(k)
    return np.concatenate((placed, free[taken]))


def _touching(one: FloatArray, other: FloatArray) -> BoolArray:
    """(n, m) True where rectangles overlap: no side of either is a line between them.

    Args:
        one: (n, 5) x, y, length, width (m), yaw (rad).
        other: (m, 5), the same.
    """
    away = other[None, :, :2] - one[:, None, :2]
    radius = 0.5 * (np.hypot(one[:, 2], one[:, 3])[:, None] + np.hypot(other[:, 2], other[:, 3]))
    close = np.hypot(away[..., 0], away[..., 1]) < radius
    i, j = np.nonzero(close)
    a, b, between = one[i], other[j], away[i, j]
    close[i, j] = ~(_is_apart(a, b, between) | _is_apart(b, a, between))
    return np.asarray(close)


def _is_apart(a: FloatArray, b: FloatArray, between: FloatArray) -> BoolArray:
    """(k,) True where a side of the first lies between rectangles (k, 5), `between` (k, 2) m apart."""
    c, s = np.cos(a[:, 4]), np.sin(a[:, 4])
    turned = np.abs(
        np.column_stack((c * between[:, 0] + s * between[:, 1], c * between[:, 1] - s * between[:, 0]))
    )
    c, s = np.abs(np.cos(b[:, 4] - a[:, 4])), np.abs(np.sin(b[:, 4] - a[:, 4]))
    reach = np.column_stack((c * b[:, 2] + s * b[:, 3], s * b[:, 2] + c * b[:, 3]))
    return np.asarray((turned > 0.5 * (a[:, 2:4] + reach)).any(axis=1))
