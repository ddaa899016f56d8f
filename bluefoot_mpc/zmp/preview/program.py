"""The preview's quadratic program, solved on the few rows that matter.

In coordinates w in which the cost is |w|² / 2, a plan is its unconstrained
optimum plus the shortest w that meets all rows; each row has a slack with a
quadratic price, so that there always is one. Such a w is a sum of the responses
of the rows that are met, so a problem on k rows needs k unknowns only: with
Γ = A Aᵀ + 1/price = L Lᵀ it is the shortest y with L y <= b, whatever the horizon.

Only rows near the plan can be met. Those with the smallest residuals go into a
problem of fixed size, the plan that comes out is checked against all rows, and
the problem is posed again with the rows that it broke. Rows that are met stay in,
so the cost grows with every round, none comes twice, and the last plan is the
optimum of the whole problem.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dpotrf

from bluefoot_mpc.qp import QpProblem, QpSize, QpSolution
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.preview.config import PreviewConfig
from bluefoot_mpc.zmp.preview.model import PreviewMaps
from bluefoot_mpc.zmp.preview.problem import PreviewProblem

_UNIT = 1e-3
"""m, length that is one in the problem: solvers have absolute tolerances."""
_EXACT = 1e-6
"""m, by which an answer may miss the optimum's conditions."""
_GRADIENT_STEPS = 200
_GRADIENT_ROWS = 64

Indices = NDArray[np.intp]
_NOTHING: Indices = np.zeros(0, dtype=np.intp)


class Solver(Protocol):
    """What is asked of a backend."""

    def solve(self, problem: QpProblem) -> QpSolution:
        """Solve one problem."""

    def reset(self) -> None:
        """Forget earlier problems."""


@dataclass(frozen=True, kw_only=True, slots=True)
class ProgramResult:
    """How a program ended; the problem's path is the plan.

    Attributes:
        solved: True when the plan is what was asked for.
        iterations: of the solver, all rounds together.
    """

    solved: bool
    iterations: int


def sizes(config: PreviewConfig) -> tuple[QpSize, ...]:
    """Sizes of the problems; a plan meets fewer rows than the last one holds."""
    most = 4 * config.samples
    counts = [*(count for count in config.rows if count < most), most]
    return tuple(QpSize(variables=count, rows=count) for count in counts)


class PreviewProgram:
    """Workspace of the program; only the solvers keep memory between plans.

    Args:
        config: weights and tolerances.
        maps: the problem of one axis.
        solvers: for problems of `sizes`, in their order.
    """

    def __init__(self, config: PreviewConfig, maps: PreviewMaps, solvers: tuple[Solver, ...]) -> None:
        n = config.samples
        self._config = config
        self._by_shift = np.vstack([maps.forced @ maps.root, maps.root])
        self._levers = np.full(n, np.nan)
        self._responses = np.zeros((2 * n + 1, n))  # points per w
        weights = config.weights
        prices = np.repeat([weights.support_slack, weights.reach_slack, weights.capture_slack], [n, n, 1])
        self._softness = np.repeat(1.0 / prices, 4)
        self._stages = tuple(
            _Stage(solver, size.rows) for solver, size in zip(solvers, sizes(config), strict=True)
        )

    def reset(self) -> None:
        """Forget earlier problems."""
        for stage in self._stages:
            stage.solver.reset()

    def solve(self, problem: PreviewProblem) -> ProgramResult:
        """Turn the problem's path from the unconstrained optimum, evaluated before, into the optimum."""
        self._take_levers(problem.levers)
        optimum, free = problem.path.copy(), problem.residuals.copy()
        iterations, met, refused = 0, _NOTHING, 0
        for stage in self._stages:
            for _ in range(self._config.rounds):
                chosen = stage.choose(problem.residuals, met)
                normals, responses = self._take_rows(problem, chosen)
                gram = self._gram(normals, responses, chosen)
                count, multiplier = stage.solve(gram, free[chosen])
                iterations += count
                if multiplier is None:
                    refused += 1
                    break
                self._move(problem, optimum, responses, multiplier[:, None] * normals)
                if not self._holds(problem.residuals.take(chosen), chosen, multiplier):
                    refused += 1
                    break
                outside = problem.residuals < -self._config.tolerance
                outside[chosen] = False
                if not outside.any():
                    return ProgramResult(solved=True, iterations=iterations)
                met = chosen[multiplier > 0.0]
                if len(met) + np.count_nonzero(outside) > stage.count:
                    break  # the next stage holds more
            if refused > 1:
                break
        problem.path[:] = optimum
        problem.evaluate()
        return ProgramResult(solved=False, iterations=iterations)

    def approximate(self, problem: PreviewProblem) -> ProgramResult:
        """Turn the path from the unconstrained optimum into one near the optimum, without any solver.

        Projected gradients on the multipliers. It counts as solved when no row
        is broken by more than is configured.
        """
        self._take_levers(problem.levers)
        optimum, free = problem.path.copy(), problem.residuals
        chosen = np.argsort(free)[:_GRADIENT_ROWS]
        normals, responses = self._take_rows(problem, chosen)
        gram = self._gram(normals, responses, chosen)
        scale = gram.diagonal() ** -0.5
        gram, free = scale[:, None] * gram * scale, scale * free[chosen]
        step = 1.0 / float(np.abs(gram).sum(axis=1).max())
        multiplier, point = np.zeros(len(chosen)), np.zeros(len(chosen))
        momentum = 1.0
        for _ in range(_GRADIENT_STEPS):
            following = np.maximum(point - step * (gram @ point + free), 0.0)
            faster = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * momentum * momentum))
            point = following + (momentum - 1.0) / faster * (following - multiplier)
            multiplier, momentum = following, faster
        self._move(problem, optimum, responses, (scale * multiplier)[:, None] * normals)
        near_enough = bool(problem.residuals.min() > -self._config.nearest_violation)
        return ProgramResult(solved=near_enough, iterations=_GRADIENT_STEPS)

    def _take_levers(self, levers: FloatArray) -> None:
        if np.array_equal(levers, self._levers):
            return
        n = len(levers)
        self._levers[:] = levers
        position, velocity, acceleration, _ = self._by_shift.reshape(4, n, n)
        self._responses[:n] = position - levers[:, None] * acceleration
        self._responses[n : 2 * n] = position
        self._responses[2 * n] = position[-1] + math.sqrt(levers[-1]) * velocity[-1]

    def _take_rows(self, problem: PreviewProblem, chosen: Indices) -> tuple[FloatArray, FloatArray]:
        """(k, 2) normals of rows, and (k, n) responses of their points to w."""
        return problem.normals.take(chosen, axis=0), self._responses.take(chosen >> 2, axis=0)

    def _gram(self, normals: FloatArray, responses: FloatArray, chosen: Indices) -> FloatArray:
        """(k, k) products of the responses of rows, with their softness."""
        gram: FloatArray = responses @ responses.T
        gram *= normals @ normals.T
        gram.reshape(-1)[:: len(chosen) + 1] += self._softness.take(chosen)
        return gram

    def _holds(self, residuals: FloatArray, chosen: Indices, multiplier: FloatArray) -> bool:
        """True when an answer is the optimum on its rows: met ones are broken by their slack, others not.

        The path is a sum of responses, which is the rest of the conditions.
        """
        gap = residuals + self._softness.take(chosen) * multiplier
        # Multipliers are not negative: the product is small only where each of its terms is.
        return bool(gap.min() > -_EXACT and gap.dot(multiplier) < _EXACT * (1.0 + multiplier.sum()))

    def _move(
        self, problem: PreviewProblem, optimum: FloatArray, responses: FloatArray, pull: FloatArray
    ) -> None:
        """Put the path at the unconstrained optimum less the responses to (k, 2) pulls, and evaluate it."""
        np.matmul(self._by_shift, responses.T @ pull, out=problem.path)
        np.subtract(optimum, problem.path, out=problem.path)
        problem.evaluate()


class _Stage:
    """One solver and its problem.

    Args:
        solver: the backend.
        count: rows of a problem.
    """

    def __init__(self, solver: Solver, count: int) -> None:
        self.solver, self.count = solver, count
        self._problem = QpProblem.empty(QpSize(variables=count, rows=count))

    def choose(self, residuals: FloatArray, met: Indices) -> Indices:
        """The rows that were met and those with the smallest residuals."""
        if len(met) > 0:
            residuals = residuals.copy()
            residuals[met] = -np.inf
        return residuals.argpartition(self.count)[: self.count]

    def solve(self, gram: FloatArray, free: FloatArray) -> tuple[int, FloatArray | None]:
        """Iterations, and the (k,) multipliers of the rows, not negative; None without an answer."""
        problem = self._problem
        # LAPACK by itself: numpy's way to it costs four times as much at this size.
        root, flag = dpotrf(gram.T, lower=1, clean=1, overwrite_a=1)
        if flag != 0:
            return 0, None
        problem.matrix[:] = root
        np.multiply(free, 1.0 / _UNIT, out=problem.upper)
        solution = self.solver.solve(problem)
        if not solution.ok:
            return solution.iterations, None
        given = solution.row_multiplier
        multiplier = np.asarray(np.linalg.solve(problem.matrix.T, -solution.x) if given is None else given)
        usable = math.isfinite(float(multiplier.sum()))
        return solution.iterations, np.maximum(multiplier, 0.0) * _UNIT if usable else None
