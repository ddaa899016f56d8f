"""Keeps the robot off things, whatever law leads.

The wanted motion is followed ahead with the gait's ramps, to where the robot
would stand if it were stopped a moment later. If its outline stays clear of all
points that is what it does; else the nearest motion that does so is chosen, of
a fixed set with turning, backing off and side steps in it. Standing still is
always allowed, and whoever is too near already may only move away.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.navigation.outline import Foresight, OutlineConfig, RampConfig, closest, distances
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class GuardConfig:
    """Distances to keep, and how motions are weighed against each other."""

    least: float = 0.13  # m from the outline that no motion goes below
    comfortable: float = 0.20  # m; nearer costs
    away: float = 0.005  # m that a robot which is too near must gain by a motion
    slack: float = 0.004  # m that it may lose on the way
    reach: float = 1.0  # m around the robot from which points are looked at
    sectors: int = 54  # around the robot; of each the nearest point counts
    speed_cost: float = 1.0  # of a difference of `speed_unit`
    speed_unit: float = 0.1  # m/s
    turn_cost: float = 1.0  # of a difference of `turn_unit`
    turn_unit: float = 0.4  # rad/s
    side_cost: float = 1.5  # of a side step of `speed_unit`
    near_cost: float = 1.5  # of coming as near as `least`
    outline: OutlineConfig = field(default_factory=OutlineConfig)
    ramp: RampConfig = field(default_factory=RampConfig)

    def __post_init__(self) -> None:
        require_positive(
            least=self.least, comfortable=self.comfortable, away=self.away, reach=self.reach,
            sectors=self.sectors, speed_unit=self.speed_unit, turn_unit=self.turn_unit,
        )  # fmt: skip
        require_nonnegative(
            speed_cost=self.speed_cost, turn_cost=self.turn_cost, side_cost=self.side_cost,
            near_cost=self.near_cost, slack=self.slack,
        )  # fmt: skip


class Guarded(NamedTuple):
    """What the guard lets pass.

    Attributes:
        motion: to be done.
        clearance: m, from the outline to the nearest point now; infinite in the open.
        stopped: True where nothing but standing is allowed.
    """

    motion: Motion
    clearance: float
    stopped: bool


class Guard:
    """Chooses the admissible motion nearest to a wanted one; holds no memory of its own.

    Args:
        config: distances and costs.
    """

    def __init__(self, config: GuardConfig) -> None:
        self._config = config
        self._motions = _choices()
        self._foresight = Foresight(config.ramp)

    def step(self, points: FloatArray, wanted: Motion, now: Motion) -> Guarded:
        """Judge a wanted motion.

        Args:
            points: (n, 2) m, what stands around the robot, in the robot frame.
            wanted: what the leading law wants.
            now: what the gait does at present.
        """
        config = self._config
        near = points[(points * points).sum(axis=1) < config.reach**2]
        clearance = float(distances(near, config.outline).min(initial=np.inf))
        if clearance - self._foresight.reach(now, wanted) >= config.comfortable:
            return Guarded(wanted, clearance, stopped=False)
        if clearance >= config.comfortable:
            along = closest(near, self._foresight.place(now, wanted), config.outline)
            if along.min() >= config.comfortable:
                return Guarded(wanted, clearance, stopped=False)
        near = self._thinned(near)
        motions = np.concatenate((np.array((wanted,)), self._motions))
        along = closest(near, self._foresight.places(now, motions), config.outline)
        least = along.min(axis=1)
        cost = np.where(self._admissible(along, least, clearance), self._cost(motions, wanted, least), np.inf)
        best = int(cost.argmin())
        if not np.isfinite(cost[best]):
            return Guarded(Motion(), clearance, stopped=True)
        return Guarded(Motion(*motions[best].tolist()), clearance, stopped=False)

    def away(self, points: FloatArray, now: Motion) -> Motion:
        """The motion that gains most clearance without losing any; standing where none does.

        Args:
            points: (n, 2) m, what stands around the robot, in the robot frame.
            now: what the gait does at present.
        """
        config = self._config
        near = self._thinned(points[(points * points).sum(axis=1) < config.reach**2])
        clearance = float(distances(near, config.outline).min(initial=np.inf))
        along = closest(near, self._foresight.places(now, self._motions), config.outline)
        good = self._admissible(along, along.min(axis=1), clearance)
        gain = np.where(good, np.minimum(along[:, -1], 2.0 * config.comfortable), -np.inf)
        best = int(gain.argmax())
        return Motion(*self._motions[best].tolist()) if gain[best] > clearance else Motion()

    def _admissible(self, along: FloatArray, least: FloatArray, clearance: float) -> BoolArray:
        """(k,) True for motions that stay clear, or that lead away from where it is too near already."""
        config = self._config
        leaves = (least >= clearance - config.slack) & (along[:, -1] >= clearance + config.away)
        return np.asarray((least >= config.least) | leaves)

    def _thinned(self, points: FloatArray) -> FloatArray:
        """(m, 2) the nearest point of each sector around the robot."""
        count = self._config.sectors
        if len(points) <= count:
            return points
        x, y = points.T
        sector = ((np.arctan2(y, x) + np.pi) * (count / (2.0 * np.pi))).astype(np.intp)
        order = (x * x + y * y).argsort()[::-1]
        last = np.full(count + 1, -1)
        last[sector[order]] = order  # the nearest is written last
        return np.asarray(points[last[last >= 0]])

    def _cost(self, motions: FloatArray, wanted: Motion, least: FloatArray) -> FloatArray:
        config = self._config
        x, y, turn = wanted
        per_unit = np.array(
            (
                config.speed_cost / config.speed_unit,
                config.side_cost / config.speed_unit,
                config.turn_cost / config.turn_unit,
            )
        )
        cost = np.abs(motions - (x, y, turn)) @ per_unit
        lack = (config.comfortable - least) / (config.comfortable - config.least)
        return np.asarray(cost + config.near_cost * np.minimum(np.maximum(lack, 0.0), 1.0))


def _choices() -> FloatArray:
    """(k, 3) motions to choose from: arcs, turns in place, backing off, side steps, standing."""
    speeds, turns = (-0.06, 0.0, 0.05, 0.10, 0.16), (-0.45, -0.3, -0.15, 0.0, 0.15, 0.3, 0.45)
    arcs = [(x, 0.0, turn) for x, turn in itertools.product(speeds, turns)]
    sides = [(x, y, 0.0) for x, y in itertools.product((-0.03, 0.0, 0.04), (-0.05, 0.05))]
    return np.array(arcs + sides)
