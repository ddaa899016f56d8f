"""The solvers inside CasADi, called through a buffer: no conversion of matrices on the way."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.qp.solver import Solver

_FIRST_ORDER_STEPS = 100  # times as many as of a method with factorizations


def _qrqp(options: SolverOptions) -> dict[str, Any]:
    return {
        "print_iter": False, "print_header": False, "print_info": False, "max_iter": options.max_iterations,
        "constr_viol_tol": options.tolerance, "dual_inf_tol": options.tolerance,
    }  # fmt: skip


def _qpoases(options: SolverOptions) -> dict[str, Any]:
    return {"printLevel": "none", "nWSR": options.max_iterations}


def _osqp(options: SolverOptions) -> dict[str, Any]:
    steps = options.max_iterations * _FIRST_ORDER_STEPS
    return {"osqp": {"verbose": False, "eps_abs": options.tolerance, "eps_rel": 0.0, "max_iter": steps}}


def _daqp(options: SolverOptions) -> dict[str, Any]:
    return {"daqp": {"primal_tol": options.tolerance, "iter_limit": options.max_iterations}}


def _proxqp(options: SolverOptions) -> dict[str, Any]:
    return {"proxqp": {"eps_abs": options.tolerance, "max_iter": options.max_iterations}}


PLUGINS: dict[str, Callable[[SolverOptions], dict[str, Any]]] = {
    "qrqp": _qrqp,
    "qpoases": _qpoases,
    "osqp": _osqp,
    "daqp": _daqp,
    "proxqp": _proxqp,
}
"""Plugins by CasADi's names, with their options.

Of the others clp and cbc solve linear programs only, hpipm and fatrop want stages,
superscs takes 0.2 s a problem, ipqp and piqp print, and highs crashes the process where
the highspy package is loaded too, as by qpsolvers.
"""


class ConicSolver(Solver):
    """A CasADi conic plugin with dense H and A."""

    def __init__(self, plugin: str, size: QpSize, options: SolverOptions) -> None:
        super().__init__(size, options)
        self._plugin = plugin
        self._build()

    def _build(self) -> None:
        n, m = self.size.variables, self.size.rows
        shapes = {"h": ca.Sparsity.dense(n, n), "a": ca.Sparsity.dense(m, n)}
        settings = {"error_on_fail": False, "print_time": False, **PLUGINS[self._plugin](self.options)}
        self._function = function = ca.conic("solver", self._plugin, shapes, settings)
        buffer: Any
        # The buffer will take the memory that is free now; statistics are asked for by its number.
        self._memory = function.checkout()
        function.release(self._memory)
        buffer, self._evaluate = function.buffer()
        self._loaded = False
        self._in = {
            name: np.zeros(function.sparsity_in(i).nnz()) for i, name in enumerate(function.name_in())
        }
        self._out = {
            name: np.zeros(function.sparsity_out(i).nnz()) for i, name in enumerate(function.name_out())
        }
        for i, array in enumerate(self._in.values()):
            buffer.set_arg(i, memoryview(array))  # type: ignore[arg-type]
        for i, array in enumerate(self._out.values()):
            buffer.set_res(i, memoryview(array))  # type: ignore[arg-type]
        self._buffer = buffer  # keeps what it points to alive
        self._hessian = self._in["h"].reshape(n, n)  # symmetric: by columns is by rows
        self._columns = self._in["a"].reshape(n, m)  # A by columns is its transpose by rows

    def _forget(self) -> None:
        self._build()

    def _solve(self, problem: QpProblem) -> QpSolution:
        given = self._in
        if not (self._loaded and self.options.fixed_matrices):
            self._hessian[:] = problem.hessian
            self._columns[:] = problem.matrix.T
            self._loaded = True
        given["g"][:] = problem.gradient
        # CasADi tells a missing side by inf
        given["lba"][:], given["uba"][:] = problem.lower, problem.upper
        given["lbx"][:], given["ubx"][:] = problem.floor, problem.ceiling
        try:
            self._evaluate()
        except RuntimeError:  # some raise whatever they were told
            stats: dict[str, Any] = {}
        else:
            stats = self._stats()
        status = _status_of(stats)
        iterations = max(int(stats.get("iter_count", 0)), 0)  # -1 where the solver does not count
        if status is not QpStatus.SOLVED:
            self._start_from(zero=True)
            return self._failure(status, iterations)
        self._start_from(zero=not self.options.warm_start)
        return QpSolution(
            x=self._out["x"],
            status=status,
            row_multiplier=self._out["lam_a"],
            bound_multiplier=self._out["lam_x"],
            iterations=iterations,
        )

    def _start_from(self, zero: bool) -> None:
        for start, end in (("x0", "x"), ("lam_x0", "lam_x"), ("lam_a0", "lam_a")):
            self._in[start][:] = 0.0 if zero else self._out[end]

    def _stats(self) -> dict[str, Any]:
        """Statistics of the last solve; none where it broke off before there were any."""
        try:
            return dict(self._function.stats(self._memory))
        except RuntimeError:
            return {}


def _status_of(stats: dict[str, Any]) -> QpStatus:
    """Status by the flags and, where there are only words, by the words."""
    if stats.get("success"):
        return QpStatus.SOLVED
    words = str(stats.get("return_status", "")).lower()
    if stats.get("return_status") == -1 or "infeasible" in words:  # -1 is daqp's
        return QpStatus.FAILED if "dual" in words else QpStatus.INFEASIBLE
    if stats.get("unified_return_status") == "SOLVER_RET_LIMITED" or "max" in words:
        return QpStatus.MAX_ITERATIONS
    return QpStatus.FAILED
