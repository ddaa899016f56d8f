"""Linear expressions in the problem's unknowns: what tasks and constraints are made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Rows:
    """``matrix @ x + constant``, a quantity that is affine in the unknowns x.

    x holds the joint accelerations (rad/s²), then three force components per foot
    along the axes of the ground, in the problem's unit of force.

    Attributes:
        matrix: r x n expressions.
        constant: r expressions.
    """

    matrix: Any
    constant: Any


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Task:
    """Something wanted: ``weight * (rows - target)²`` enters the cost.

    Attributes:
        rows: the quantity, an acceleration.
        target: r, what it should be.
        weight: r, per squared unit of the quantity.
    """

    rows: Rows
    target: Any
    weight: Any

    def weighted(self) -> tuple[Any, Any]:
        """Matrix and right side of the least squares ``|matrix @ x - side|²``."""
        root = ca.sqrt(self.weight)
        matrix = ca.SX(self.rows.matrix)
        scaled = ca.vertcat(*[root[i] * matrix[i, :] for i in range(matrix.size1())])
        return scaled, root * (self.target - self.rows.constant)
