"""Foot switches without chatter."""

from __future__ import annotations

import math
from typing import NamedTuple

from bluefoot_mpc.types import N_LEGS, BoolArray

ABREAST = 0.06
"""s, feet that touched within this time lift together."""


class SwitchState(NamedTuple):
    """Memory of the debouncer.

    Attributes:
        contact: (4,) debounced switches.
        since_edge: (4,) s since the last accepted edge.
        closed: (4,) switches that are closed both as measured and debounced.
    """

    contact: tuple[bool, ...]
    since_edge: tuple[float, ...]
    closed: tuple[bool, ...]


def initial_switches() -> SwitchState:
    """All feet in the air, ready for any edge."""
    return SwitchState((False,) * N_LEGS, (math.inf,) * N_LEGS, (False,) * N_LEGS)


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
    values: list[bool] = []
    times: list[float] = []
    closed: list[bool] = []
    rows = zip(contact.tolist(), valid.tolist(), state.contact, state.since_edge, strict=True)
    for touches, works, value, since in rows:
        now, time = touches and works, since + dt
        edge = now != value and time > debounce
        values.append(now if edge else value)
        times.append(0.0 if edge else time)
        closed.append(now and (edge or value))
    return SwitchState(tuple(values), tuple(times), tuple(closed))


def lifting_feet(state: SwitchState, lifting: float) -> list[bool]:
    """(4,) True for feet about to lift: while others take over, those that have stood longest.

    They bear next to nothing and drag over the ground before their switch opens:
    with servos as soft as these by a tenth of the walking speed.

    Args:
        state: switches.
        lifting: s after a foot's touch for which others are about to lift.
    """
    ages = [age if closed else -1.0 for closed, age in zip(state.contact, state.since_edge, strict=True)]
    oldest = max(ages)
    if oldest < lifting or not any(0.0 <= age < lifting for age in ages):
        return [False] * N_LEGS
    return [age > oldest - ABREAST for age in ages]
