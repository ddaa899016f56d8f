"""Joint speeds from quantised positions: an alpha-beta tracker for sixteen joints."""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from bluefoot_mpc.estimation.config import JointFilterConfig
from bluefoot_mpc.estimation.workspace import Workspace, compile_function
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray

MAX_READ_DELAY = 0.03  # s, joint readings further from the estimate's time are taken as they are


class JointState(NamedTuple):
    """Memory of the joint filter.

    Attributes:
        values: (64,) what the filter's function carries; see the properties.
    """

    values: FloatArray

    @property
    def position(self) -> FloatArray:
        """(16,) rad, tracked angles."""
        return self.values[0:16]

    @property
    def velocity(self) -> FloatArray:
        """(16,) rad/s."""
        return self.values[16:32]

    @property
    def age(self) -> FloatArray:
        """(16,) s since the last reading of each joint; infinite before the first."""
        return self.values[32:48]

    @property
    def newest(self) -> FloatArray:
        """(16,) rad, last readings, or tracked angles without them, carried to the frame's time."""
        return self.values[48:64]


def initial_joints() -> JointState:
    """A state that has seen no reading."""
    values = np.zeros(4 * N_JOINTS)
    values[32:48] = math.inf
    return JointState(values)


def speed_lag(config: JointFilterConfig, period: float) -> float:
    """Delay of the estimated speed behind the true one for slow changes, s.

    First-order term of the tracker's transfer function at low frequency; a
    plain difference of two readings has half a period.
    """
    return (config.alpha / config.beta - 0.5) * period


class JointFilter:
    """Workspace of the tracker; holds no memory of the joints.

    A joint without a reading goes on at a speed that dies away; the first
    reading after a loss is taken over without a jump of the speed.

    Args:
        config: gains.
    """

    def __init__(self, config: JointFilterConfig) -> None:
        self._work = Workspace(_tracker(config))

    def advance(
        self, state: JointState, measured: FloatArray, valid: BoolArray, delay: FloatArray, dt: float
    ) -> tuple[JointState, list[float]]:
        """Take one reading of all joints.

        Args:
            state: memory.
            measured: (16,) rad; values that are not finite count as not valid.
            valid: (16,) False where no reading came.
            delay: (16,) s since the readings, negative for later ones; carried to now when short.
            dt: s since the previous call; 0 takes the reading over at rest.

        Returns:
            memory, and for each leg 1 where all its joints have answered recently, else 0.
        """
        before, step, readings = self._work.inputs
        before[:] = state.values[:48]
        step[0] = dt
        readings[0] = measured
        readings[1] = valid
        readings[2] = delay
        self._work.call()
        after, known = self._work.outputs
        return JointState(after.copy()), known.tolist()


def advance_joints(
    state: JointState, measured: FloatArray, valid: BoolArray, dt: float, config: JointFilterConfig
) -> JointState:
    """Take one reading of all joints without delay; see `JointFilter`."""
    return JointFilter(config).advance(state, measured, valid, np.zeros(N_JOINTS), dt)[0]


def known_legs(state: JointState, config: JointFilterConfig) -> BoolArray:
    """(4,) True where all four joints of a leg have answered recently."""
    return np.asarray((state.age <= config.lost_after).reshape(N_LEGS, -1).all(axis=1))


@functools.lru_cache(maxsize=8)
def _tracker(config: JointFilterConfig) -> Any:
    """One step of the tracker (immutable, so it may be shared)."""
    before, dt = ca.SX.sym("before", 3 * N_JOINTS), ca.SX.sym("dt")
    readings = ca.SX.sym("readings", N_JOINTS, 3)
    position, velocity, age = ca.vertsplit(before, N_JOINTS)
    measured, answered, delay = ca.horzsplit(readings)
    valid = ca.logic_and(answered, ca.fabs(measured) < math.inf)
    fresh = age > config.lost_after
    predicted = position + dt * velocity
    residual = ca.if_else(valid, measured - predicted, 0.0)
    beta = ca.if_else(dt > 0.0, config.beta / ca.if_else(dt > 0.0, dt, 1.0), 0.0)
    position = ca.if_else(ca.logic_and(fresh, valid), measured, predicted + config.alpha * residual)
    speed = velocity + beta * residual
    dying = ca.if_else(valid, 1.0, ca.exp(-dt / config.memory)) * speed
    velocity = ca.if_else(fresh, 0.0, dying)
    age = ca.if_else(valid, 0.0, age + dt)
    late = ca.if_else(ca.fabs(delay) <= MAX_READ_DELAY, delay, 0.0)
    newest = ca.if_else(valid, measured, position) + late * velocity
    known = [ca.mmax(age[4 * leg : 4 * leg + 4]) <= config.lost_after for leg in range(N_LEGS)]
    return compile_function(
        "tracker", {"before": before, "dt": dt, "readings": readings},
        {"after": ca.vertcat(position, velocity, age, newest), "known": ca.vertcat(*known)},
    )  # fmt: skip
