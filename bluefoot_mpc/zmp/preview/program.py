"""The preview's quadratic program, solved on the few constraints that matter.

In coordinates in which the cost is |w|² a plan is its unconstrained optimum
plus the shortest w that meets the rows. Only rows near the plan can be active:
the smallest residuals are put into a problem of fixed size, the plan that comes
out is checked against all rows, and the problem is posed again with the rows
that it broke. As rows that are met stay in, the cost grows with every round, and
the last plan is the optimum of the whole problem. Each row has a slack with
a quadratic price, so that there always is a plan.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.qp.solution import QpSolution, QpStatus
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.zmp.preview.config import PreviewConfig
from bluefoot_mpc.zmp.preview.model import PreviewMaps

_UNIT = 1e-3
"""m, length that is one in the problem: solvers have absolute tolerances."""
_GRADIENT_STEPS = 200


class Solver(Protocol):
    """What is asked of a backend."""

    def solve(self, problem: QpProblem) -> QpSolution:
        """Solve one problem."""

    def reset(self) -> None:
        """Forget earlier problems."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Rows:
    """Constraints ``normal · value <= offset`` on planar points of a plan, four to a point.

    Points are the ZMP (n) and the centre of mass (n) at the samples, and the
    capture point at the end: 2n + 1 in all.

    Attributes:
        normals: (2n + 1, 4, 2) unit vectors.
        offsets: (2n + 1, 4) m.
    """

    normals: FloatArray
    offsets: FloatArray

    def residuals(self, values: FloatArray) -> FloatArray:
        """(8n + 4,) m, how far (2n + 1, 2) points lie inside the rows."""
        inside = self.offsets - self.normals[:, :, 0] * values[:, :1]
        inside -= self.normals[:, :, 1] * values[:, 1:]
        return inside.reshape(-1)


@dataclass(frozen=True, kw_only=True, slots=True)
class ProgramResult:
    """How a program ended.

    Attributes:
        shift: (n, 2) w of both axes, added to the unconstrained optimum; the
            last iterate when `solved` is False.
        solved: True when it is the optimum.
        iterations: of the solver, all rounds together.
    """

    shift: FloatArray
    solved: bool
    iterations: int


class PreviewProgram:
    """Workspace of the program; only the solvers keep memory between plans.

    Args:
        config: sizes, weights and tolerances.
        maps: the problem of one axis.
        small: solver for problems of `small_size`.
        whole: solver for problems of `whole_size`, asked when rounds or rows do not suffice.
    """

    def __init__(self, config: PreviewConfig, maps: PreviewMaps, small: Solver, whole: Solver) -> None:
        n = config.samples
        self._config, self._samples = config, n
        self._position, self._velocity, self._acceleration = (maps.forced @ maps.root).reshape(3, n, n)
        self._levers = np.full(n, np.nan)
        self.responses = np.zeros((2 * n + 1, n))
        """Points per w: ZMP, centre of mass, capture point at the end."""
        self.responses[n : 2 * n] = self._position
        weights = config.weights
        prices = np.repeat([weights.support_slack, weights.reach_slack, weights.capture_slack], [n, n, 1])
        self.softness = np.repeat(prices**-0.5, 4)
        """Slack of each row per unit of its own coordinate."""
        self._stages = tuple(
            _Stage(solver, size) for solver, size in zip((small, whole), sizes(config), strict=True)
        )

    def reset(self) -> None:
        """Forget earlier problems."""
        for stage in self._stages:
            stage.solver.reset()

    def set_levers(self, levers: FloatArray) -> None:
        """Take the (n,) distances of the ZMP per acceleration, s²."""
        if not np.array_equal(levers, self._levers):
            n = self._samples
            self._levers[:] = levers
            np.multiply(levers[:, None], self._acceleration, out=self.responses[:n])
            np.subtract(self._position, self.responses[:n], out=self.responses[:n])
            self.responses[2 * n] = self._position[-1] + np.sqrt(levers[-1]) * self._velocity[-1]

    def solve(self, rows: Rows, free: FloatArray) -> ProgramResult:
        """Find the shortest change of the unconstrained optimum that meets the rows.

        Args:
            rows: the constraints.
            free: (8n + 4,) m, residuals of the unconstrained optimum.
        """
        config, iterations = self._config, 0
        shift = np.zeros((self._samples, 2))
        near = free
        for stage, rounds in zip(self._stages, (config.rounds, 1), strict=True):
            for _ in range(rounds):
                chosen = stage.choose(near)
                if chosen is None:
                    break
                solution = stage.solve(self, rows, free, chosen)
                iterations += solution.iterations
                if not solution.ok:
                    break
                shift = solution.x[: shift.size].reshape(2, -1).T * _UNIT
                near = free - _moved(rows, self.responses @ shift)
                outside = near < -config.tolerance
                outside[chosen] = False
                if not outside.any():
                    return ProgramResult(shift=shift, solved=True, iterations=iterations)
        return ProgramResult(shift=shift, solved=False, iterations=iterations)

    def approximate(self, rows: Rows, free: FloatArray) -> ProgramResult:
        """A plan near the optimum without any solver: projected gradients on the rows' multipliers.

        It counts as solved when no row is violated by more than is configured.

        Args:
            rows: the constraints.
            free: (8n + 4,) m, residuals of the unconstrained optimum.
        """
        chosen = np.argsort(free)[: 4 * self._config.rows]
        responses, normals = self.responses[chosen >> 2], rows.normals.reshape(-1, 2)[chosen]
        matrix = np.hstack([responses * normals[:, :1], responses * normals[:, 1:]])
        gram = matrix @ matrix.T + np.diag(self.softness[chosen] ** 2)
        step = 1.0 / float(np.abs(gram).sum(axis=1).max())
        multiplier, point, momentum = np.zeros(len(chosen)), np.zeros(len(chosen)), 1.0
        for _ in range(_GRADIENT_STEPS):
            following = np.maximum(point - step * (gram @ point + free[chosen]), 0.0)
            faster = 0.5 * (1.0 + math.sqrt(1.0 + 4.0 * momentum * momentum))
            point = following + (momentum - 1.0) / faster * (following - multiplier)
            multiplier, momentum = following, faster
        shift = -(multiplier @ matrix).reshape(2, -1).T
        near = free - _moved(rows, self.responses @ shift)
        return ProgramResult(
            shift=shift, solved=bool(near.min() > -self._config.nearest_violation), iterations=_GRADIENT_STEPS
        )


def sizes(config: PreviewConfig) -> tuple[QpSize, QpSize]:
    """Sizes of the small and of the whole problem."""
    whole = 8 * config.samples + 4
    return tuple(  # type: ignore[return-value]
        QpSize(variables=2 * config.samples + rows, rows=rows) for rows in (min(config.rows, whole), whole)
    )


class _Stage:
    """One solver and its problem."""

    def __init__(self, solver: Solver, size: QpSize) -> None:
        self.solver, self._count = solver, size.rows
        self._problem = QpProblem.empty(size)
        n = size.variables - size.rows
        self._x, self._y = self._problem.matrix[:, : n // 2], self._problem.matrix[:, n // 2 : n]
        self._slack = self._problem.matrix.reshape(-1)[n :: size.variables + 1]

    def choose(self, near: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.int64]] | None:
        """Rows with the smallest residuals; None when more are met than fit."""
        if self._count >= len(near):
            return np.arange(len(near))
        chosen = np.argpartition(near, self._count)
        if near[chosen[self._count]] <= 0.0:
            return None
        return chosen[: self._count]

    def solve(
        self,
        program: PreviewProgram,
        rows: Rows,
        free: FloatArray,
        chosen: np.ndarray[tuple[int], np.dtype[np.int64]],
    ) -> QpSolution:
        """Solve on the chosen rows."""
        problem = self._problem
        responses = program.responses[chosen >> 2]
        normals = rows.normals.reshape(-1, 2)[chosen]
        np.multiply(responses, normals[:, :1], out=self._x)
        np.multiply(responses, normals[:, 1:], out=self._y)
        np.negative(program.softness[chosen], out=self._slack)
        np.divide(free[chosen], _UNIT, out=problem.upper)
        solution = self.solver.solve(problem)
        if solution.status is QpStatus.SOLVED and not np.isfinite(solution.x).all():
            return QpSolution(x=solution.x, status=QpStatus.FAILED, iterations=solution.iterations)
        return solution


def _moved(rows: Rows, values: FloatArray) -> FloatArray:
    """(8n + 4,) m, how far points move outward along the rows."""
    moved = rows.normals[:, :, 0] * values[:, :1]
    moved += rows.normals[:, :, 1] * values[:, 1:]
    return moved.reshape(-1)
