"""How measurements move the filter's state and covariance (errors as in `filter`)."""

from __future__ import annotations

import functools
import itertools
from typing import Any

import casadi as ca
import numpy as np
from scipy.linalg.lapack import dposv

from bluefoot_mpc.estimation import symbols
from bluefoot_mpc.estimation.filter import SIZE, VALUES, VELOCITY, FilterState, IndexArray
from bluefoot_mpc.estimation.workspace import Workspace, compile_function
from bluefoot_mpc.types import N_LEGS, FloatArray

_FOOT_ROWS = tuple(slice(6 + 3 * leg, 9 + 3 * leg) for leg in range(N_LEGS))
_FOOT_BLOCKS = tuple((slice(3 * leg, 3 * leg + 3),) * 2 for leg in range(N_LEGS))


def correct(
    state: FilterState, index: IndexArray, residual: FloatArray, noise: FloatArray,
    settler: Settler | None = None,
) -> FilterState:  # fmt: skip
    """Use direct measurements of some components of the error.

    Args:
        state: before.
        index: (m,) components measured.
        residual: (m,) measured minus estimated.
        noise: (m, m) covariance of the measurement.
        settler: workspace; making one takes much longer than using it.
    """
    covariance = state.covariance
    rows = covariance[index]
    _, gain, failed = dposv(rows[:, index] + noise, rows)
    if failed:  # rounding has made the covariance indefinite: leave this measurement out
        return state
    return shifted(state, residual @ gain, _symmetric(covariance - rows.T @ gain), settler)


def _symmetric(matrix: FloatArray) -> FloatArray:
    both = matrix + matrix.T
    both *= 0.5
    return both


def correct_scalar(
    state: FilterState, row: FloatArray, residual: float, variance: float, settler: Settler | None = None
) -> FilterState:
    """Use one measurement of a combination of errors.

    Args:
        state: before.
        row: (26,) weights of the combination.
        residual: estimated minus measured.
        variance: of the measurement.
        settler: workspace, as for `correct`.
    """
    spread = state.covariance @ row
    scale = 1.0 / (float(row @ spread) + variance)
    reduced = state.covariance - (scale * spread)[:, None] * spread
    return shifted(state, (-residual * scale) * spread, reduced, settler)


class Settler:
    """Workspace that corrects estimates; holds no memory of them."""

    def __init__(self) -> None:
        self._work = Workspace(_settling())
        self.no_points = np.zeros(3 * N_LEGS)

    def settle(
        self, estimate: FloatArray, change: FloatArray | float, points: FloatArray, others: list[int]
    ) -> FloatArray:
        """The estimate moved by a correction, with some feet taken up anew.

        Args:
            estimate: (27,) before.
            change: (26,) correction, or 0.
            points: (12,) m, feet by the joints, relative to the IMU, base frame.
            others: feet that are placed there.

        Returns:
            (27,) after.
        """
        before, moved, seen, anew = self._work.inputs
        before[:] = estimate
        moved[:] = change
        seen[:] = points
        anew[:] = 0.0
        for leg in others:
            anew[leg] = 1.0
        self._work.call()
        return self._work.outputs[0].copy()


def shifted(
    state: FilterState, change: FloatArray, covariance: FloatArray, settler: Settler | None = None
) -> FilterState:
    """The state moved by a (26,) correction, with a new covariance; `settler` as for `correct`."""
    settler = settler or Settler()
    return FilterState(settler.settle(state.estimate, change, settler.no_points, []), covariance)


@functools.lru_cache(maxsize=1)
def _settling() -> Any:
    """Correction of an estimate (immutable, so it may be shared)."""
    before, change = ca.SX.sym("before", VALUES), ca.SX.sym("change", SIZE)
    points, anew = ca.SX.sym("points", 3 * N_LEGS), ca.SX.sym("anew", N_LEGS)
    turn = symbols.small_quaternion(change[0:3])
    quaternion = symbols.quaternion_product(turn, before[0:4])
    matrix, rotation = symbols.rotation_matrix(turn), symbols.rotation_matrix(quaternion)
    feet = []
    for leg in range(N_LEGS):
        k = 3 * leg
        kept = matrix @ before[7 + k : 10 + k] + change[6 + k : 9 + k]
        feet.append(ca.if_else(anew[leg], rotation @ points[k : k + 3], kept))
    after = ca.vertcat(quaternion, matrix @ before[4:7] + change[3:6], *feet, before[19:] + change[18:])
    return compile_function(
        "settling", {"before": before, "change": change, "points": points, "anew": anew}, {"after": after}
    )


def plant_feet(covariance: FloatArray, legs: list[int], noise: FloatArray) -> None:
    """Forget, in place, what a covariance says of some feet that are taken up anew.

    Args:
        covariance: (26, 26), changed.
        legs: indices of the feet.
        noise: (12, 12) m², covariance of all feet as measured, world axes.
    """
    for leg in legs:
        rows, block = _FOOT_ROWS[leg], _FOOT_BLOCKS[leg]
        covariance[rows] = 0.0
        covariance[:, rows] = 0.0
        covariance[rows, rows] = noise[block]


def forget_velocity(state: FilterState, deviation: float) -> FilterState:
    """Velocity zero with a deviation (m/s), uncorrelated with the rest."""
    estimate, covariance = state.estimate.copy(), state.covariance.copy()
    estimate[4:7] = 0.0
    covariance[3:6, :] = 0.0
    covariance[:, 3:6] = 0.0
    covariance[VELOCITY, VELOCITY] = deviation**2
    return FilterState(estimate, covariance)


@functools.lru_cache(maxsize=1)
def _distances() -> Any:
    spread, residual = ca.SX.sym("spread", 3 * N_LEGS, 3 * N_LEGS), ca.SX.sym("residual", 3 * N_LEGS)
    values = []
    for leg in range(N_LEGS):
        part = slice(3 * leg, 3 * leg + 3)
        values.append(_distance(spread[part, part], residual[part]))
    return compile_function(
        "distances", {"spread": spread, "residual": residual}, {"distances": ca.vertcat(*values)}
    )


def _distance(block: Any, residual: Any) -> Any:
    """``residual' inverse(block) residual`` for a symmetric 3 x 3 block, by its Cholesky factor."""
    a, b, c, d, e, f = (block[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
    x, y, z = ca.vertsplit(residual)
    m, n = b / a, c / a
    d, e, y_left = d - m * b, e - n * b, y - m * x
    o = e / d
    z_left = z - n * x - o * y_left
    return x * x / a + y_left * y_left / d + z_left * z_left / (f - n * c - o * e)


class Gate:
    """Workspace that measures how well feet fit the filter; holds no memory."""

    def __init__(self) -> None:
        self._work = Workspace(_distances())

    def distances(self, spread: FloatArray, residual: FloatArray) -> list[float]:
        """Squared Mahalanobis distance of each foot's residual.

        Args:
            spread: (12, 12) m², covariance of the residual.
            residual: (12,) m.
        """
        block, difference = self._work.inputs
        block[:] = spread
        difference[:] = residual
        self._work.call()
        values: list[float] = self._work.outputs[0].tolist()
        return values


class FeetCorrection:
    """Workspace that corrects by some of the feet; holds no memory.

    The same as `correct` with a block of the measurement for each foot, and
    faster: always twelve rows, zero for the feet that are left out, and no
    library call that is only warm when it is called often.
    """

    def __init__(self) -> None:
        self._work = Workspace(_whitening())

    def reduce(
        self, covariance: FloatArray, spread: FloatArray, residual: FloatArray, used: tuple[int, ...]
    ) -> tuple[FloatArray | None, FloatArray]:
        """What the feet leave to be known.

        Args:
            covariance: (26, 26) before.
            spread: (12, 12) m², covariance of the residual.
            residual: (12,) m, measured minus estimated.
            used: the feet that are used.

        Returns:
            (26,) correction, or None where rounding has made the covariance
            indefinite and the feet must be left out, and (26, 26) covariance after.
        """
        block, difference, weights = self._work.inputs
        block[:] = spread
        difference[:] = residual
        weights[:] = _WEIGHTS[used]
        self._work.call()
        whitener, white, pivot = self._work.outputs
        if not pivot[0] > 0.0:
            return None, covariance
        rows = np.dot(whitener, covariance[_FEET])
        # With two arrays numpy takes the product that the prediction has just used, not a slower one.
        return np.dot(white, rows), _symmetric(covariance + np.dot(rows.T, -rows))


_FEET = slice(6, 18)
_WEIGHTS = {
    legs: tuple(1.0 if leg in legs else 0.0 for leg in range(N_LEGS))
    for n in range(N_LEGS + 1)
    for legs in itertools.combinations(range(N_LEGS), n)
}


@functools.lru_cache(maxsize=1)
def _whitening() -> Any:
    """Inverse Cholesky factor of the used feet's block, and the residual times it (may be shared)."""
    n = 3 * N_LEGS
    spread, residual, used = ca.SX.sym("spread", n, n), ca.SX.sym("residual", n), ca.SX.sym("used", N_LEGS)
    weights = ca.vec(ca.repmat(used, 1, 3).T)
    # A foot that is left out becomes an uncorrelated row of variance 1.
    masked = spread * (weights @ weights.T) + ca.diag(1.0 - weights)
    factor, inverse, pivots = ca.SX(n, n), ca.SX(n, n), []
    for j in range(n):
        pivots.append(masked[j, j] - ca.sumsqr(factor[j, :j]))
        factor[j, j] = ca.sqrt(pivots[j])
        for i in range(j + 1, n):
            factor[i, j] = (masked[i, j] - ca.dot(factor[i, :j], factor[j, :j])) / factor[j, j]
    for j in range(n):
        inverse[j, j] = 1.0 / factor[j, j]
        for i in range(j + 1, n):
            inverse[i, j] = -ca.dot(factor[i, j:i].T, inverse[j:i, j]) / factor[i, i]
    whitener = ca.diag(weights) @ inverse
    return compile_function(
        "whitening", {"spread": spread, "residual": residual, "used": used},
        {"whitener": whitener.T, "white": whitener @ residual, "pivot": ca.mmin(ca.vertcat(*pivots))},
    )  # fmt: skip
