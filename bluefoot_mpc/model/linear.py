"""The four subspaces of a matrix and least squares without full rank.

What the kinematic documents need where a Jacobian has no inverse: everything
comes from one singular value decomposition, with singular values below
`tolerance` times the largest counted as zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.types import FloatArray

RANK_TOLERANCE = 1e-9
"""Share of the largest singular value below which one counts as zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Subspaces:
    """Orthonormal bases, as columns, of the four subspaces of an (m, n) matrix of rank r.

    Attributes:
        column: (m, r) all that A x can reach.
        left_null: (m, m - r) across the column space; what A x never reaches.
        row: (n, r) across the null space.
        null: (n, n - r) all x with A x = 0.
        singular_values: (r,) those that count, falling.
    """

    column: FloatArray
    left_null: FloatArray
    row: FloatArray
    null: FloatArray
    singular_values: FloatArray

    @property
    def rank(self) -> int:
        """Number of independent columns, and of rows."""
        return len(self.singular_values)


@dataclass(frozen=True, slots=True, eq=False)
class GeneralSolution:
    """All least-squares solutions of A x = b: x_p + X_h c for any c.

    Attributes:
        particular: (n,) x_p, the shortest one.
        homogeneous: (n, n - r) X_h, orthonormal basis of the null space, across x_p.
        residual: (m,) b - A x_p, the part of b in the left null space.
        rank: r of A.
    """

    particular: FloatArray
    homogeneous: FloatArray
    residual: FloatArray
    rank: int

    def at(self, coefficients: FloatArray) -> FloatArray:
        """(n,) the solution with (n - r,) coefficients c."""
        return self.particular + self.homogeneous @ coefficients

    def nearest_to(self, wanted: FloatArray) -> FloatArray:
        """(n,) the solution closest to `wanted` (n,)."""
        return self.at(self.homogeneous.T @ wanted)


def subspaces(matrix: FloatArray, tolerance: float = RANK_TOLERANCE) -> Subspaces:
    """Split domain and range of an (m, n) matrix into its four subspaces."""
    u, values, vt = np.linalg.svd(matrix)
    rank = _rank(values, tolerance)
    return Subspaces(
        column=u[:, :rank], left_null=u[:, rank:], row=vt[:rank].T, null=vt[rank:].T,
        singular_values=values[:rank],
    )  # fmt: skip


def column_space(matrix: FloatArray, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """(m, r) orthonormal basis of all A x of an (m, n) matrix."""
    return subspaces(matrix, tolerance).column


def row_space(matrix: FloatArray, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """(n, r) orthonormal basis across the null space of an (m, n) matrix."""
    return subspaces(matrix, tolerance).row


def null_space(matrix: FloatArray, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """(n, n - r) orthonormal basis of all x with A x = 0 of an (m, n) matrix."""
    return subspaces(matrix, tolerance).null


def left_null_space(matrix: FloatArray, tolerance: float = RANK_TOLERANCE) -> FloatArray:
    """(m, m - r) orthonormal basis of all w with wᵀ A = 0 of an (m, n) matrix."""
    return subspaces(matrix, tolerance).left_null


def pseudo_inverse(matrix: FloatArray, tolerance: float = RANK_TOLERANCE, damping: float = 0.0) -> FloatArray:
    """(n, m) pseudo-inverse of an (m, n) matrix of any rank.

    Args:
        matrix: (m, n).
        tolerance: share of the largest singular value that counts as zero.
        damping: lambda in sigma / (sigma² + lambda²), in the matrix's unit; 0
            is Moore and Penrose's inverse, above 0 the bounded one of damped
            least squares.
    """
    u, values, vt = np.linalg.svd(matrix, full_matrices=False)
    rank = _rank(values, tolerance)
    kept = values[:rank]
    return np.asarray((vt[:rank].T * (kept / (kept * kept + damping * damping))) @ u[:, :rank].T)


def general_solution(
    matrix: FloatArray, right_side: FloatArray, tolerance: float = RANK_TOLERANCE
) -> GeneralSolution:
    """All x that bring A x closest to b, for an (m, n) matrix A of any rank and (m,) b."""
    spaces = subspaces(matrix, tolerance)
    particular = spaces.row @ ((spaces.column.T @ right_side) / spaces.singular_values)
    return GeneralSolution(
        particular=particular,
        homogeneous=spaces.null,
        residual=spaces.left_null @ (spaces.left_null.T @ right_side),
        rank=spaces.rank,
    )


def _rank(values: FloatArray, tolerance: float) -> int:
    """Number of singular values (falling) that count."""
    if len(values) == 0 or values[0] == 0.0:
        return 0
    return int(np.count_nonzero(values > tolerance * values[0]))
