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


@dataclass(frozen=True, kw_only=True, slots=True)
class TreadConfig:
    """What a foot may stand on, and how far from its place it may look for it."""

    reach: float = 0.045  # m from the foot's place within which it is put down
    max_step: float = 0.045  # m that a foot may go up or down at once
    max_slope_deg: float = 25.0  # degrees of the ground under a foot
    clear: float = 0.04  # m around a foot in which nothing may stand higher by more than max_step
    off_place: float = 0.05  # cost, in squared slope, of a tread at the end of the reach

    def __post_init__(self) -> None:
        require_positive(max_step=self.max_step)
        require_nonnegative(reach=self.reach, clear=self.clear, off_place=self.off_place)
        require_range(0.0, 89.0, max_slope_deg=self.max_slope_deg)


@dataclass(frozen=True, slots=True)
class Treads:
    """The best tread near each cell.

    Attributes:
        height: (n, m) m of it, in the map's frame; NaN where there is none.
        slope: (n, m) squared slope of it; NaN where there is none.
        known: (n, m) True where the ground is known within the foot's reach.
    """

    height: FloatArray
    slope: FloatArray
    known: BoolArray


def treads(height: FloatArray, cell: float, config: TreadConfig) -> Treads:
    """The best tread near each cell.

    No tread is steep ground, ground at the foot of what is too high to step on, and the bottom of a hole or a
    gap. And there is none where the treads near by differ by more than a step.

    Args:
        height: (n, m) m; NaN where the ground is unknown.
        cell: m, side of a cell.
        config: limits.
    """
    slope = squared_slope(height, cell)
    with np.errstate(invalid="ignore"):
        good = slope <= math.tan(math.radians(config.max_slope_deg)) ** 2
        good &= _most(height, _disc(config.clear, cell)) - height <= config.max_step
    best = np.full(height.shape, np.inf)
    found, found_slope = np.full(height.shape, np.nan), np.full(height.shape, np.nan)
    disc = _disc(config.reach, cell)
    score = np.where(good, slope, np.inf)
    for (view, heights, slopes), away in zip(
        zip(_views(score, disc, np.inf), _views(height, disc), _views(slope, disc), strict=True),
        (cell * np.hypot(*np.transpose(disc)) / max(config.reach, cell)).tolist(),
        strict=True,
    ):
        offered = view + config.off_place * away**2
        better = offered < best
        np.copyto(best, offered, where=better)
        np.copyto(found, heights, where=better)
        np.copyto(found_slope, slopes, where=better)
    near = _disc(max(config.clear, cell), cell)
    with np.errstate(invalid="ignore"):
        too_much = _most(found, near) - found > config.max_step
        too_much |= found + _most(-found, near) > config.max_step
    found[too_much], found_slope[too_much] = np.nan, np.nan
    return Treads(found, found_slope, np.isfinite(_most(height, disc)))


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
