"""daqp, a dual active-set method: set up once, then only what changed is passed on.

The Python package's own model costs about 5 µs a call beyond the solver. The
libdaqp inside CasADi's wheel would save 4 of them by ctypes, but it is older
and called wrong answers optimal after warm updates of H and A.
"""

from __future__ import annotations

from typing import Any

import daqp
import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.qp.options import SolverOptions
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.qp.solver import Solver
from bluefoot_mpc.types import FloatArray

# Flags of daqp's documentation.
_OPTIMAL = 1
_STATUS = {
    -1: QpStatus.INFEASIBLE,
    -6: QpStatus.INFEASIBLE,  # equalities that contradict each other
    -4: QpStatus.MAX_ITERATIONS,
    -7: QpStatus.MAX_ITERATIONS,
}
_EQUALITY = 5  # active and may not leave
_ACTIVE_UPPER = 1
_ACTIVE_LOWER = 3

_Answer = tuple[int, FloatArray, dict[str, Any]]  # flag, x, what else daqp says


class DaqpSolver(Solver):
    """daqp with its workspace kept; what fails warm is tried again from the start."""

    def __init__(self, size: QpSize, options: SolverOptions) -> None:
        super().__init__(size, options)
        total = size.variables + size.rows
        self._equal = np.zeros(total, dtype=np.bool_)
        self._equal_before = b""
        self._sense = np.zeros(total, dtype=np.intc)
        self._settings = {"primal_tol": options.tolerance, "iter_limit": options.max_iterations + 1}
        self._model: Any = None
        self._multiplier: FloatArray | None = None  # stacked, of the last answer

    def _forget(self) -> None:
        self._model = None
        self._multiplier = None

    def _solve(self, problem: QpProblem) -> QpSolution:
        np.equal(self._low, self._high, out=self._equal)
        warm = self._model is not None
        flag, x, info = self._updated(problem) if warm else self._set_up(problem)
        if flag != _OPTIMAL and warm:
            flag, x, info = self._set_up(problem)
        if flag != _OPTIMAL and self._equal.any():
            flag, x, info = self._reduced(problem)
        iterations = info.get("iterations", 0)
        if flag != _OPTIMAL:
            self._forget()
            return self._failure(_STATUS.get(flag, QpStatus.FAILED), iterations)
        n = self.size.variables
        self._multiplier = multiplier = info["lam"]
        return QpSolution(
            x=x,
            status=QpStatus.SOLVED,
            row_multiplier=multiplier[n:],
            bound_multiplier=multiplier[:n],
            iterations=iterations,
        )

    def _set_up(self, problem: QpProblem) -> _Answer:
        """Solve with a new workspace, from nothing."""
        self._model = model = daqp.Model()
        model.settings = self._settings
        self._mark(start=None)
        flag, _ = model.setup(
            problem.hessian, problem.gradient, problem.matrix, self._high, self._low, self._sense
        )
        return self._answer(model, flag)

    def _updated(self, problem: QpProblem) -> _Answer:
        """Solve in the kept workspace, from the last active set unless that is not wanted."""
        model, sense = self._model, None
        if not self.options.warm_start:
            sense = self._mark(start=None)
        elif self._equal.tobytes() != self._equal_before:
            # older versions never free an equality by themselves; said anew, 0.11 needs fewer steps too
            sense = self._mark(start=self._multiplier)
        if self.options.fixed_matrices:
            flag = model.update(f=problem.gradient, bupper=self._high, blower=self._low, sense=sense)
        else:
            flag = model.update(
                problem.hessian, problem.gradient, problem.matrix, self._high, self._low, sense
            )
        return self._answer(model, flag)

    def _reduced(self, problem: QpProblem) -> _Answer:
        """Solve with equalities eliminated first: repeated ones may look infeasible otherwise."""
        self._model = None
        x, _, flag, info = daqp.solve(
            problem.hessian, problem.gradient, problem.matrix, self._high, self._low,
            self._mark(start=None), eq_reduction=1, **self._settings,
        )  # fmt: skip
        return flag, x, info

    def _answer(self, model: Any, flag: int) -> _Answer:
        if flag < 0:
            return flag, self._nothing, {}
        x, _, flag, info = model.solve()
        return flag, x, info

    def _mark(self, start: FloatArray | None) -> NDArray[np.intc]:
        """(n + m,) state of the sides to begin with; `start` are multipliers to take it from."""
        self._equal_before = self._equal.tobytes()
        self._sense[:] = 0
        if start is not None:
            self._sense[start > 0.0] = _ACTIVE_UPPER
            self._sense[start < 0.0] = _ACTIVE_LOWER
        self._sense[self._equal] = _EQUALITY
        return self._sense
