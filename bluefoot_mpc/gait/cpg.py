"""Central pattern generator: four coupled Hopf oscillators (paper, chapter 5).

The sign of the radial term is the stable one: with the printed sign and a
positive gain, oscillators run away from their limit cycle. Coupling and radial
gain scale with the frequency parameter, so that the network's shape in phase
space does not depend on how fast it runs; see `calibration`.
"""

from __future__ import annotations

import functools
import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import casadi
import numpy as np

from bluefoot_mpc.codegen import compiled
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray

Four = tuple[float, float, float, float]
CHAIN = 64
"""Steps of a trajectory made in one call."""
ONES: Four = (1.0, 1.0, 1.0, 1.0)
_EIGHT = struct.Struct("8d")  # a small array filled number by number costs twice as much


@dataclass(frozen=True, kw_only=True, slots=True)
class CpgConfig:
    """Constants of the oscillators."""

    convergence: float = 0.6  # radial gain A over the frequency parameter, 1/rad
    steepness: float = 50.0  # ζ of the switch between stance and swing speed, 1
    gamma: float = 1.0  # Γ, square of the limit cycle's radius without coupling, 1
    max_step: float = 0.1  # largest ω_s·h of one Runge-Kutta step, rad

    def __post_init__(self) -> None:
        """Check ranges."""
        require_positive(convergence=self.convergence, steepness=self.steepness, gamma=self.gamma)
        require_range(1e-4, 0.5, max_step=self.max_step)


class CpgState(NamedTuple):
    """State of the four oscillators, house leg order.

    Attributes:
        y1: (4,) negative at lift-off, positive at touchdown.
        y2: (4,) positive while the leg swings.
    """

    y1: Four
    y2: Four


class CpgInputs(NamedTuple):
    """What drives the network during one step.

    Attributes:
        omega: ω_s, rad/s; not the cycle frequency.
        alpha: α, sets the share of the cycle spent in swing.
        matrix: 16 entries of the coupling K over ω_s, row-major.
        psi_omega: (4,) diagonal of Ψ_ω, reflex on speed.
        psi_m: (4,) diagonal of Ψ_M, reflex on amplitude.
    """

    omega: float
    alpha: float
    matrix: tuple[float, ...]
    psi_omega: Four = ONES
    psi_m: Four = ONES


class CpgIntegrator:
    """Workspace that integrates the network; holds no memory of the gait.

    Args:
        config: constants of the oscillators.
    """

    def __init__(self, config: CpgConfig) -> None:
        self._max_step = config.max_step
        self._state = np.zeros(8)
        self._matrix = np.zeros(16)
        self._coupling: tuple[float, ...] = ()
        self._parameters = np.ones(11)
        self._set: tuple[object, ...] = ()
        self._function = _two_steps(config.convergence, config.steepness, config.gamma)
        self._buffer, self._call = self._function.buffer()
        for index, array in enumerate((self._state, self._matrix, self._parameters)):
            self._buffer.set_arg(index, array.data)
        self._result = np.zeros(8)
        self._buffer.set_res(0, self._result.data)

    def advance(self, state: CpgState, inputs: CpgInputs, dt: float) -> CpgState:
        """State after `dt` seconds; see `advance`."""
        pairs = max(1, math.ceil(0.5 * abs(inputs.omega) * dt / self._max_step - 1e-9))
        _EIGHT.pack_into(self._state.data, 0, *state.y1, *state.y2)
        if inputs.matrix is not self._coupling:
            self._matrix[:] = self._coupling = inputs.matrix
        step = 0.5 * dt / pairs
        wanted = (step, inputs.omega, inputs.alpha, inputs.psi_omega, inputs.psi_m)
        if wanted != self._set:
            self._set = wanted
            self._parameters[:] = (step, inputs.omega, inputs.alpha, *inputs.psi_omega, *inputs.psi_m)
        self._call()
        for _ in range(pairs - 1):
            self._state[:] = self._result
            self._call()
        a, b, c, d, e, f, g, h = _EIGHT.unpack_from(self._result.data)
        return CpgState(y1=(a, b, c, d), y2=(e, f, g, h))


def trajectory(state: CpgState, inputs: CpgInputs, dt: float, count: int, config: CpgConfig) -> FloatArray:
    """(count, 8) states y1, y2 after each of `count` steps under constant inputs, as `advance` gives them.

    Args:
        state: oscillator states before the first step.
        inputs: frequency, coupling and reflex.
        dt: s; at most ``2 config.max_step / omega``.
        count: number of steps.
        config: constants of the oscillators.
    """
    chain = _chain(config.convergence, config.steepness, config.gamma)
    buffer, call = chain.buffer()
    parameters = (0.5 * dt, inputs.omega, inputs.alpha, *inputs.psi_omega, *inputs.psi_m)
    start = np.array((*state.y1, *state.y2))
    matrices, settings = np.tile(inputs.matrix, CHAIN), np.tile(parameters, CHAIN)
    block = np.zeros((CHAIN, 8))
    for index, array in enumerate((start, matrices, settings)):
        buffer.set_arg(index, array.data)
    buffer.set_res(0, block.data)
    states = np.empty((-(-count // CHAIN) * CHAIN, 8))
    for k in range(0, count, CHAIN):
        call()
        states[k : k + CHAIN] = block
        start[:] = block[-1]
    return states[:count]


def advance(state: CpgState, inputs: CpgInputs, dt: float, config: CpgConfig) -> CpgState:
    """Roll the network forward: a pure function of its arguments.

    Args:
        state: oscillator states now.
        inputs: frequency, coupling and reflex, constant over the step.
        dt: s; cut into Runge-Kutta steps of at most ``config.max_step / omega``.
        config: constants of the oscillators.
    """
    return CpgIntegrator(config).advance(state, inputs, dt)


def derivative(
    y1: Sequence[float], y2: Sequence[float], inputs: CpgInputs, config: CpgConfig
) -> tuple[list[float], list[float]]:
    """Right-hand side of the network's equations in plain numbers, for checks and figures."""
    rate1: list[float] = []
    rate2: list[float] = []
    gain = config.convergence * inputs.omega
    for i in range(4):
        radial = gain * (inputs.psi_m[i] * (y1[i] ** 2 + y2[i] ** 2) - config.gamma)
        swing = 1.0 / (1.0 + math.exp(-config.steepness * y2[i]))
        speed = inputs.alpha * (1.0 - swing) + (1.0 - inputs.alpha) * swing
        speed *= inputs.omega * inputs.psi_omega[i]
        push = sum(inputs.matrix[4 * i + j] * y2[j] for j in range(4))
        rate1.append(-radial * y1[i] + speed * y2[i])
        rate2.append(-radial * y2[i] - speed * y1[i] + inputs.omega * push)
    return rate1, rate2


def angle_fraction(y1: float, y2: float) -> tuple[bool, float]:
    """Whether a leg swings, and the share of that half turn it has done, in [0, 1].

    Oscillators turn clockwise: lift-off at angle π, touchdown at 0.
    """
    angle = math.atan2(y2, y1)
    if y2 > 0.0:
        return True, 1.0 - angle / math.pi
    return False, abs(angle) / math.pi


def on_circle(phase: Sequence[float], share: float, radius: float = 1.0) -> CpgState:
    """State on an ideal limit cycle.

    Args:
        phase: (4,) fractions of the cycle since lift-off.
        share: share of the cycle spent in swing.
        radius: of the limit cycle.
    """
    y1: list[float] = []
    y2: list[float] = []
    for value in phase:
        p = value % 1.0
        angle = math.pi * (1.0 - p / share) if p < share else -math.pi * (p - share) / (1.0 - share)
        y1.append(radius * math.cos(angle))
        y2.append(radius * math.sin(angle))
    return CpgState(y1=(y1[0], y1[1], y1[2], y1[3]), y2=(y2[0], y2[1], y2[2], y2[3]))


@functools.lru_cache(maxsize=16)
def _chain(convergence: float, steepness: float, gamma: float) -> Any:
    """`CHAIN` times two Runge-Kutta steps, every second state kept."""
    return _two_steps(convergence, steepness, gamma).mapaccum("cpg_chain", CHAIN)


@functools.lru_cache(maxsize=16)
def _two_steps(convergence: float, steepness: float, gamma: float) -> Any:
    """Two Runge-Kutta steps as one CasADi function (immutable, so it may be shared)."""
    y = casadi.SX.sym("y", 8)
    matrix = casadi.SX.sym("K", 16)
    p = casadi.SX.sym("p", 11)
    coupling = casadi.reshape(matrix, 4, 4).T
    h, omega, alpha, psi_omega, psi_m = p[0], p[1], p[2], p[3:7], p[7:11]

    def rate(x: Any) -> Any:
        y1, y2 = x[:4], x[4:]
        swing = 0.5 * (1.0 + casadi.tanh(0.5 * steepness * y2))  # the logistic, without overflow
        speed = omega * psi_omega * (alpha + (1.0 - 2.0 * alpha) * swing)
        radial = convergence * omega * (psi_m * (y1 * y1 + y2 * y2) - gamma)
        return casadi.vertcat(
            -radial * y1 + speed * y2,
            -radial * y2 - speed * y1 + omega * casadi.mtimes(coupling, y2),
        )

    x = y
    for _ in range(2):
        k1 = rate(x)
        k2 = rate(x + 0.5 * h * k1)
        k3 = rate(x + 0.5 * h * k2)
        k4 = rate(x + h * k3)
        x = x + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return compiled(casadi.Function("cpg_two_steps", [y, matrix, p], [x], {"cse": True}))
