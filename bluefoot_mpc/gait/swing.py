"""Swing profiles: how a foot moves over the ground and above it.

The paper's law pulls a damped point mass to the foothold and lifts the foot by
the oscillator's y2. Beside it stand polynomials in the swing's progress with
zero velocity at both ends. Planar vectors are complex numbers, x + iy.
"""

from __future__ import annotations

import functools
import math


def smooth_step(s: float) -> float:
    """Quintic from 0 to 1 with zero velocity and acceleration at both ends."""
    return s * s * s * (10.0 - s * (15.0 - 6.0 * s))


def smooth_slope(s: float) -> float:
    """First derivative of `smooth_step`."""
    return 30.0 * (s * (1.0 - s)) ** 2


def smooth_bend(s: float) -> float:
    """Second derivative of `smooth_step`."""
    return 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s)


def lift_motion(s: float, apex: float) -> tuple[float, float, float]:
    """`lift_profile` with its first and second derivative."""
    if s <= 0.0 or s >= 1.0:
        return 0.0, 0.0, 0.0
    if s < apex:
        u = s / apex
        return smooth_step(u), smooth_slope(u) / apex, smooth_bend(u) / (apex * apex)
    left = 1.0 - apex
    u = (1.0 - s) / left
    return smooth_step(u), -smooth_slope(u) / left, smooth_bend(u) / (left * left)


def lift_profile(s: float, apex: float) -> float:
    """Height over step height: up by one quintic until `apex`, down by another.

    Args:
        s: progress of the swing in [0, 1].
        apex: progress at which the foot is highest, in (0, 1).
    """
    if s <= 0.0 or s >= 1.0:
        return 0.0
    if s < apex:
        return smooth_step(s / apex)
    return smooth_step((1.0 - s) / (1.0 - apex))


def matched_step(start: complex, goal: complex, drift: complex, s: float) -> complex:
    """Minimum-jerk path in a moving frame.

    Args:
        start: foot at lift-off, m.
        goal: foot at touchdown, m.
        drift: velocity of the frame at the foot times the swing time, m; the
            foot leaves and arrives with minus this velocity (at rest on the
            ground); zero makes it leave and arrive at rest in the frame.
        s: progress in [0, 1].
    """
    smooth = smooth_step(s)
    return start + (goal - start) * smooth + drift * (smooth - s)


@functools.lru_cache(maxsize=16)  # one rate serves all feet for many steps
def spring_transition(rate: float, damping_ratio: float, dt: float) -> tuple[float, float, float, float]:
    """Exact transition matrix of ``m e'' = -k e - b e'`` over `dt`, row-major.

    Args:
        rate: sqrt(k/m), 1/s.
        damping_ratio: b / (2 sqrt(k m)), >= 1 (over-damped).
        dt: s.

    Returns:
        Four numbers that map (e, e') to (e, e') after `dt`.
    """
    decay = damping_ratio * rate
    split = rate * math.sqrt(max(0.0, damping_ratio * damping_ratio - 1.0))
    envelope = math.exp(-decay * dt)
    even = math.cosh(split * dt)
    odd = math.sinh(split * dt) / split if split * dt > 1e-6 else dt
    return (
        envelope * (even + decay * odd),
        envelope * odd,
        -envelope * rate * rate * odd,
        envelope * (even - decay * odd),
    )
