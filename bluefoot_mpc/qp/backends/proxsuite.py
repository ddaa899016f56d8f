"""proxsuite's dense ProxQP, an augmented Lagrangian method, with its traps fenced off.

Found on problems of the sizes met here (28 and 64 variables):

- The primal-dual factorization is the fastest.
- The default threshold calls feasible problems infeasible (7 of 81); 1e-10 none of those.
- Without the check of the duality gap it reports success with multipliers on sides that
  x is away from, on a problem of two variables even; with it, one in a thousand after
  a warm start that starts the penalties anew (more, and 3e-4 off, where they are kept).
  Answers are therefore checked once more here.
- Infeasible problems without certificate run for 0.4 s unless both loops are capped;
  solved ones were seen to need 14 outer steps.
- Where matrices are fixed the equality-constrained guess takes half the time of a warm start.
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
# Penalty of inequalities at the start. Warm, a tenth of the default takes a seventh less
# time; of 18 000 hard random problems the default left 3 unsolved, and the last one none of those.
_COLD_PENALTY = 0.1
_WARM_PENALTY = 0.01
_LAST_PENALTY = 0.001
_STRICTNESS = 0.1  # of the tolerance
_LOOP_LIMIT = 20  # outer steps, and inner steps of each
_WORKSPACES = 16  # equality patterns kept, e.g. one per set of stance feet


class ProxsuiteSolver(Solver):
    """ProxQP with a workspace per pattern of equalities; what fails is tried again from the start.

    Its last bits depend on where its memory lies. Workspaces are therefore kept
    over `reset` and started anew in place, so that a run after `reset` repeats
    the run before bit for bit; another process may differ in the last bits.
    """

    def __init__(self, size: QpSize, options: SolverOptions) -> None:
        super().__init__(size, options)
        self._workspaces: dict[bytes, _Workspace] = {}
        self._current: _Workspace | None = None
        self._equal = np.zeros(size.rows, dtype=np.bool_)

    def _forget(self) -> None:
        for workspace in self._workspaces.values():
            workspace.restart()
        self._current = None

    def _solve(self, problem: QpProblem) -> QpSolution:
        np.equal(self._lower, self._upper, out=self._equal)
        workspace = self._workspace_for(self._equal.tobytes())
        if workspace is not self._current:
            workspace.restart()
            self._current = workspace
        status = self._run(workspace, problem)
        if status is not QpStatus.SOLVED and workspace.warm:
            workspace.restart()
            status = self._run(workspace, problem)
        if status is not QpStatus.SOLVED:
            workspace.restart(_LAST_PENALTY)
            status = self._run(workspace, problem)
        results = workspace.qp.results
        iterations = int(results.info.iter)
        if status is not QpStatus.SOLVED:
            workspace.restart()
            return self._failure(status, iterations)
        row, bound = workspace.multipliers()
        return QpSolution(
            x=results.x, status=status, row_multiplier=row, bound_multiplier=bound, iterations=iterations
        )

    def _workspace_for(self, pattern: bytes) -> _Workspace:
        workspace = self._workspaces.get(pattern)
        if workspace is None:
            if len(self._workspaces) >= _WORKSPACES:
                self._workspaces.clear()
            workspace = self._workspaces[pattern] = _Workspace(self._equal, self.size, self.options)
        return workspace

    def _complements(self, workspace: _Workspace, problem: QpProblem) -> bool:
        """True when no multiplier pushes from a side that x is away from."""
        n, results = self.size.variables, workspace.qp.results
        value, distance, push = self._value, self._nearest, self._excess
        value[:n] = results.x
        np.dot(problem.matrix, value[:n], out=value[n:])
        np.subtract(self._high, value, out=distance)
        np.subtract(value, self._low, out=value)
        np.minimum(distance, value, out=distance)
        push[n:], push[:n] = workspace.multipliers()
        np.multiply(push, distance, out=push)
        # summed squares bound the largest; the gradient sets the scale of multipliers
        limit = self.options.acceptance**2 * (1.0 + problem.gradient.dot(problem.gradient))
        return bool(push.dot(push) <= limit)

    def _run(self, workspace: _Workspace, problem: QpProblem) -> QpStatus:
        workspace.load(problem, self._lower, self._upper, self._floor, self._ceiling)
        workspace.qp.solve()
        info, tolerance = workspace.qp.results.info, self.options.tolerance
        status = _STATUS.get(info.status, QpStatus.FAILED)
        if status is QpStatus.MAX_ITERATIONS and max(info.pri_res, info.dua_res) <= tolerance:
            status = QpStatus.SOLVED  # it was asked for a tenth of that
        if status is QpStatus.SOLVED and not self._complements(workspace, problem):
            return QpStatus.FAILED
        return status


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
        settings.eps_abs = _STRICTNESS * self._options.tolerance
        settings.max_iter = min(self._options.max_iterations, _LOOP_LIMIT)
        settings.max_iter_in = min(self._options.max_iterations, _LOOP_LIMIT)
        settings.eps_primal_inf = _INFEASIBILITY_THRESHOLD
        settings.eps_dual_inf = _INFEASIBILITY_THRESHOLD
        settings.check_duality_gap = True
        settings.eps_duality_gap_abs = self._options.tolerance
        settings.eps_duality_gap_rel = self._options.tolerance
        settings.initial_guess = _Guess.EQUALITY_CONSTRAINED_INITIAL_GUESS

    def restart(self, penalty: float = _COLD_PENALTY) -> None:
        """Start the next solve from nothing, matrices included."""
        self.warm = False
        self._loaded = False
        self.qp.settings.default_mu_in = penalty
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
            self.qp.settings.default_mu_in = _WARM_PENALTY
            self.qp.settings.cold_reset_mu_in = _WARM_PENALTY
            self.qp.settings.initial_guess = _Guess.COLD_START_WITH_PREVIOUS_RESULT

    def multipliers(self) -> tuple[FloatArray, FloatArray]:
        """(m,) of the rows and (n,) of the bounds."""
        results = self.qp.results
        z = results.z
        self._row_multiplier[self._equal_rows] = results.y
        self._row_multiplier[self._other_rows] = z[: self._n_other]
        return self._row_multiplier, z[self._n_other :]
