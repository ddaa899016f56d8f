"""Small vector algebra on CasADi expressions: fewer operations than the matrix products."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.types import FloatArray

_ROUNDING = 1e-14  # entries of rotations and axes below this are the file reader's rounding, not geometry


def cleaned(matrix: FloatArray) -> FloatArray:
    """A copy with rounding noise around 0 and ±1 removed, so that the expressions stay sparse."""
    result = np.array(matrix, dtype=np.float64)
    for whole in (-1.0, 0.0, 1.0):
        result[np.abs(result - whole) < _ROUNDING] = whole
    return result


def skew(vector: Any) -> Any:
    """3 x 3 matrix with ``skew(a) @ b = a x b``."""
    x, y, z = ca.vertsplit(vector)
    return ca.vertcat(ca.horzcat(0.0, -z, y), ca.horzcat(z, 0.0, -x), ca.horzcat(-y, x, 0.0))


def parallel_axis(mass: Any, offset: Any) -> Any:
    """3 x 3 inertia of a point mass at an offset: ``m (d·d 1 - d dᵀ)``."""
    x, y, z = ca.vertsplit(offset)
    xx, yy, zz = mass * x * x, mass * y * y, mass * z * z
    return symmetric((yy + zz, -mass * x * y, -mass * x * z, xx + zz, -mass * y * z, xx + yy))


def symmetric(entries: Any) -> Any:
    """Symmetric 3 x 3 matrix of its upper triangle, row by row."""
    xx, xy, xz, yy, yz, zz = entries
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def turned_inertia(rotation: Any, inertia: FloatArray) -> Any:
    """``R I Rᵀ``, each entry of the symmetric result computed once."""
    half = rotation @ ca.DM(inertia)
    rows = [rotation[i, :] for i in range(3)]
    pairs = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
    return symmetric([ca.dot(half[i, :], rows[j]) for i, j in pairs])


def symmetric_inverse(matrix: Any) -> Any:
    """Inverse of a symmetric, positive definite 3 x 3 matrix by its cofactors."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 1], matrix[1, 2], matrix[2, 2]
    cofactors = (d * f - e * e, c * e - b * f, b * e - c * d, a * f - c * c, b * c - a * e, a * d - b * b)
    scale = 1.0 / (a * cofactors[0] + b * cofactors[1] + c * cofactors[2])
    return symmetric([scale * entry for entry in cofactors])


def quaternion_matrix(quaternion: Any) -> Any:
    """3 x 3 rotation of a unit quaternion x, y, z, w."""
    x, y, z, w = ca.vertsplit(quaternion)
    return ca.vertcat(
        ca.horzcat(1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
        ca.horzcat(2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
        ca.horzcat(2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
    )
