"""Foot switches without chatter."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.types import N_LEGS, BoolArray, FloatArray


class SwitchState(NamedTuple):
    """Memory of the debouncer.

    Attributes:
        contact: (4,) debounced switches.
        since_edge: (4,) s since the last accepted edge.
    """

    contact: BoolArray
    since_edge: FloatArray


def initial_switches() -> SwitchState:
    """All feet in the air, ready for any edge."""
    return SwitchState(np.zeros(N_LEGS, dtype=bool), np.full(N_LEGS, math.inf))


def advance_switches(
    state: SwitchState, contact: BoolArray, valid: BoolArray, dt: float, debounce: float
) -> SwitchState:
    """Accept an edge at once, and refuse the next one for the time of a chatter.

    So debouncing costs no delay. A switch known to be broken counts as open.

    Args:
        state: memory.
        contact: (4,) raw switches.
        valid: (4,) False where a switch is broken.
        dt: s since the previous call.
        debounce: s during which an edge back is refused.
    """
    since = state.since_edge + dt
    edge = ((contact & valid) != state.contact) & (since > debounce)
    return SwitchState(state.contact ^ edge, np.where(edge, 0.0, since))
