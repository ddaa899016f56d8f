"""The ground as it truly was, beside the ground as a robot mapped it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.terrain.frame import centres, heights_at
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.viz.crossing_series import CrossingSeries, MapAt

Heights = Callable[[FloatArray], FloatArray]
"""(...,) m, true heights of the ground at (..., 2) m in world."""

REACH = 1.2
"""m from the robot, within which a map is judged."""
SEEN = 0.5
"""Confidence from which a cell counts as seen, not as assumed."""
_SAMPLE = 0.002
"""m between the places at which a profile is sampled."""
_MIDDLE = 0.25
"""Share of a swing at either end in which a foot is near the ground by intent."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MapError:
    """How right a map was, when it was new.

    Attributes:
        tick: when it was new.
        values: (n, m) m, mapped less true height; NaN where the map knows nothing.
        median: m, of its size, over the cells that were seen near the robot.
        most: m, within which 95 % of those lie.
        cells: number of those.
    """

    tick: int
    values: FloatArray
    median: float
    most: float
    cells: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Profile:
    """The ground along the way of one foot.

    Attributes:
        leg: index of the leg.
        ground_x: (k,) m, along the foot's way, forward in world.
        true: (k,) m, height of the ground; NaN without truth.
        mapped: (k,) m, as in the map in force, laid where the robot truly stood; NaN where unknown.
        foot: (n, 2) m, x and height of the foot's lowest point.
        time: (n,) s.
        least: m, least height over the ground in the middle of a swing; NaN without truth or swings.
    """

    leg: int
    ground_x: FloatArray
    true: FloatArray
    mapped: FloatArray
    foot: FloatArray
    time: FloatArray
    least: float


def map_errors(crossing: CrossingSeries, maps: Sequence[MapAt], heights: Heights | None) -> list[MapError]:
    """Errors of maps, each laid so that the robot stands where it truly stood; empty without truth.

    Args:
        crossing: the run.
        maps: those to compare.
        heights: of the true ground; None where it is not known.
    """
    if heights is None or not crossing.has_truth:
        return []
    return [_map_error(crossing, entry, heights) for entry in maps]


def _map_error(crossing: CrossingSeries, entry: MapAt, heights: Heights) -> MapError:
    ground = entry.ground
    mapped = np.concatenate([centres(ground), (ground.height + ground.pose[2])[..., None]], axis=-1)
    laid = crossing.in_world(mapped, entry.tick)
    values = laid[..., 2] - heights(laid[..., :2])
    near = np.hypot(*np.moveaxis(mapped[..., :2] - crossing.estimate[entry.tick, :2], -1, 0)) <= REACH
    size = np.abs(values[np.isfinite(values) & near & (ground.confidence >= SEEN)])
    some = len(size) > 0
    return MapError(
        tick=entry.tick, values=values, cells=len(size),
        median=float(np.median(size)) if some else float("nan"),
        most=float(np.percentile(size, 95)) if some else float("nan"),
    )  # fmt: skip


def profiles(crossing: CrossingSeries, heights: Heights | None) -> list[Profile]:
    """The ground along the ways of the four feet.

    Args:
        crossing: the run.
        heights: of the true ground; None where it is not known.
    """
    return [_profile(crossing, leg, heights if crossing.has_truth else None) for leg in range(4)]


def _profile(crossing: CrossingSeries, leg: int, heights: Heights | None) -> Profile:
    foot = crossing.feet[:, leg]
    ticks, places = _along(foot[:, :2], _lifted(crossing, leg))
    mapped = _mapped(crossing, leg, ticks)
    true = np.full(len(places), np.nan) if heights is None else heights(places)
    return Profile(
        leg=leg, ground_x=places[:, 0], true=true, mapped=mapped, foot=foot[:, [0, 2]], time=crossing.time,
        least=float("nan") if heights is None else _least(crossing, leg, heights),
    )  # fmt: skip


def _lifted(crossing: CrossingSeries, leg: int) -> BoolArray:
    """(n,) True from before a swing until its landing."""
    lifted = np.zeros(len(crossing.time), dtype=np.bool_)
    for swing in crossing.swings:
        if swing.leg == leg:
            lifted[max(0, swing.start - 1) : swing.landed + 1] = True
    return lifted


def _along(way: FloatArray, lifted: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Ticks (k,), fractions among them, and places (k, 2) m, evenly spaced along the way of a foot.

    Args:
        way: (n, 2) m, of the foot.
        lifted: (n,) True where it is on its way: what it slips while it stands is none.
    """
    steps = np.hypot(*np.diff(way, axis=0).T)
    steps = np.where(np.isfinite(steps) & lifted[1:], steps, 0.0)
    gone = np.concatenate([[0.0], np.cumsum(steps)])
    first = np.concatenate([[True], np.diff(gone) > 0.0])
    wanted = np.arange(0.0, gone[-1] + _SAMPLE, _SAMPLE)
    ticks = np.interp(wanted, gone[first], np.flatnonzero(first).astype(np.float64))
    index = np.arange(len(way), dtype=np.float64)
    return ticks, np.column_stack([np.interp(ticks, index, way[:, axis]) for axis in range(2)])


def _mapped(crossing: CrossingSeries, leg: int, ticks: FloatArray) -> FloatArray:
    """(k,) m, mapped height under a foot on ticks (k,), by the map in force, in world."""
    found = np.full(len(ticks), np.nan)
    index = np.arange(len(crossing.time), dtype=np.float64)
    feet = crossing.feet_estimate[:, leg]
    places = np.column_stack([np.interp(ticks, index, feet[:, axis]) for axis in range(2)])
    rise = np.interp(ticks, index, crossing.position[:, 2] - crossing.estimate[:, 2])
    for entry in crossing.maps:
        later = ticks >= entry.tick
        found[later] = heights_at(entry.ground, places[later]) + rise[later]
    return found


def _least(crossing: CrossingSeries, leg: int, heights: Heights) -> float:
    over = []
    for swing in crossing.swings:
        edge = round(_MIDDLE * (swing.landed - swing.start))
        if swing.leg == leg and edge > 0:
            foot = crossing.feet[swing.start + edge : swing.landed - edge, leg]
            over.append(foot[:, 2] - heights(foot[:, :2]))
    together = np.concatenate([np.zeros(0), *over])
    together = together[np.isfinite(together)]
    return float(together.min()) if len(together) else float("nan")
