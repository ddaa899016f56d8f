"""Centre of mass: its acceleration follows a planned motion (the preview's), world axes."""

from __future__ import annotations

from typing import Any

import casadi as ca

from bluefoot_mpc.wbc.constraints.dynamics import ReducedDynamics
from bluefoot_mpc.wbc.rows import Task
from bluefoot_mpc.wbc.tasks.feedback import wanted_acceleration


def com_task(dynamics: ReducedDynamics, given: Any) -> Task:
    """The task; only the forces move the centre of mass, so its rows are constant.

    Args:
        dynamics: what the unknowns do.
        given: parameters: base position ``q[:3]`` (m), ``com``, ``com_velocity``,
            ``com_acceleration`` in SI units, ``com_gain`` and ``com_weight``.
    """
    tree = dynamics.tree
    error = given.com - com_position(dynamics, given)
    rate = given.com_velocity - tree.com_velocity
    target = wanted_acceleration(given.com_acceleration, error, rate, given.com_gain)
    return Task(rows=dynamics.com, target=target, weight=given.com_weight)


def com_position(dynamics: ReducedDynamics, given: Any) -> Any:
    """3, m, centre of mass in the world."""
    return ca.SX(given.q[:3]) + dynamics.tree.com
