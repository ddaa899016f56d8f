"""How measurements move the filter's state and covariance (errors as in `filter`)."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dposv

from bluefoot_mpc.estimation.filter import FEET, VELOCITY, FilterState, IndexArray
from bluefoot_mpc.estimation.inertial import quaternion_product, rotation_matrix, small_quaternion
from bluefoot_mpc.types import N_LEGS, FloatArray

_BLOCK_ROWS = FEET.reshape(N_LEGS, 3, 1)
_BLOCK_COLUMNS = FEET.reshape(N_LEGS, 1, 3)


def correct(state: FilterState, index: IndexArray, residual: FloatArray, noise: FloatArray) -> FilterState:
    """Use direct measurements of some components of the error.

    Args:
        state: before.
        index: (m,) components measured.
        residual: (m,) measured minus estimated.
        noise: (m, m) covariance of the measurement.
    """
    covariance = state.covariance
    rows = covariance[index]
    _, gain, failed = dposv(rows[:, index] + noise, rows)
    if failed:  # rounding has made the covariance indefinite: leave this measurement out
        return state
    reduced = covariance - rows.T @ gain
    return shifted(state, residual @ gain, 0.5 * (reduced + reduced.T))


def correct_scalar(state: FilterState, row: FloatArray, residual: float, variance: float) -> FilterState:
    """Use one measurement of a combination of errors.

    Args:
        state: before.
        row: (26,) weights of the combination.
        residual: estimated minus measured.
        variance: of the measurement.
    """
    spread = state.covariance @ row
    scale = 1.0 / (float(row @ spread) + variance)
    reduced = state.covariance - np.outer(scale * spread, spread)
    return shifted(state, (-residual * scale) * spread, reduced)


def shifted(state: FilterState, change: FloatArray, covariance: FloatArray) -> FilterState:
    """The state moved by a (26,) correction, with a new covariance."""
    c: list[float] = change.tolist()
    turn = small_quaternion(c[0], c[1], c[2])
    matrix = rotation_matrix(turn)
    moved = np.concatenate((np.array((state.velocity,)), state.feet)) @ matrix.T + change[3:18].reshape(5, 3)
    velocity = moved[0].tolist()
    (gx, gy, gz), (ax, ay, az), (hx, hy) = state.gyro_bias, state.accel_bias, state.hard_iron
    return FilterState(
        quaternion_product(turn, state.quaternion),
        (velocity[0], velocity[1], velocity[2]),
        moved[1:],
        (gx + c[18], gy + c[19], gz + c[20]),
        (ax + c[21], ay + c[22], az + c[23]),
        (hx + c[24], hy + c[25]),
        covariance,
    )


def plant_feet(state: FilterState, legs: list[int], feet: FloatArray, noise: FloatArray) -> FilterState:
    """Forget some feet and take them up anew where the kinematics see them.

    Args:
        state: before.
        legs: indices of the feet.
        feet: (4, 3) m, measured, relative to the IMU, world axes.
        noise: (4, 3, 3) m², its covariances.
    """
    if not legs:
        return state
    covariance = state.covariance.copy()
    points = state.feet.copy()
    for leg in legs:
        rows = slice(6 + 3 * leg, 9 + 3 * leg)
        covariance[rows, :] = 0.0
        covariance[:, rows] = 0.0
        covariance[rows, rows] = noise[leg]
        points[leg] = feet[leg]
    return state._replace(feet=points, covariance=covariance)


def forget_velocity(state: FilterState, deviation: float) -> FilterState:
    """Velocity zero with a deviation (m/s), uncorrelated with the rest."""
    covariance = state.covariance.copy()
    covariance[3:6, :] = 0.0
    covariance[:, 3:6] = 0.0
    covariance[VELOCITY, VELOCITY] = deviation**2
    return state._replace(velocity=(0.0, 0.0, 0.0), covariance=covariance)


def distances(state: FilterState, residual: FloatArray, noise: FloatArray) -> list[float]:
    """Squared Mahalanobis distance of each foot's residual.

    Args:
        state: before the correction.
        residual: (4, 3) m.
        noise: (4, 3, 3) m².
    """
    blocks: list[list[float]] = (
        (state.covariance[_BLOCK_ROWS, _BLOCK_COLUMNS] + noise).reshape(-1, 9).tolist()
    )
    rows: list[list[float]] = residual.tolist()
    return [_distance(block, row) for block, row in zip(blocks, rows, strict=True)]


def _distance(block: list[float], residual: list[float]) -> float:
    """``residual @ inverse(block) @ residual`` for a symmetric 3 x 3 block, by its Cholesky factor."""
    a, _, _, b, d, _, c, e, f = block
    x, y, z = residual
    x2 = x * x / a
    m, n = b / a, c / a
    d, e, y = d - m * b, e - n * b, y - m * x
    o = e / d
    z = z - n * x - o * y
    return x2 + y * y / d + z * z / (f - n * c - o * e)
