"""The problem: a convex quadratic cost under two-sided rows and bounds.

``min ½ xᵀ H x + gᵀ x`` subject to ``lower ≤ A x ≤ upper`` and ``floor ≤ x ≤ ceiling``.
An equality is a row whose lower and upper agree.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class QpSize:
    """Fixed size of a family of problems.

    Attributes:
        variables: n.
        rows: m, two-sided rows (equalities among them).
    """

    variables: int
    rows: int


@dataclass(kw_only=True, slots=True)
class QpProblem:
    """One problem; arrays are C-contiguous and owned by who fills them, and stay the same object.

    Attributes:
        hessian: (n, n) H, symmetric, positive definite.
        gradient: (n,) g.
        matrix: (m, n) A.
        lower: (m,) lower side of the rows, -inf where there is none.
        upper: (m,) upper side of the rows, inf where there is none.
        floor: (n,) lower bounds of x, -inf where there is none.
        ceiling: (n,) upper bounds of x, inf where there is none.
    """

    hessian: FloatArray
    gradient: FloatArray
    matrix: FloatArray
    lower: FloatArray
    upper: FloatArray
    floor: FloatArray
    ceiling: FloatArray

    @classmethod
    def empty(cls, size: QpSize) -> QpProblem:
        """A problem of this size: zero cost, nothing constrained."""
        n, m = size.variables, size.rows
        return cls(
            hessian=np.eye(n), gradient=np.zeros(n), matrix=np.zeros((m, n)),
            lower=np.full(m, -np.inf), upper=np.full(m, np.inf),
            floor=np.full(n, -np.inf), ceiling=np.full(n, np.inf),
        )  # fmt: skip

    @property
    def size(self) -> QpSize:
        """Number of variables and rows."""
        return QpSize(variables=self.matrix.shape[1], rows=self.matrix.shape[0])
