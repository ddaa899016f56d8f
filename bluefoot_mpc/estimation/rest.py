"""Standing still: the gyro then shows its bias."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import RestConfig
from bluefoot_mpc.estimation.corrections import Settler, correct
from bluefoot_mpc.estimation.filter import GYRO_BIAS, FilterState
from bluefoot_mpc.estimation.inertial import Sample, mean_rate
from bluefoot_mpc.types import FloatArray

KNOWN_BIAS = 0.004  # rad/s, deviation below which a mean rate tells rest from slow turning


class RestState(NamedTuple):
    """Memory of the zero-velocity detector.

    Attributes:
        joints: (16,) rad, where the joints came to rest.
        time: s that they have been there.
    """

    joints: FloatArray
    time: float


def advance_rest(
    state: RestState, moved: float, joints: FloatArray, dt: float, config: RestConfig
) -> RestState:
    """Count the time for which no joint has moved further than a step of its servo.

    Args:
        state: memory.
        moved: rad, largest distance of a joint from where it came to rest.
        joints: (16,) rad.
        dt: s.
        config: how far is a move.
    """
    return RestState(state.joints, state.time + dt) if moved <= config.joint_move else RestState(joints, 0.0)


def at_rest(
    rest: RestState, standing: list[bool], samples: list[Sample], state: FilterState, config: RestConfig
) -> bool:
    """Whether all feet stand, no joint moves and the gyro is quiet."""
    if rest.time < config.time or not all(standing) or not samples:
        return False
    mean = mean_rate(samples)
    for axis in range(3):
        values = [sample.rate[axis] for sample in samples]
        if max(values) - min(values) > 2.0 * config.rate_spread:
            return False
        known = math.sqrt(state.covariance[18 + axis, 18 + axis])
        if abs(mean[axis] - state.gyro_bias[axis]) > config.rate + (
            0.0 if known < KNOWN_BIAS else 3.0 * known
        ):
            return False
    return True


def correct_bias(
    state: FilterState, samples: list[Sample], config: RestConfig, settler: Settler
) -> FilterState:
    """Correct the gyro bias by the frame's mean rate, which is zero at rest."""
    residual = np.array(mean_rate(samples)) - np.array(state.gyro_bias)
    return correct(state, GYRO_BIAS, residual, config.noise**2 * np.eye(3), settler)
