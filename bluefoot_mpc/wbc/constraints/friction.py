"""Friction pyramids: the force of a standing foot stays inside four planes through the contact.

The pyramid lies inside the friction cone when its half-angle takes μ/√2; as is
usual for gaits, μ itself bounds each tangent here, and the configured coefficient
is chosen below the floor's.
"""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.types import FloatArray

SIDES = 4


def friction_rows(joints: int, feet: int, friction: float) -> FloatArray:
    """(4 feet, joints + 3 feet) matrix of ``|f_t| - μ f_n <= 0`` for both tangents of each foot.

    Args:
        joints: number of joint accelerations before the forces.
        feet: number of standing feet; their forces are (tangent, tangent, normal).
        friction: μ.
    """
    pyramid = np.array([[1, 0, -friction], [-1, 0, -friction], [0, 1, -friction], [0, -1, -friction]])
    matrix = np.zeros((SIDES * feet, joints + 3 * feet))
    for foot in range(feet):
        column = joints + 3 * foot
        matrix[SIDES * foot : SIDES * (foot + 1), column : column + 3] = pyramid
    return matrix


def onto_pyramid(force: FloatArray, friction: float, cap: FloatArray) -> FloatArray:
    """(k, 3) forces (two tangents, normal; N) moved into caps and pyramid: normal first, then tangents."""
    inside = np.array(force)
    inside[:, 2] = np.clip(force[:, 2], 0.0, cap)
    reach = friction * inside[:, 2:]
    inside[:, :2] = np.clip(force[:, :2], -reach, reach)
    return inside
