"""Angular momentum about the centre of mass: damped, so that swinging legs do not spin the trunk."""

from __future__ import annotations

from typing import Any

from bluefoot_mpc.wbc.constraints.dynamics import ReducedDynamics
from bluefoot_mpc.wbc.rows import Rows, Task


def momentum_task(dynamics: ReducedDynamics, inertia: float, given: Any) -> Task:
    """Rate of the angular momentum over a nominal inertia, rad/s²; only the forces change it.

    Args:
        dynamics: what the unknowns do.
        inertia: kg·m², makes the task's unit that of the trunk's.
        given: parameters ``momentum_gain`` and ``momentum_weight``.
    """
    rows, scale = dynamics.momentum, 1.0 / inertia
    target = -given.momentum_gain * scale * dynamics.tree.momentum
    return Task(
        rows=Rows(matrix=scale * rows.matrix, constant=scale * rows.constant),
        target=target, weight=given.momentum_weight,
    )  # fmt: skip
