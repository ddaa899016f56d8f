"""The ground pushes and never pulls, and takes its load gradually when contacts change."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

_LEAST = 1e-3  # share of a foot's cap that stays: the weight is shared in proportion to the caps
_SPARE = 1.5  # of the weight, what the caps together must allow


def force_caps(given: SimpleNamespace, weight: float) -> tuple[Any, Any]:
    """Largest normal force per foot: grows after touch-down, fades before the scheduled lift-off.

    Where the ramps together would not carry the robot (two pairs of feet that
    change at once), all of them are raised in proportion.

    Args:
        given: parameters: ``contact`` (1 stands), ``loaded`` (share of the load at the last
            tick), ``remaining`` (s until lift-off), ``dt`` (s), ``ramp`` (s, from nothing to
            full) and ``force_limit`` (N, of a foot under full load).
        weight: N, of the robot.

    Returns:
        k caps in N, 0 without contact; k new shares of the load.
    """
    loaded = ca.fmin(given.loaded + given.dt / given.ramp, 1.0) * given.contact
    leaving = ca.fmax(given.remaining / given.ramp, 0.0)
    share = ca.fmax(ca.fmin(loaded, leaving), _LEAST) * given.contact
    total = given.force_limit * ca.sum1(share)
    # Without a foot there is nothing to raise, and nothing to divide by.
    raised = ca.fmax(1.0, _SPARE * weight / ca.fmax(total, 1e-3 * weight * _LEAST))
    return raised * given.force_limit * share, loaded
