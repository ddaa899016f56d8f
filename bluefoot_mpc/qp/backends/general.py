"""Solvers behind the qpsolvers package: to compare with, not for a control tick."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import qpsolvers
from scipy import sparse

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.qp.solver import INFINITY, Solver
from bluefoot_mpc.types import BoolArray, FloatArray

_FIRST_ORDER_STEPS = 100  # times as many as of a method with factorizations


def _quadprog(_options: SolverOptions) -> dict[str, Any]:
    return {}


def _osqp(options: SolverOptions) -> dict[str, Any]:
    steps = options.max_iterations * _FIRST_ORDER_STEPS
    return {"eps_abs": options.tolerance, "eps_rel": 0.0, "max_iter": steps}


def _piqp(options: SolverOptions) -> dict[str, Any]:
    return {"eps_abs": options.tolerance, "eps_rel": 0.0, "max_iter": options.max_iterations}


def _clarabel(options: SolverOptions) -> dict[str, Any]:
    return {
        "tol_feas": options.tolerance, "tol_gap_abs": options.tolerance, "tol_gap_rel": options.tolerance,
        "max_iter": options.max_iterations,
    }  # fmt: skip


def _highs(options: SolverOptions) -> dict[str, Any]:
    tolerance = max(options.tolerance, 1e-10)
    return {"primal_feasibility_tolerance": tolerance, "dual_feasibility_tolerance": tolerance}


def _scs(options: SolverOptions) -> dict[str, Any]:
    steps = options.max_iterations * _FIRST_ORDER_STEPS
    return {"eps_abs": options.tolerance, "eps_rel": 0.0, "max_iters": steps}


SETTINGS: dict[str, Callable[[SolverOptions], dict[str, Any]]] = {
    "quadprog": _quadprog,
    "osqp": _osqp,
    "piqp": _piqp,
    "clarabel": _clarabel,
    "highs": _highs,
    "scs": _scs,
}
"""Names in qpsolvers, with the keywords of each."""

_SPARSE = frozenset({"osqp", "clarabel", "highs", "scs"})


class GeneralSolver(Solver):
    """Any solver of qpsolvers; it starts from nothing each time."""

    def __init__(self, name: str, size: QpSize, options: SolverOptions) -> None:
        super().__init__(size, options)
        if name not in qpsolvers.available_solvers:
            raise ConfigurationError(f"qpsolvers does not know its solver '{name}' here; reinstall it")
        self._name = name
        self._settings = SETTINGS[name](options)

    def _forget(self) -> None:
        """There is nothing to forget: no answer depends on the one before."""

    def _solve(self, problem: QpProblem) -> QpSolution:
        equal = self._lower == self._upper
        above = ~equal & (self._upper < INFINITY)
        below = ~equal & (self._lower > -INFINITY)
        a, m = problem.matrix, self._matrix
        split = qpsolvers.Problem(
            m(problem.hessian), problem.gradient,
            m(np.concatenate([a[above], -a[below]])),
            np.concatenate([self._upper[above], -self._lower[below]]),
            m(a[equal]), self._lower[equal], problem.floor, problem.ceiling,
        )  # fmt: skip
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of the solvers about their own future and accuracy
                answer = qpsolvers.solve_problem(split, solver=self._name, verbose=False, **self._settings)
        except (qpsolvers.exceptions.QPError, ValueError, ArithmeticError):
            return self._failure(QpStatus.FAILED)
        if not answer.found or answer.x is None:
            return self._failure(_status_of(answer.extras))
        row = self._row_multiplier(answer, (equal, above, below))
        return QpSolution(
            x=np.asarray(answer.x, dtype=float),
            status=QpStatus.SOLVED,
            row_multiplier=row,
            bound_multiplier=None if row is None or answer.z_box is None else np.asarray(answer.z_box),
        )

    def _matrix(self, dense: FloatArray) -> Any:
        return sparse.csc_matrix(dense) if self._name in _SPARSE else dense

    def _row_multiplier(
        self, answer: Any, parts: tuple[BoolArray, BoolArray, BoolArray]
    ) -> FloatArray | None:
        """(m,) multipliers of the two-sided rows from those of the parts they were split into."""
        equal, above, below = parts
        row = np.zeros(self.size.rows)
        if equal.any():
            if answer.y is None:
                return None
            row[equal] = answer.y
        if above.any() or below.any():
            if answer.z is None:
                return None
            count = np.count_nonzero(above)
            row[above] += answer.z[:count]
            row[below] -= answer.z[count:]
        return row


def _status_of(extras: dict[str, Any]) -> QpStatus:
    """Status by the words that some solvers leave behind."""
    words = " ".join(str(value) for value in extras.values()).lower()
    if "infeasible" in words:
        return QpStatus.INFEASIBLE
    return QpStatus.MAX_ITERATIONS if "max" in words and "iter" in words else QpStatus.FAILED
