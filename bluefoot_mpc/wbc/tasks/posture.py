"""Posture: joint accelerations towards reference angles; settles the ankles, which no other task fixes."""

from __future__ import annotations

from typing import Any

from bluefoot_mpc.wbc.tasks.feedback import wanted_acceleration


def posture_target(given: Any) -> Any:
    """nj, rad/s², wanted joint accelerations; the unknowns themselves, so the task's Jacobian is one.

    Args:
        given: parameters: ``q``, ``v``, ``posture`` (rad), ``posture_velocity``,
            ``posture_acceleration``, ``posture_gain``.
    """
    error = given.posture - given.q[7:]
    rate = given.posture_velocity - given.v[6:]
    return wanted_acceleration(given.posture_acceleration, error, rate, given.posture_gain)
