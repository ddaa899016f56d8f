"""Feet: a swing foot follows its path, a standing one does not move."""

from __future__ import annotations

from typing import Any

import casadi as ca

from bluefoot_mpc.wbc.constraints.contact import standing_target
from bluefoot_mpc.wbc.constraints.dynamics import ReducedDynamics
from bluefoot_mpc.wbc.rows import Task
from bluefoot_mpc.wbc.tasks.feedback import wanted_acceleration


def foot_task(dynamics: ReducedDynamics, index: int, given: Any) -> Task:
    """Acceleration of one foot, weighted as a contact or as a swing foot.

    Args:
        dynamics: what the unknowns do.
        index: of the foot.
        given: parameters: ``q``, ``contact`` (1 stands, 0 swings), ``foot``, ``foot_velocity``,
            ``foot_acceleration`` (world, SI units, three values per foot), gains and weights.
    """
    place = slice(3 * index, 3 * index + 3)
    foot, stands = dynamics.feet[index], given.contact[index]
    error = given.foot[place] - (given.q[:3] + foot.position)
    rate = given.foot_velocity[place] - foot.velocity
    swinging = wanted_acceleration(given.foot_acceleration[place], error, rate, given.swing_gain)
    standing = standing_target(foot, given.contact_gain)
    target = swinging + stands * (standing - swinging)
    weight = given.swing_weight + stands * (given.contact_weight - given.swing_weight)
    return Task(rows=dynamics.foot(index), target=target, weight=ca.vertcat(weight, weight, weight))
