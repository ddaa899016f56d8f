"""How far an answer is from optimal: residuals of the KKT conditions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.qp.problem import QpProblem
from bluefoot_mpc.qp.solution import QpSolution
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class KktResiduals:
    """Largest residuals, in the units of the problem.

    Attributes:
        primal: violation of a row or bound.
        dual: entry of ``H x + g + Aᵀ y + z``; NaN where the solver gives no multipliers.
        complementarity: multiplier times distance to the side that it pushes from, or
            a multiplier that pushes from a side that does not exist; NaN without multipliers.
        gap: |primal - dual objective|; NaN without multipliers.
    """

    primal: float
    dual: float
    complementarity: float
    gap: float

    @property
    def worst(self) -> float:
        """Largest of all; NaN where one is."""
        return float(np.max([self.primal, self.dual, self.complementarity, self.gap]))


def residuals(problem: QpProblem, solution: QpSolution) -> KktResiduals:
    """Residuals of an answer, whatever its status.

    Args:
        problem: what was asked.
        solution: the answer; without both multipliers only the primal residual is known.
    """
    x = solution.x
    value = np.concatenate([x, problem.matrix @ x])
    low = np.concatenate([problem.floor, problem.lower])
    high = np.concatenate([problem.ceiling, problem.upper])
    primal = float(np.max(np.maximum(np.maximum(low - value, value - high), 0.0), initial=0.0))
    y, z = solution.row_multiplier, solution.bound_multiplier
    if y is None or z is None:
        return KktResiduals(primal=primal, dual=np.nan, complementarity=np.nan, gap=np.nan)
    curvature = problem.hessian @ x
    dual = float(np.max(np.abs(curvature + problem.gradient + problem.matrix.T @ y + z)))
    multiplier = np.concatenate([z, y])
    push = _pushed_sides(multiplier, low, high)
    complementarity = float(np.max(np.abs(_product(multiplier, push - value)), initial=0.0))
    # dual objective - ½ xᵀHx - Σ multiplier·side, at the same x
    gap = abs(float(curvature @ x + problem.gradient @ x + np.sum(_product(multiplier, push))))
    return KktResiduals(primal=primal, dual=dual, complementarity=complementarity, gap=gap)


def _pushed_sides(multiplier: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """(k,) side that each multiplier belongs to by its sign."""
    return np.where(multiplier >= 0.0, high, low)


def _product(multiplier: FloatArray, length: FloatArray) -> FloatArray:
    """(k,) product; at a side that does not exist the multiplier itself, which must vanish."""
    return multiplier * np.where(np.isfinite(length), length, 1.0)
