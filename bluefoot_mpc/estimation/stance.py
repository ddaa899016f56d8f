"""Which feet stand, and what they tell the filter."""

from __future__ import annotations

import itertools
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import ContactConfig
from bluefoot_mpc.estimation.corrections import (
    FeetCorrection,
    Gate,
    Settler,
    correct,
    forget_velocity,
    plant_feet,
)
from bluefoot_mpc.estimation.filter import VELOCITY, FilterState
from bluefoot_mpc.estimation.prediction import Prediction
from bluefoot_mpc.types import N_LEGS, FloatArray

_FEET = slice(6, 18)


_OTHERS = {
    legs: [leg for leg in range(N_LEGS) if leg not in legs]
    for n in range(N_LEGS + 1)
    for legs in itertools.combinations(range(N_LEGS), n)
}


class StanceState(NamedTuple):
    """Memory of the choice of stance feet.

    Attributes:
        settled: frames for which each foot has stood still under its switch.
        blind: s since a foot was last used.
        used: feet that the last correction used.
    """

    settled: tuple[int, ...] = (0,) * N_LEGS
    blind: float = 0.0
    used: tuple[int, ...] = ()


class Stance:
    """Corrects the filter by the feet that stand still and takes all others up anew.

    A foot counts once it has stood still for the probation under a closed
    switch, and not in a frame where its motion does not fit the IMU's: it
    slips, is lifting before the switch has told, or the switch is stuck. After a
    while without any such foot, the velocity is taken up anew if feet stand; in
    the air or on its belly the robot is assumed near rest, weakly, so that
    velocity and tilt stay bounded.

    Args:
        config: gates.
        settler: workspace for the corrections.
    """

    def __init__(self, config: ContactConfig, settler: Settler) -> None:
        self._config = config
        self._gate = Gate()
        self._feet = FeetCorrection()
        self._settler = settler

    def advance(
        self, ahead: Prediction, stance: StanceState, standing: list[bool], dt: float
    ) -> tuple[FilterState, StanceState]:
        """Use one frame's feet.

        Args:
            ahead: prediction and measured feet.
            stance: memory.
            standing: (4,) feet under closed switches, with known joints.
            dt: s.
        """
        state = ahead.filter
        spread = state.covariance[_FEET, _FEET] + ahead.noise
        settled = self._settled(stance.settled, self._gate.distances(spread, ahead.residual), standing)
        used = tuple([leg for leg in range(N_LEGS) if settled[leg] > self._config.probation + 1])
        blind = 0.0 if used else stance.blind + dt
        if used:
            return self._use(ahead, used, spread), StanceState(settled, blind, used)
        if blind > self._config.blind_after:
            state, blind = self._grope(state, standing, blind)
        return self.plant(state, ahead), StanceState(settled, blind, used)

    def plant(self, state: FilterState, ahead: Prediction) -> FilterState:
        """Take all feet up anew where the joints show them."""
        every = list(range(N_LEGS))
        covariance = state.covariance.copy()
        plant_feet(covariance, every, ahead.noise)
        return FilterState(self._settler.settle(state.estimate, 0.0, ahead.from_imu, every), covariance)

    def _settled(
        self, counts: tuple[int, ...], distances: list[float], standing: list[bool]
    ) -> tuple[int, ...]:
        gate = self._config.gate
        return tuple(
            [
                (count + 1 if count == 0 or distance < gate else 0) if stands else 0
                for count, distance, stands in zip(counts, distances, standing, strict=True)
            ]
        )

    def _use(self, ahead: Prediction, used: tuple[int, ...], spread: FloatArray) -> FilterState:
        before = ahead.filter
        others = _OTHERS[used]
        change, covariance = self._feet.reduce(before.covariance, spread, ahead.residual, used)
        plant_feet(covariance, others, ahead.noise)
        moved = 0.0 if change is None else change
        return FilterState(self._settler.settle(before.estimate, moved, ahead.from_imu, others), covariance)

    def _grope(self, state: FilterState, standing: list[bool], blind: float) -> tuple[FilterState, float]:
        deviation = self._config.blind_speed
        if any(standing):
            # Feet stand, yet none fits: it is the velocity that is wrong.
            return forget_velocity(state, deviation), 0.0
        residual = -state.estimate[4:7]
        return correct(state, VELOCITY, residual, deviation**2 * np.eye(3), self._settler), blind
