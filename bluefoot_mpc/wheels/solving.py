"""Solving A x = b and phi(q) = xi when the matrix is neither square nor of full rank.

The subspaces and the robust iteration are the robot's own, from
`bluefoot_mpc.model.linear` and `bluefoot_mpc.model.iterative`; here stand beside
them the steps of the second document as it writes them, and a report that says
in words what rank and residual mean.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.model.iterative import ForwardMap, IterativeConfig, IterativeResult, JacobianMap, solve
from bluefoot_mpc.model.linear import (
    RANK_TOLERANCE,
    GeneralSolution,
    Subspaces,
    column_space,
    general_solution,
    left_null_space,
    null_space,
    pseudo_inverse,
    row_space,
    subspaces,
)
from bluefoot_mpc.settings import require_nonnegative
from bluefoot_mpc.types import FloatArray

__all__ = [
    "GeneralSolution",
    "IterativeConfig",
    "IterativeResult",
    "LeastSquares",
    "Path",
    "Subspaces",
    "column_space",
    "follow",
    "general_solution",
    "least_squares",
    "left_null_space",
    "normal_equations",
    "null_space",
    "pseudo_inverse",
    "row_space",
    "solve",
    "split_domain",
    "split_range",
    "subspaces",
]

Method = Literal["normal", "shortest", "damped"]

_REACHED = 1e-9
"""Share of b that a residual may have while b still counts as reached."""


@dataclass(frozen=True, slots=True, eq=False)
class LeastSquares:
    """All x that bring A x closest to b, and what rank and residual say.

    Attributes:
        solution: (n,) x_p, the shortest of them.
        free: (n, n - r) basis of the null space: x_p + free c is as good for any c.
        residual: (m,) b - A x_p, which lies in the left null space.
        rank: r of A.
        shape: (m, n) of A.
        condition: largest over smallest singular value that counts; infinite for a zero matrix.
        reached: whether A x_p is b.
    """

    solution: FloatArray
    free: FloatArray
    residual: FloatArray
    rank: int
    shape: tuple[int, int]
    condition: float
    reached: bool

    @property
    def unique(self) -> bool:
        """Whether there is only one best x."""
        return self.rank == self.shape[1]

    def explain(self) -> str:
        """Two sentences: is there a solution, and is it the only one."""
        columns = self.shape[1]
        gap = float(np.linalg.norm(self.residual))
        exists = (
            "b lies in the column space: A x = b has a solution."
            if self.reached
            else f"b leaves the column space by {gap:.3g}: A x = b has no solution, x is the nearest."
        )
        alone = (
            "The null space is empty: x is the only one."
            if self.unique
            else f"Rank {self.rank} leaves {columns - self.rank} of {columns} free: x is the shortest."
        )
        return f"{exists} {alone}"


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """Joints that follow a path step by step.

    Attributes:
        q: (k, n) joints at each point, the start first.
        error: (k,) distance of phi(q) from the wanted point.
        rank: (k,) of the Jacobian with which each step was made; the first is that of the start.
    """

    q: FloatArray
    error: FloatArray
    rank: FloatArray


def least_squares(
    matrix: FloatArray, right_side: FloatArray, tolerance: float = RANK_TOLERANCE
) -> LeastSquares:
    """Solve A x = b in the sense of least squares, for (m, n) A of any rank and (m,) b.

    Raises:
        ConfigurationError: sizes do not fit, A is empty, or a number is not finite.
    """
    a, b = _checked(matrix, right_side)
    spaces = subspaces(a, tolerance)
    found = general_solution(a, b, tolerance)
    values = spaces.singular_values
    return LeastSquares(
        solution=found.particular,
        free=found.homogeneous,
        residual=found.residual,
        rank=found.rank,
        shape=(a.shape[0], a.shape[1]),
        condition=float(values[0] / values[-1]) if len(values) else float("inf"),
        reached=float(np.linalg.norm(found.residual)) <= _REACHED * float(np.linalg.norm(b)),
    )


def normal_equations(matrix: FloatArray, right_side: FloatArray, damping: float = 0.0) -> FloatArray:
    """(n,) x of (AᵀA + damping² I) x = Aᵀ b, as the document solves it.

    Args:
        matrix: (m, n) A.
        right_side: (m,) b.
        damping: in A's unit; above 0 there is always a solution, shorter than the exact one.

    Raises:
        ConfigurationError: AᵀA is singular and nothing damps it, sizes do not fit, or a number is not finite.
    """
    a, b = _checked(matrix, right_side)
    require_nonnegative(damping=damping)
    rank, columns = subspaces(a).rank, a.shape[1]
    if damping == 0.0 and rank < columns:
        raise ConfigurationError(
            f"AᵀA is singular: A has rank {rank}, and {columns} columns. Give damping > 0, take the shortest "
            "solution (least_squares), or say more about x (a preferred x for the null space, or more rows)"
        )
    return np.asarray(np.linalg.solve(a.T @ a + damping**2 * np.eye(columns), a.T @ b), dtype=np.float64)


def split_domain(matrix: FloatArray, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Parts of (n,) x in the row space and in the null space of (m, n) A: the first alone reaches A x."""
    spaces = subspaces(matrix)
    return spaces.row @ (spaces.row.T @ x), spaces.null @ (spaces.null.T @ x)


def split_range(matrix: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Parts of (m,) b in the column space and in the left null space of (m, n) A: no x reaches the second."""
    spaces = subspaces(matrix)
    return spaces.column @ (spaces.column.T @ b), spaces.left_null @ (spaces.left_null.T @ b)


def follow(
    forward: ForwardMap,
    jacobian: JacobianMap,
    points: FloatArray,
    start: FloatArray,
    *,
    method: Method = "shortest",
    damping: float = 0.0,
    corrected: bool = True,
) -> Path:
    """Follow a path in task coordinates with one step per point, the document's iteration.

    Args:
        forward: phi, (n,) joints to (m,) task coordinates.
        jacobian: (m, n) of phi.
        points: (k, m) xi_0 ... xi_k-1; the first is where `start` is.
        start: (n,) joints.
        method: ``normal`` solves the normal equations and fails where JᵀJ is singular; ``shortest`` takes
            the pseudo-inverse; ``damped`` needs `damping`, and slows down near singular postures.
        damping: of ``damped``, in the Jacobian's unit.
        corrected: whether a step goes from where phi(q) is, so that errors do not add up, or from the last
            wanted point as the document has it.

    Raises:
        ConfigurationError: a number is not finite, sizes do not fit, `damped` without damping, or
            ``normal`` where JᵀJ is singular.
    """
    step = _step_of(method, damping)
    targets, q = np.asarray(points, dtype=np.float64), np.array(start, dtype=np.float64)
    if targets.ndim != 2 or not np.isfinite(targets).all() or not np.isfinite(q).all():
        raise ConfigurationError("points of a path must be rows of finite numbers, and its start finite")
    joints, ranks = [q], [subspaces(jacobian(q)).rank]
    for before, target in itertools.pairwise(targets):
        matrix = jacobian(q)
        q = q + step(matrix, target - (forward(q) if corrected else before))
        joints.append(q)
        ranks.append(subspaces(matrix).rank)
    error = [float(np.linalg.norm(x - forward(q))) for x, q in zip(targets, joints, strict=True)]
    return Path(q=np.array(joints), error=np.array(error), rank=np.array(ranks))


def _step_of(method: Method, damping: float) -> Callable[[FloatArray, FloatArray], FloatArray]:
    if method not in get_args(Method):
        raise UnknownNameError("method", str(method), get_args(Method))
    if method == "damped" and not damping > 0.0:
        raise ConfigurationError(f"damping = {damping} must be positive with method 'damped'")
    if method == "shortest":
        return lambda matrix, change: pseudo_inverse(matrix) @ change
    return lambda matrix, change: normal_equations(matrix, change, damping if method == "damped" else 0.0)


def _checked(matrix: FloatArray, right_side: FloatArray) -> tuple[FloatArray, FloatArray]:
    a, b = np.asarray(matrix, dtype=np.float64), np.asarray(right_side, dtype=np.float64)
    if a.ndim != 2 or 0 in a.shape or b.shape != a.shape[:1]:
        raise ConfigurationError(
            f"A x = b: an (m, n) matrix and m numbers wanted, not {a.shape} and {b.shape}"
        )
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        raise ConfigurationError("A x = b: A or b has a number that is not finite")
    return a, b
