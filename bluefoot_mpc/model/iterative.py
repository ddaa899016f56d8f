"""Iterative solution of phi(q) = xi for any differentiable forward map.

The second document's process, with what it leaves open filled in: repeat
``h = J(q)† (target - phi(q))``, ``q += h``. A Jacobian without full rank takes
the pseudo-inverse over the singular values that count, or a damped one; steps
are limited and halved until the error falls; and where the error lies in the
left null space, so that no step helps, the solver says that it is stalled. The
"more information" that a singular Jacobian asks for is a preferred posture,
followed in the null space.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.linear import RANK_TOLERANCE, pseudo_inverse, subspaces
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray

ForwardMap = Callable[[FloatArray], FloatArray]
"""phi: (n,) joints to (m,) task coordinates."""

JacobianMap = Callable[[FloatArray], FloatArray]
"""(n,) joints to the (m, n) Jacobian of phi."""

_SUFFICIENT = 1e-4  # relative fall of the error that a full step must bring at least
_GOOD = 0.7  # share of the error under which the first step that gets there is taken
_DAMPINGS = (0.01, 0.1, 1.0)  # shares of the largest singular value


class Status(enum.StrEnum):
    """How an iterative solution ended."""

    CONVERGED = "converged"
    STALLED = "stalled"
    ITERATION_LIMIT = "iteration limit"


@dataclass(frozen=True, kw_only=True, slots=True)
class IterativeConfig:
    """When to stop and how far to step."""

    max_iterations: int = 100
    tolerance: float = 1e-10  # of the residual's norm, in its unit
    stall_tolerance: float = 1e-10  # relative fall of the residual below which it counts as stalled
    max_step: float = 0.5  # norm of one step, rad for joints
    halvings: int = 20  # of a step that does not lower the residual
    rank_tolerance: float = RANK_TOLERANCE  # share of the largest singular value
    damping: float = 0.0  # lambda of damped least squares, in the Jacobian's unit
    preference_gain: float = 0.5  # share of the way to the preferred posture per step

    def __post_init__(self) -> None:
        require_positive(
            max_iterations=self.max_iterations, tolerance=self.tolerance, max_step=self.max_step,
            stall_tolerance=self.stall_tolerance, rank_tolerance=self.rank_tolerance,
        )  # fmt: skip
        require_nonnegative(
            halvings=self.halvings, damping=self.damping, preference_gain=self.preference_gain
        )


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class IterativeResult:
    """Where the iteration ended.

    Attributes:
        q: (n,) joints.
        status: converged, stalled (a nearest point, or a singular posture), or out of iterations.
        residual: (m,) target - phi(q).
        error: norm of the residual.
        iterations: steps taken.
        rank: rank of the last Jacobian.
    """

    q: FloatArray
    status: Status
    residual: FloatArray
    error: float
    iterations: int
    rank: int

    @property
    def converged(self) -> bool:
        """Whether the residual's norm got under the tolerance."""
        return self.status is Status.CONVERGED


def solve(
    forward: ForwardMap,
    jacobian: JacobianMap,
    target: FloatArray,
    start: FloatArray,
    *,
    preferred: FloatArray | None = None,
    config: IterativeConfig | None = None,
) -> IterativeResult:
    """Find q with forward(q) = target, or as near as the iteration gets.

    Args:
        forward: the map phi.
        jacobian: its Jacobian.
        target: (m,) wanted task coordinates.
        start: (n,) first guess.
        preferred: (n,) posture to approach in the null space while that does
            not hinder the target; also the way out of a singular start.
        config: tolerances and limits.

    Raises:
        ConfigurationError: target, start or preferred posture is not finite.
    """
    config = config or IterativeConfig()
    for name, values in (("target", target), ("start", start), ("preferred posture", preferred)):
        if values is not None and not np.isfinite(values).all():
            raise ConfigurationError(f"{name} of the iterative solver is not finite: {values}")
    state = _evaluate(forward, target, np.array(start, dtype=np.float64))
    status, iteration = Status.ITERATION_LIMIT, 0
    while state.error > config.tolerance and iteration < config.max_iterations:
        iteration += 1
        before = state
        for step in _steps(jacobian(before.q), before, preferred, config):
            state = min(state, _line_search(forward, target, before, step, config), key=_error)
            if state.error < _GOOD * before.error:
                break
        if before.error - state.error <= config.stall_tolerance * before.error:
            status = Status.STALLED
            break
    if state.error <= config.tolerance:
        status = Status.CONVERGED
    rank = subspaces(jacobian(state.q), config.rank_tolerance).rank
    return IterativeResult(
        q=state.q, status=status, residual=state.residual, error=state.error, iterations=iteration, rank=rank
    )


class _State(NamedTuple):
    q: FloatArray
    residual: FloatArray
    error: float


def _error(state: _State) -> float:
    return state.error


def _evaluate(forward: ForwardMap, target: FloatArray, q: FloatArray) -> _State:
    residual = target - forward(q)
    return _State(q, residual, float(np.linalg.norm(residual)))


def _steps(
    matrix: FloatArray, state: _State, preferred: FloatArray | None, config: IterativeConfig
) -> list[FloatArray]:
    """Steps to try in turn: with the preference, without it, then more and more damped.

    Near a singular posture the pseudo-inverse asks for long steps along which
    the error hardly falls; damping turns them towards the gradient.
    """
    largest = float(np.linalg.norm(matrix, 2))
    dampings = [config.damping, *(share * largest for share in _DAMPINGS if largest > 0.0)]
    steps = [pseudo_inverse(matrix, config.rank_tolerance, damping) @ state.residual for damping in dampings]
    if preferred is not None:
        null = subspaces(matrix, config.rank_tolerance).null
        steps.insert(0, steps[0] + config.preference_gain * (null @ (null.T @ (preferred - state.q))))
    return steps


def _line_search(
    forward: ForwardMap, target: FloatArray, state: _State, step: FloatArray, config: IterativeConfig
) -> _State:
    """The state after the longest of the halved steps that lowers the error; unchanged if none does."""
    length = float(np.linalg.norm(step))
    if length == 0.0:
        return state
    share = min(1.0, config.max_step / length)
    for _ in range(config.halvings + 1):
        trial = _evaluate(forward, target, state.q + share * step)
        if trial.error < (1.0 - _SUFFICIENT * share) * state.error:
            return trial
        share *= 0.5
    return state
