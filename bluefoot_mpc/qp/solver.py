"""What all solvers share: a problem is checked before, an answer after."""

from __future__ import annotations

import abc

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.types import FloatArray

INFINITY = 1e20
"""Bounds at least this large do not exist; solvers agree on a finite one better than on inf."""


class Solver(abc.ABC):
    """A solver for problems of one size.

    It never raises for a numerical failure, and calls nothing solved that is
    not finite or (unless told otherwise) breaks a row or bound: solvers were
    seen to report success with both.

    Sides of rows and bounds are kept stacked, bounds first: n + m entries.
    """

    def __init__(self, size: QpSize, options: SolverOptions) -> None:
        if size.variables < 1 or size.rows < 0:
            raise ConfigurationError(f"impossible size of a quadratic program: {size}")
        n, total = size.variables, size.variables + size.rows
        self.size = size
        self.options = options
        self._shape = (size.rows, size.variables)
        self._low = np.zeros(total)  # stacked floor and lower
        self._high = np.zeros(total)  # stacked ceiling and upper
        self._value = np.zeros(total)  # stacked x and A x
        self._lowest = np.full(total, -INFINITY)
        self._highest = np.full(total, INFINITY)
        self._floor, self._lower = self._low[:n], self._low[n:]
        self._ceiling, self._upper = self._high[:n], self._high[n:]
        self._value_x, self._value_rows = self._value[:n], self._value[n:]
        self._excess = np.zeros(total)
        self._nearest = np.zeros(total)
        self._acceptance_squared = options.acceptance**2
        self._ordered = np.zeros(total, dtype=np.bool_)
        self._total = total
        self._nothing = np.full(n, np.nan)
        self._checked_matrices = False

    def reset(self) -> None:
        """Forget all problems seen: the state after init, bit for bit."""
        self._checked_matrices = False
        self._forget()

    def solve(self, problem: QpProblem) -> QpSolution:
        """The answer to a problem; its status says what x is worth.

        Raises:
            ConfigurationError: the problem has another size than the solver.
        """
        if problem.matrix.shape != self._shape:
            raise ConfigurationError(f"solver for {self.size} was given a problem of {problem.size}")
        refused = self._load(problem)
        if refused is not None:
            return self._failure(refused)
        answer = self._solve(problem)
        if answer.status is QpStatus.SOLVED and not self._holds(answer.x, problem.matrix):
            self._forget()
            return self._failure(QpStatus.FAILED, answer.iterations)
        return answer

    @abc.abstractmethod
    def _solve(self, problem: QpProblem) -> QpSolution:
        """The answer as the solver gives it; sides of finite problems stand in the stacked arrays."""

    @abc.abstractmethod
    def _forget(self) -> None:
        """Drop the warm start and every factorization."""

    def _failure(self, status: QpStatus, iterations: int = 0) -> QpSolution:
        """An answer without an x."""
        return QpSolution(x=self._nothing, status=status, iterations=iterations)

    def _load(self, problem: QpProblem) -> QpStatus | None:
        """Stack the sides with finite infinities; what to answer at once where that makes no problem."""
        low, high, ordered = self._low, self._high, self._ordered
        self._floor[:] = problem.floor
        self._lower[:] = problem.lower
        self._ceiling[:] = problem.ceiling
        self._upper[:] = problem.upper
        np.maximum(low, self._lowest, out=low)
        np.minimum(high, self._highest, out=high)
        # A sum of squares is finite only where all entries are, and costs less than isfinite.
        total = problem.gradient.dot(problem.gradient)
        if not self._checked_matrices:
            hessian, matrix = problem.hessian.ravel(), problem.matrix.ravel()
            total += hessian.dot(hessian) + matrix.dot(matrix)
        if not total < np.inf:
            return QpStatus.FAILED
        self._checked_matrices = self.options.fixed_matrices
        np.less_equal(low, high, out=ordered)
        if np.count_nonzero(ordered) == self._total:
            return None
        return QpStatus.FAILED if np.isnan(low + high).any() else QpStatus.INFEASIBLE

    def _holds(self, x: FloatArray, matrix: FloatArray) -> bool:
        """True when x is finite and, where that is to be verified, within rows and bounds."""
        if not self.options.verify:
            return bool(x.dot(x) < np.inf)
        value, nearest, excess = self._value, self._nearest, self._excess
        self._value_x[:] = x
        np.dot(matrix, x, out=self._value_rows)
        np.maximum(value, self._low, out=nearest)
        np.minimum(nearest, self._high, out=nearest)
        np.subtract(value, nearest, out=excess)
        if excess.dot(excess) <= self._acceptance_squared:  # the usual case; NaN goes on
            return True
        return bool(np.max(np.abs(excess) / np.maximum(np.abs(nearest), 1.0)) <= self.options.acceptance)
