"""What a level floor tells of the tilt.

A robot at rest, or one that keeps its heading, cannot tell the accelerometer's
bias from a tilt. The line between two standing feet can, if the floor is level;
floors of buildings are, to a tenth of a degree or so. So while the plane under
the feet, as gravity shows it, is level to within what the bias may feign, it is
taken to be level. A ramp, a step or a rough floor fails that test, and then
only the accelerometer counts.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import LevelConfig
from bluefoot_mpc.estimation.corrections import Settler, correct_scalar
from bluefoot_mpc.estimation.filter import ACCEL_BIAS, ATTITUDE, SIZE, FilterState
from bluefoot_mpc.estimation.ground import GroundEstimate
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import FloatArray

DIAGONALS = ((0, 3), (1, 2))
"""Pairs of feet whose lines are used: FL with RR, FR with RL."""
_FOOT_COLUMNS = tuple(8 + 3 * leg for leg in range(4))


class LevelState(NamedTuple):
    """Memory of what is believed of the floor.

    Attributes:
        level: whether the floor counts as level.
        time: s for which the plane under the feet has looked level (negative:
            until that counts again), or, when it already counts as level, for
            which feet have not fitted it.
        wait: s until the feet are compared again; more often would cost time for nothing.
        spread: m², mean square of the heights compared so far: bumps of the floor weaken its say.
    """

    level: bool = False
    time: float = 0.0
    wait: float = 0.0
    spread: float = 0.0


class LevelFloor:
    """Corrects the filter by feet at the same height; holds no memory.

    Args:
        config: what counts as level.
        bias: m/s², deviation of the accelerometer's bias.
        settler: workspace for the corrections.
    """

    def __init__(self, config: LevelConfig, bias: float, settler: Settler) -> None:
        self._config = config
        self._bias = bias
        self._settler = settler

    def advance(
        self, state: FilterState, memory: LevelState, used: tuple[int, ...], ground: GroundEstimate, dt: float
    ) -> tuple[FilterState, LevelState]:
        """Use one frame.

        Args:
            state: filter.
            memory: what is believed of the floor.
            used: feet that the filter kept in place.
            ground: plane under the feet.
            dt: s since the previous frame.
        """
        if not memory.level:
            return state, self._judge(memory, ground, dt)
        if memory.wait > dt:
            return state, memory._replace(wait=memory.wait - dt)
        config, spread, compared, fits = self._config, memory.spread, False, True
        for one, other in DIAGONALS:
            if one in used and other in used:
                state, square = self._compare(state, one, other, config.noise**2 + spread)
                compared, fits = True, fits and not math.isnan(square)
                spread += 0.0 if math.isnan(square) else (square - spread) * config.interval / config.memory
        if not compared:
            return state, memory
        time = 0.0 if fits else memory.time + config.interval
        if time > config.doubt or self._strains(state):
            return forget_bias(state, self._bias), LevelState(time=-config.distrust)
        return state, LevelState(True, time, config.interval, spread)

    def _judge(self, memory: LevelState, ground: GroundEstimate, dt: float) -> LevelState:
        """Believe in a level floor once the plane has looked level for a while."""
        x, y = ground.slope.tolist()
        looks_level = ground.known and math.hypot(x, y) < self._config.slope
        time = memory.time + dt if looks_level else min(memory.time + dt, 0.0)
        return LevelState(True) if time > self._config.trust else LevelState(False, time)

    def _compare(
        self, state: FilterState, one: int, other: int, variance: float
    ) -> tuple[FilterState, float]:
        """Two feet at the same height: the state after, and their difference squared (m²), NaN if unused."""
        row, height = height_row(state, one, other)
        expected = float(row @ state.covariance @ row) + variance
        if height * height > self._config.gate * expected:
            return state, math.nan
        return correct_scalar(state, row, height, variance, self._settler), height * height

    def _strains(self, state: FilterState) -> bool:
        """Whether the level floor asks for more bias than the sensor may have."""
        x, y, _ = state.accel_bias
        return math.hypot(x, y) > self._config.max_bias * self._bias


def height_row(state: FilterState, one: int, other: int) -> tuple[FloatArray, float]:
    """How the height of one foot over another depends on the error.

    Args:
        state: filter.
        one: index of a foot.
        other: index of another.

    Returns:
        (26,) derivative by the error, and the height, m.
    """
    x, y, height = (state.estimate[7 + 3 * one : 10 + 3 * one] - state.estimate[7 + 3 * other :][:3]).tolist()
    row = np.zeros(SIZE)
    row[0], row[1] = y, -x
    row[_FOOT_COLUMNS[one]], row[_FOOT_COLUMNS[other]] = 1.0, -1.0
    return row, height


def forget_bias(state: FilterState, deviation: float) -> FilterState:
    """Accelerometer bias zero with a deviation (m/s²), and as much doubt of the tilt."""
    estimate, covariance = state.estimate.copy(), state.covariance.copy()
    estimate[22:25] = 0.0
    covariance[ACCEL_BIAS, :] = 0.0
    covariance[:, ACCEL_BIAS] = 0.0
    covariance[ACCEL_BIAS, ACCEL_BIAS] = deviation**2
    tilt = ATTITUDE[:2]
    covariance[tilt, tilt] += (deviation / GRAVITY) ** 2
    return FilterState(estimate, covariance)
