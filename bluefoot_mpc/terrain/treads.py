"""Where on a height map a foot finds a place near by, and how high and steep it is there.

The robot puts each foot on the best place within a few centimetres of where the stance would have it. So what
a trunk's place costs is decided by the best cell within that distance of each foot, not by the cell below it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.cost import squared_slope
from bluefoot_mpc.types import BoolArray, FloatArray

_STEEP = 1.0
"""Squared slope beyond which all edges cost the same."""


_STRIDE = 0.04
"""m, around a place, within which no tread may be a step too high or too low."""


@dataclass(frozen=True, kw_only=True, slots=True)
class TreadConfig:
    """What a foot may stand on, and how far from its place it may look for it."""

    reach: float = 0.060  # m from the foot's place within which it is put down
    max_step: float = 0.045  # m that a foot may go up or down at once
    max_slope_deg: float = 25.0  # degrees of the ground under a foot
    clear: float = 0.06  # m around a foot in which nothing may stand higher by more than max_step
    off_place: float = 0.05  # cost, in squared slope, of a tread at the end of the reach
    least_quality: float = 0.10  # rated worse, where cells are rated, a cell is no tread
    k_quality: float = 0.1  # cost, in squared slope, of a tread rated 0 against one rated 1

    def __post_init__(self) -> None:
        require_positive(max_step=self.max_step)
        require_nonnegative(off_place=self.off_place, k_quality=self.k_quality)
        require_range(0.0, 0.2, reach=self.reach, clear=self.clear)
        require_range(0.0, 1.0, least_quality=self.least_quality)
        require_range(0.0, 89.0, max_slope_deg=self.max_slope_deg)


@dataclass(frozen=True, slots=True)
class Treads:
    """The best tread near each cell.

    Attributes:
        height: (n, m) m of it, in the map's frame; NaN where there is none.
        slope: (n, m) squared slope of it, raised where cells are rated and it is not rated 1; NaN where
            there is none.
        known: (n, m) True where the ground is known within the foot's reach.
    """

    height: FloatArray
    slope: FloatArray
    known: BoolArray


def treads(height: FloatArray, cell: float, config: TreadConfig, quality: FloatArray | None = None) -> Treads:
    """The best tread near each cell.

    No tread is steep ground, ground at the foot of what is too high to step on, and the bottom of a hole or a
    gap. And there is none where the treads near by differ by more than a step.

    Args:
        height: (n, m) m; NaN where the ground is unknown.
        cell: m, side of a cell.
        config: limits.
        quality: (n, m) 0..1, how well a foot stands on a cell, where that was rated; None where it was not.
    """
    height = np.where(np.isfinite(height), height, np.nan)
    slope = np.minimum(squared_slope(height, cell), _STEEP)
    with np.errstate(invalid="ignore"):
        good = _gentlest(height, cell) <= math.tan(math.radians(config.max_slope_deg)) ** 2
        good &= _most(height, _disc(config.clear, cell)) - height <= config.max_step
    score = slope.copy()
    if quality is not None:
        good &= quality >= config.least_quality
        score += config.k_quality * (1.0 - quality)
    disc = _disc(config.reach, cell)
    found, found_score = _best(height, np.where(good, score, np.inf), disc, config.off_place)
    near = _disc(max(_STRIDE, cell), cell)
    with np.errstate(invalid="ignore"):
        too_much = _most(found, near) - found > config.max_step
        too_much |= found + _most(-found, near) > config.max_step
    found[too_much], found_score[too_much] = np.nan, np.nan
    return Treads(found, found_score, np.isfinite(_most(height, disc)))


def _best(
    height: FloatArray, score: FloatArray, disc: list[tuple[int, int]], off_place: float
) -> tuple[FloatArray, FloatArray]:
    """(n, m) height and score of the best cell of a disc around each; NaN where none has a finite score."""
    best = np.full(height.shape, np.inf)
    found, found_score = np.full(height.shape, np.nan), np.full(height.shape, np.nan)
    far = max(math.hypot(*disc[-1]), 1.0)
    for offset, heights, scores in zip(disc, _views(height, disc), _views(score, disc, np.inf), strict=True):
        offered = scores + off_place * (math.hypot(*offset) / far) ** 2
        better = offered < best
        np.copyto(best, offered, where=better)
        np.copyto(found, heights, where=better)
        np.copyto(found_score, scores, where=better)
    return found, found_score


def _gentlest(height: FloatArray, cell: float) -> FloatArray:
    """(n, m) squared slope towards the gentler side, along i and j; NaN where the ground is unknown.

    So the rim of a stone is as even as the stone; that it is a rim is in the cost.
    """
    total = np.where(np.isnan(height), np.nan, 0.0)
    for axis in range(2):
        rise = np.full((2, *height.shape), np.nan)
        step = np.abs(np.diff(np.moveaxis(height, axis, 0), axis=0))
        np.moveaxis(rise[0], axis, 0)[:-1] = step
        np.moveaxis(rise[1], axis, 0)[1:] = step
        gentler = np.fmin(rise[0], rise[1])
        total += np.where(np.isnan(gentler), 0.0, gentler / cell) ** 2
    return total


def highest_within(height: FloatArray, cell: float, radius: float) -> FloatArray:
    """(n, m) greatest known height within a radius (m); NaN where none is known."""
    return _most(height, _disc(radius, cell))


def _disc(radius: float, cell: float) -> list[tuple[int, int]]:
    """Offsets (i, j) of the cells whose centres lie within a radius, the nearest first."""
    reach = math.floor(radius / cell + 1e-9)
    span = range(-reach, reach + 1)
    inside = [(i, j) for i in span for j in span if math.hypot(i, j) * cell <= radius + 1e-9]
    return sorted(inside, key=lambda place: (math.hypot(*place), place))


def _views(array: FloatArray, disc: list[tuple[int, int]], outside: float = np.nan) -> list[FloatArray]:
    """(n, m) views of an array, one for each offset."""
    margin = max(abs(k) for place in disc for k in place)
    n, m = array.shape
    padded = np.pad(array, margin, constant_values=outside)
    return [padded[margin + i : margin + i + n, margin + j : margin + j + m] for i, j in disc]


def _most(height: FloatArray, disc: list[tuple[int, int]]) -> FloatArray:
    """(n, m) greatest known height within a disc; NaN where none is known."""
    most = np.full(height.shape, np.nan)
    for view in _views(height, disc):
        np.fmax(most, view, out=most)
    return most
