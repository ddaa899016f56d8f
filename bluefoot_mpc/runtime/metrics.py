"""Figures of a run: arrays in, numbers out.

Sampled once per command period; heights, forces and positions are the
simulator's truth in world axes unless a name says otherwise.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import LEGS, BoolArray, FloatArray

_MIN_LOAD = 0.05
"""Share of the weight under which feet carry too little for a ZMP to mean anything."""
_FIRST_LAG = -1.0 / 8.0
"""Lags come in [-1/8, 7/8): phases of both gaits are multiples of a quarter, so none is near that edge."""


def rms(values: FloatArray) -> float:
    """Root of the mean square of all entries."""
    return math.sqrt(float(np.mean(np.square(values))))


def peak(values: FloatArray) -> float:
    """Largest magnitude of all entries."""
    return float(np.abs(values).max())


def roll_pitch(quaternion: FloatArray) -> FloatArray:
    """(n, 2) rad, roll and pitch of (n, 4) quaternions ``x, y, z, w``."""
    x, y, z, w = quaternion.T
    roll = np.arctan2(2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (y * w - x * z), -1.0, 1.0))
    return np.stack([roll, pitch], axis=1)


def yaw(quaternion: FloatArray) -> FloatArray:
    """(n,) rad, continuous yaw of (n, 4) quaternions ``x, y, z, w``."""
    x, y, z, w = quaternion.T
    return np.unwrap(np.arctan2(2.0 * (x * y + z * w), 1.0 - 2.0 * (y * y + z * z)))


def tilt(quaternion: FloatArray) -> FloatArray:
    """(n,) rad, angle between the trunk's z axis and the vertical."""
    x, y, _, _ = quaternion.T
    angle: FloatArray = np.arccos(np.clip(1.0 - 2.0 * (x * x + y * y), -1.0, 1.0))
    return angle


def integrate(rate: FloatArray, time: FloatArray, start: float = 0.0) -> FloatArray:
    """(n,) integral of a rate that holds its value until the next sample, from `start`."""
    return start + np.concatenate([[0.0], np.cumsum(rate[:-1] * np.diff(time))])


def path_in_heading(position: FloatArray, heading: FloatArray) -> FloatArray:
    """(n, 2) m, distance along and to the left of a turning heading, from zero.

    Each step between samples is resolved in the heading in its middle, so a
    straight walk gives plain coordinates and a circle its arc length.

    Args:
        position: (n, 2) m.
        heading: (n,) rad.
    """
    middle = 0.5 * (heading[1:] + heading[:-1])
    c, s = np.cos(middle), np.sin(middle)
    dx, dy = np.diff(position, axis=0).T
    steps = np.stack([c * dx + s * dy, c * dy - s * dx], axis=1)
    return np.vstack([np.zeros((1, 2)), np.cumsum(steps, axis=0)])


def mass_in_motion(com: FloatArray, momentum: FloatArray, time: FloatArray) -> float | None:
    """Mass (kg) that fits momentum to the displacement of the centre of mass, None at rest.

    Args:
        com: (n, 3) m.
        momentum: (n, 3) kg·m/s, linear.
        time: (n,) s.
    """
    velocity = np.diff(com, axis=0) / np.diff(time)[:, None]
    scale = float(np.sum(velocity * velocity))
    if len(velocity) == 0 or scale < len(velocity) * 0.005**2:
        return None
    return float(np.sum(0.5 * (momentum[1:] + momentum[:-1]) * velocity)) / scale


def mass_from_load(foot_force: FloatArray, external_force: FloatArray) -> float:
    """Mass (kg) that the feet carry on average, (n, 4, 3) N, beside a push (n, 3) N."""
    return float(np.mean(foot_force[:, :, 2].sum(axis=1) + external_force[:, 2])) / GRAVITY


def zero_moment_points(
    time: FloatArray,
    com: FloatArray,
    momentum: FloatArray,
    push: FloatArray,
    ground: FloatArray,
    *,
    mass: float,
) -> FloatArray:
    """(n-1, 2) m, where the ground's reaction acts between samples; NaN in flight.

    The reaction is the rate of change of momentum less gravity and the push;
    the point is where its moment has no horizontal part.

    Args:
        time: (n,) s.
        com: (n, 3) m.
        momentum: (n, 6) linear kg·m/s, angular about the centre of mass kg·m²/s.
        push: (n, 6) N and m, force on the trunk and the point where it acts.
        ground: (n,) m, height of the ground under the feet.
        mass: kg.
    """
    rate = np.diff(momentum, axis=0) / np.diff(time)[:, None]
    com, push, ground = _between(com), _between(push), _between(ground)
    force = rate[:, :3] - push[:, :3]
    force[:, 2] += mass * GRAVITY
    moment = rate[:, 3:] - np.cross(push[:, 3:] - com, push[:, :3])
    height = com[:, 2] - ground
    load = np.where(force[:, 2] > _MIN_LOAD * mass * GRAVITY, force[:, 2], np.nan)
    x = com[:, 0] - (height * force[:, 0] + moment[:, 1]) / load
    y = com[:, 1] - (height * force[:, 1] - moment[:, 0]) / load
    return np.stack([x, y], axis=1)


def swing_apexes(height: FloatArray, swing: BoolArray) -> FloatArray:
    """Highest clearance of every completed cycle of every leg, m.

    A cycle reaches from a scheduled lift-off to the same leg's next one: the
    foot follows its schedule late, by the delay of bus and servo.

    Args:
        height: (n, 4) m, lowest point of each foot above the ground under it.
        swing: (n, 4) True where the leg is scheduled to swing.
    """
    apexes: list[float] = []
    for leg in range(swing.shape[1]):
        starts = _rises(swing[:, leg])
        apexes += [float(height[a:b, leg].max()) for a, b in itertools.pairwise(starts)]
    return np.array(apexes)


def swing_from_heights(height: FloatArray, threshold: float = 0.003) -> BoolArray:
    """(n, 4) True where a foot is in the air: above `threshold` (m) until under half of it."""
    up, down = height > threshold, height < 0.5 * threshold
    swing = np.zeros(height.shape, dtype=np.bool_)
    state = up[0]
    for k in range(len(height)):
        state = (state | up[k]) & ~down[k]
        swing[k] = state
    return swing


def lift_off_times(time: FloatArray, swing: BoolArray | FloatArray) -> list[FloatArray]:
    """Times (s) at which each leg starts to swing.

    Args:
        time: (n,) s.
        swing: (n, legs) True where a leg swings; or a signal that is positive
            there (the oscillators' y2), whose zero crossings are interpolated.
    """
    if swing.dtype == np.bool_:
        return [time[_rises(column)] for column in swing.T]
    found = []
    for column in swing.T:
        after = _rises(column > 0.0)
        low, high = column[after - 1], column[after]
        found.append(time[after - 1] + (time[after] - time[after - 1]) * -low / (high - low))
    return found


def lift_off_lags(time: FloatArray, swing: BoolArray | FloatArray) -> FloatArray:
    """(4,) mean lag of each leg's lift-off behind FL's, as a fraction of FL's cycle.

    In [-1/8, 7/8), circular mean over all cycles; NaN where a leg or FL has too few.

    Args:
        time: (n,) s.
        swing: (n, 4) as for `lift_off_times`.
    """
    return _lags(lift_off_times(time, swing))


def footfall_order(time: FloatArray, swing: BoolArray) -> tuple[str, ...]:
    """Legs in the order in which they touch down, starting with FR; empty without a full cycle.

    Args:
        time: (n,) s.
        swing: (n, 4) True where a leg swings.
    """
    lags = _lags(lift_off_times(time, ~swing))
    if not np.isfinite(lags).all():
        return ()
    from_right = _wrap_lag(lags - lags[LEGS.index("FR")])
    return tuple(LEGS[leg] for leg in np.argsort(from_right, kind="stable"))


def cycle_time(time: FloatArray, swing: BoolArray) -> float | None:
    """Median time between a leg's lift-offs, s; None without a full cycle."""
    cycles = [np.diff(starts) for starts in lift_off_times(time, swing)]
    every = np.concatenate(cycles)
    return float(np.median(every)) if len(every) else None


def _lags(starts: list[FloatArray]) -> FloatArray:
    reference = starts[0]
    if len(reference) < 2:
        return np.full(len(starts), np.nan)
    return np.array([_mean_lag(times, reference) for times in starts])


def _mean_lag(times: FloatArray, reference: FloatArray) -> float:
    inside = times[(times >= reference[0]) & (times < reference[-1])]
    if len(inside) == 0:
        return math.nan
    cycle = np.searchsorted(reference, inside, side="right") - 1
    fraction = (inside - reference[cycle]) / (reference[cycle + 1] - reference[cycle])
    angle = 2.0 * np.pi * fraction
    mean = math.atan2(float(np.sin(angle).mean()), float(np.cos(angle).mean())) / (2.0 * math.pi)
    return float(_wrap_lag(np.array(mean)))


def _wrap_lag(lag: FloatArray) -> FloatArray:
    wrapped: FloatArray = (lag - _FIRST_LAG) % 1.0 + _FIRST_LAG
    return wrapped


def _rises(signal: BoolArray) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Indices at which a signal has just become True."""
    return np.flatnonzero(~signal[:-1] & signal[1:]) + 1


def _between(values: FloatArray) -> FloatArray:
    """Means of neighbouring samples."""
    middle: FloatArray = 0.5 * (values[1:] + values[:-1])
    return middle
