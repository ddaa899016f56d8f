"""Yaw relative to the starting heading from the magnetometer.

The reference is the mean field, turned into the world, of the first samples. It
contains the hard iron as it lay at the start, so a measured heading is wrong by
the difference of the hard iron between now and then: two states of the filter.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import HeadingConfig
from bluefoot_mpc.estimation.corrections import Settler, correct_scalar
from bluefoot_mpc.estimation.filter import SIZE, FilterState
from bluefoot_mpc.estimation.inertial import rotated
from bluefoot_mpc.types import FloatArray, ImuBatch

YAW = 2
HARD_IRON_X, HARD_IRON_Y = 24, 25


class HeadingReference(NamedTuple):
    """Field at the start.

    Attributes:
        x: of the field, sum, then mean, of its horizontal part in the world.
        y: the same.
        samples: how many were taken.
        wait: s until the next sample is used; more often would cost time for nothing.
    """

    x: float = 0.0
    y: float = 0.0
    samples: int = 0
    wait: float = 0.0


def newest_field(samples: FloatArray, valid: list[bool]) -> tuple[float, float, float] | None:
    """The last complete, valid row of (n, 3) magnetometer samples."""
    rows: list[list[float]] = samples.tolist()
    for row, good in zip(reversed(rows), reversed(valid), strict=True):
        if good and math.isfinite(row[0] + row[1] + row[2]):
            return (row[0], row[1], row[2])
    return None


def advance_heading(
    state: FilterState, reference: HeadingReference, batch: ImuBatch, *, dt: float, config: HeadingConfig,
    settler: Settler,
) -> tuple[FilterState, HeadingReference]:  # fmt: skip
    """Take the newest magnetometer sample, for the reference first, then for the yaw.

    Args:
        state: filter.
        reference: field at the start, as far as it is known.
        batch: samples of this frame, base frame.
        dt: s since the previous frame.
        config: noise and gates.
        settler: workspace for the correction.
    """
    x, y, samples, wait = reference
    reference = HeadingReference(x, y, samples, wait - dt)
    known = samples >= config.reference_samples
    if known and reference.wait > 0.0:
        return state, reference
    field = newest_field(batch.magnetometer, batch.valid.tolist())
    if field is None:
        return state, reference
    x, y, _ = rotated(state.quaternion, *field)
    if not known:
        n = reference.samples
        return state, HeadingReference(
            (n * reference.x + x) / (n + 1), (n * reference.y + y) / (n + 1), n + 1
        )
    return _correct_yaw(state, reference, (x, y), config, settler), reference._replace(wait=config.interval)


def _correct_yaw(
    state: FilterState, reference: HeadingReference, field: tuple[float, float], config: HeadingConfig,
    settler: Settler,
) -> FilterState:  # fmt: skip
    """Use a horizontal field (x, y) in the world, unless its strength is not the reference's."""
    x, y = field
    strength = math.hypot(reference.x, reference.y)
    change = abs(math.hypot(x, y) - strength)
    if strength < config.min_horizontal or change > config.gate * strength + 2.0 * config.hard_iron:
        return state
    ux, uy = reference.x / strength, reference.y / strength
    residual = math.atan2(ux * y - uy * x, ux * x + uy * y)
    row, iron = heading_row(state, (ux, uy), strength)
    variance = (config.noise / strength) ** 2
    return correct_scalar(state, row, residual - iron, variance, settler)


def heading_row(
    state: FilterState, direction: tuple[float, float], strength: float
) -> tuple[FloatArray, float]:
    """How the heading's residual depends on the error, and the hard iron's share of it.

    Args:
        state: filter.
        direction: unit vector of the reference field in the world's horizontal plane.
        strength: of the reference field.

    Returns:
        (26,) derivative of (residual - share) by the error, and the share, rad.
    """
    qx, qy, qz, qw = state.quaternion
    yaw = math.atan2(2.0 * (qx * qy + qz * qw), 1.0 - 2.0 * (qy * qy + qz * qz))
    c, s = math.cos(yaw), math.sin(yaw)
    ux, uy = direction
    # Sideways part of (Rz(yaw) - 1) h, along t = (-uy, ux), over the strength, and its slope by the yaw.
    wx, wy = (-uy * (c - 1.0) + ux * s) / strength, (uy * s + ux * (c - 1.0)) / strength
    hx, hy = state.hard_iron
    slope = ((uy * s + ux * c) * hx + (uy * c - ux * s) * hy) / strength
    row = np.zeros(SIZE)
    row[YAW] = 1.0 - slope
    row[HARD_IRON_X], row[HARD_IRON_Y] = -wx, -wy
    return row, wx * hx + wy * hy
