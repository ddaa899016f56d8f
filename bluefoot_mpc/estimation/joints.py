"""Joint speeds from quantised positions: an alpha-beta tracker for sixteen joints."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import JointFilterConfig
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray


class JointState(NamedTuple):
    """Memory of the joint filter.

    Attributes:
        position: (16,) rad, tracked angles.
        velocity: (16,) rad/s.
        age: (16,) s since the last reading of each joint; infinite before the first.
    """

    position: FloatArray
    velocity: FloatArray
    age: FloatArray


def initial_joints() -> JointState:
    """A state that has seen no reading."""
    return JointState(np.zeros(N_JOINTS), np.zeros(N_JOINTS), np.full(N_JOINTS, math.inf))


def speed_lag(config: JointFilterConfig, period: float) -> float:
    """Delay of the estimated speed behind the true one for slow changes, s.

    First-order term of the tracker's transfer function at low frequency; a
    plain difference of two readings has half a period.
    """
    return (config.alpha / config.beta - 0.5) * period


def advance_joints(
    state: JointState, measured: FloatArray, valid: BoolArray, dt: float, config: JointFilterConfig
) -> JointState:
    """Take one reading of all joints.

    A joint without a reading goes on at a speed that dies away; the first
    reading after a loss is taken over without a jump of the speed.

    Args:
        state: memory.
        measured: (16,) rad, finite where valid.
        valid: (16,) False where no reading came.
        dt: s since the previous call; 0 takes the reading over at rest.
        config: gains.
    """
    fresh = state.age > config.lost_after
    decay = 1.0 if dt <= 0.0 else math.exp(-dt / config.memory)
    predicted = state.position + dt * state.velocity
    residual = measured - predicted
    complete = bool(valid.all())
    if not complete:
        residual = np.where(valid, residual, 0.0)
    beta = config.beta / dt if dt > 0.0 else 0.0
    position = predicted + config.alpha * residual
    velocity = state.velocity + beta * residual
    if not complete:
        velocity = np.where(valid, velocity, decay * velocity)
    if fresh.any():
        taken = fresh & valid
        position = np.where(taken, measured, position)
        velocity = np.where(fresh, 0.0, velocity)
    return JointState(position, velocity, np.where(valid, 0.0, state.age + dt))


def known_legs(state: JointState, config: JointFilterConfig) -> BoolArray:
    """(4,) True where all four joints of a leg have answered recently."""
    return np.asarray((state.age <= config.lost_after).reshape(N_LEGS, -1).all(axis=1))
