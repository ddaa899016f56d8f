"""proxsuite's dense ProxQP, an augmented Lagrangian method, with its traps fenced off.

Found on whole-body and preview problems of these sizes: the primal-dual factorization is
the fastest; the default threshold calls feasible problems infeasible (7 of 81), 1e-10 none;
a warm start that keeps the penalties reports success with complementarity off by 3e-4, one
that starts them anew is right to 1e-8 and a fifth slower; infeasible problems without
certificate run for 0.4 s unless both loops are capped, solved ones need 8 outer steps;
where matrices are fixed the equality-constrained guess beats the previous answer by half.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import proxsuite

from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.qp.solver import Solver
from bluefoot_mpc.types import BoolArray, FloatArray

_proxqp = proxsuite.proxqp
_Guess = _proxqp.InitialGuess
_STATUS = {
    _proxqp.QPSolverOutput.PROXQP_SOLVED: QpStatus.SOLVED,
    _proxqp.QPSolverOutput.PROXQP_MAX_ITER_REACHED: QpStatus.MAX_ITERATIONS,
    _proxqp.QPSolverOutput.PROXQP_PRIMAL_INFEASIBLE: QpStatus.INFEASIBLE,
}
_INFEASIBILITY_THRESHOLD = 1e-10
_PENALTY = 1e-2  # of inequalities after a warm start; a tenth of the default: a seventh less time
_LOOP_LIMIT = 25  # outer steps, and inner steps of each
_WORKSPACES = 8  # equality patterns kept, e.g. one per set of stance feet


class ProxsuiteSolver(Solver):
    """ProxQP with a workspace per pattern of equalities; what fails warm is tried again from the start."""

    def __init__(self, size: QpSize, options: SolverOptions) -> None:
        super().__init__(size, options)
        self._workspaces: dict[bytes, _Workspace] = {}
        self._current: _Workspace | None = None
        self._equal = np.zeros(size.rows, dtype=np.bool_)

    def _forget(self) -> None:
        self._workspaces.clear()
        self._current = None

    def _solve(self, problem: QpProblem) -> QpSolution:
        np.equal(self._lower, self._upper, out=self._equal)
        key = self._equal.tobytes()
        workspace = self._workspaces.get(key)
        if workspace is None:
            workspace = self._new_workspace(key)
        elif workspace is not self._current:
            workspace.cool()
        warm = workspace.warm
        status = self._run(workspace, problem)
        if status is not QpStatus.SOLVED and warm:
            workspace = self._new_workspace(key)
            status = self._run(workspace, problem)
        self._current = workspace
        results = workspace.qp.results
        iterations = int(results.info.iter)
        if status is not QpStatus.SOLVED:
            del self._workspaces[key]
            return self._failure(status, iterations)
        row, bound = workspace.multipliers()
        return QpSolution(
            x=results.x, status=status, row_multiplier=row, bound_multiplier=bound, iterations=iterations
        )

    def _new_workspace(self, key: bytes) -> _Workspace:
        if len(self._workspaces) >= _WORKSPACES:
            self._workspaces.clear()
        self._workspaces[key] = workspace = _Workspace(self._equal, self.size, self.options)
        return workspace

    def _run(self, workspace: _Workspace, problem: QpProblem) -> QpStatus:
        workspace.load(problem, self._lower, self._upper, self._floor, self._ceiling)
        workspace.qp.solve()
        return _STATUS.get(workspace.qp.results.info.status, QpStatus.FAILED)


class _Workspace:
    """ProxQP's memory for one pattern of equalities."""

    def __init__(self, equal: BoolArray, size: QpSize, options: SolverOptions) -> None:
        self._equal_rows = np.flatnonzero(equal)
        self._other_rows = np.flatnonzero(~equal)
        self._n_equal, self._n_other = len(self._equal_rows), len(self._other_rows)
        n = size.variables
        self._a = np.zeros((self._n_equal, n))
        self._b = np.zeros(self._n_equal)
        self._c = np.zeros((self._n_other, n))
        self._low = np.zeros(self._n_other)
        self._high = np.zeros(self._n_other)
        self._row_multiplier = np.zeros(size.rows)
        self._options = options
        self._follows = options.warm_start and not options.fixed_matrices
        self._loaded = False
        self.warm = False
        dense = _proxqp.dense
        self.qp = dense.QP(
            n, self._n_equal, self._n_other, True,
            dense.HessianType.Dense, dense.DenseBackend.PrimalDualLDLT,
        )  # fmt: skip
        self._configure(self.qp.settings)

    def _configure(self, settings: Any) -> None:
        settings.eps_abs = self._options.tolerance
        settings.max_iter = min(self._options.max_iterations, _LOOP_LIMIT)
        settings.max_iter_in = min(self._options.max_iterations, _LOOP_LIMIT)
        settings.eps_primal_inf = _INFEASIBILITY_THRESHOLD
        settings.eps_dual_inf = _INFEASIBILITY_THRESHOLD
        if self._follows:
            settings.default_mu_in = _PENALTY
            settings.cold_reset_mu_in = _PENALTY
        settings.merit_function_type = _proxqp.MeritFunctionType.PDAL
        settings.initial_guess = _Guess.EQUALITY_CONSTRAINED_INITIAL_GUESS

    def cool(self) -> None:
        """Start the next solve from nothing."""
        self.warm = False
        self.qp.settings.initial_guess = _Guess.EQUALITY_CONSTRAINED_INITIAL_GUESS

    def load(
        self, problem: QpProblem, lower: FloatArray, upper: FloatArray, floor: FloatArray, ceiling: FloatArray
    ) -> None:
        """Pass a problem on; `update` before the first `solve` with a warm start would crash the process."""
        np.take(lower, self._equal_rows, out=self._b, mode="clip")
        np.take(lower, self._other_rows, out=self._low, mode="clip")
        np.take(upper, self._other_rows, out=self._high, mode="clip")
        if self._loaded and self._options.fixed_matrices:
            matrices: dict[str, FloatArray] = {}
        else:
            np.take(problem.matrix, self._equal_rows, axis=0, out=self._a, mode="clip")
            np.take(problem.matrix, self._other_rows, axis=0, out=self._c, mode="clip")
            matrices = {"H": problem.hessian, "A": self._a, "C": self._c}
        vectors = {"g": problem.gradient, "b": self._b, "l": self._low, "u": self._high}
        if not self._loaded:
            self.qp.init(**matrices, **vectors, l_box=floor, u_box=ceiling)
            self._loaded = True
            return
        self.qp.update(**matrices, **vectors, l_box=floor, u_box=ceiling)
        if self._follows and not self.warm:
            self.warm = True
            self.qp.settings.initial_guess = _Guess.COLD_START_WITH_PREVIOUS_RESULT

    def multipliers(self) -> tuple[FloatArray, FloatArray]:
        """(m,) of the rows and (n,) of the bounds."""
        results = self.qp.results
        z = results.z
        self._row_multiplier[self._equal_rows] = results.y
        self._row_multiplier[self._other_rows] = z[: self._n_other]
        return self._row_multiplier, z[self._n_other :]
