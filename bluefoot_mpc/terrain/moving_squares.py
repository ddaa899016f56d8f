"""Moving least squares: each point of a cloud is drawn onto the plane that fits its surroundings."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray

UP = (0.0, 0.0, 1.0)
"""The direction against which ground is called flat."""

_SINGLE = 1e-9
"""Of the squared mean variance; with cross products below it the least axis could be any."""


@dataclass(frozen=True, kw_only=True, slots=True)
class FitConfig:
    """How the surroundings of a point are fitted. Defaults by measurement: docs/terrain-surface.md."""

    neighbours: int = 48  # at most so many, the nearest ones
    radius: float = 0.12  # m, none beyond
    width: float = 0.08  # m, standard deviation of the Gaussian weight over distance
    step: float = 0.0035  # m, standard deviation of the weight over the distance from the plane: keeps edges
    rounds: int = 3  # fits of the smoothing

    def __post_init__(self) -> None:
        require_range(3, 256, neighbours=self.neighbours)
        require_positive(radius=self.radius, width=self.width, step=self.step)
        require_range(1, 20, rounds=self.rounds)


@dataclass(frozen=True, kw_only=True, slots=True)
class Neighbours:
    """The surroundings of each of n points.

    Attributes:
        index: (n, k) of the neighbours, the point itself among them, nearest first; any valid index where
            there are fewer.
        weight: (n, k) >= 0, of each in fits; 0 where there is no neighbour.
    """

    index: NDArray[np.intp]
    weight: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class Planes:
    """Weighted planes through the surroundings of n points.

    Attributes:
        centre: (n, 3) m, a point of each plane, from the point whose surroundings they are.
        normal: (n, 3) unit normals, z not negative.
        spread: (n, 3) m^2, variances along the principal axes, the normal's first.
    """

    centre: FloatArray
    normal: FloatArray
    spread: FloatArray


def find_neighbours(points: FloatArray, count: FloatArray, config: FitConfig) -> Neighbours:
    """The nearest points around each point, weighted by distance and by what they stand for.

    Args:
        points: (n, 3) m, finite.
        count: (n,) number of measurements in each, its weight at no distance.
        config: how many, how far.
    """
    n = len(points)
    if not n:
        return Neighbours(index=np.zeros((0, 0), dtype=np.intp), weight=np.zeros((0, 0)))
    tree = cKDTree(points, balanced_tree=False, compact_nodes=False)
    ranks = np.arange(1, min(config.neighbours, n) + 1)
    distance, index = tree.query(points, k=ranks, distance_upper_bound=config.radius, workers=1)
    missing = index == n  # SciPy's mark, with an infinite distance, whose weight is 0
    index = np.where(missing, 0, index)
    weight = np.exp(-0.5 * np.square(distance / config.width)) * count[index]
    return Neighbours(index=index, weight=weight)


def offsets(points: FloatArray, around: Neighbours) -> FloatArray:
    """(3, n, k) m, from each point to its neighbours, one array a coordinate: sums over those are fastest."""
    return np.stack([axis.take(around.index) - axis[:, None] for axis in np.ascontiguousarray(points.T)])


def fit_planes(offset: FloatArray, weight: FloatArray) -> Planes:
    """The plane of least squares through the surroundings of every point: principal axes, smallest first.

    Args:
        offset: (3, n, k) m, from the points to their neighbours.
        weight: (n, k) of the neighbours; a row of zeros gives a level plane through the point.
    """
    total = weight.sum(axis=1)
    share = weight / np.where(total > 0.0, total, 1.0)[:, None]
    weighted = offset * share
    centre = weighted.sum(axis=2)
    moment = np.empty((6, offset.shape[1]))
    for k, (a, b) in enumerate(((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))):
        moment[k] = np.einsum("nk,nk->n", weighted[a], offset[b]) - centre[a] * centre[b]
    spread, normal = least_axis(moment)
    return Planes(centre=centre.T, normal=normal, spread=spread)


def least_axis(moment: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Eigenvalues of symmetric 3 x 3 matrices, and the axis of the least one, in closed form.

    A stack of calls to LAPACK takes five times as long. The eigenvalues are the roots of the
    characteristic polynomial by cosines; the axis is the cross product of two rows of the
    matrix less the least one, of those two that are most different.

    Args:
        moment: (6, n) m^2, entries xx, yy, zz, xy, xz, yz of positive semidefinite matrices.

    Returns:
        (n, 3) m^2, eigenvalues, rising, and (n, 3) unit vectors, z not negative; straight up where there is
        no single axis: points on a line, or one point.
    """
    xx, yy, zz, xy, xz, yz = moment
    mean = (xx + yy + zz) / 3.0
    a, b, c = xx - mean, yy - mean, zz - mean
    size = np.sqrt((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0)
    determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz)
    cube = size**3
    angle = np.arccos(np.clip(determinant / np.where(cube > 0.0, 2.0 * cube, 1.0), -1.0, 1.0)) / 3.0
    great = mean + 2.0 * size * np.cos(angle)
    least = mean + 2.0 * size * np.cos(angle + 2.0 * math.pi / 3.0)
    spread = np.stack((least, 3.0 * mean - great - least, great), axis=1)
    a, b, c = xx - least, yy - least, zz - least
    candidates = np.array(
        (
            (xy * yz - xz * b, xz * xy - a * yz, a * b - xy * xy),
            (xy * c - xz * yz, xz * xz - a * c, a * yz - xy * xz),
            (b * c - yz * yz, yz * xz - xy * c, xy * yz - b * xz),
        )
    )
    length = np.sqrt(np.square(candidates).sum(axis=1))
    best = length.argmax(axis=0)
    axis = candidates[best, :, np.arange(len(mean))]
    length = length.max(axis=0)
    single = length > _SINGLE * np.square(mean)
    normal = np.where(single[:, None], axis / np.where(single, length, 1.0)[:, None], UP)
    return np.maximum(spread, 0.0), np.where(normal[:, 2:] < 0.0, -normal, normal)


def same_face(offset: FloatArray, weight: FloatArray, normal: FloatArray, step: float) -> FloatArray:
    """(n, k) weights that fade with the distance from the plane through the point itself.

    What lies a step above or below belongs to another face, and would tilt the fit.

    Args:
        offset: (3, n, k) m, from the points to their neighbours.
        weight: (n, k) of the neighbours, by distance.
        normal: (n, 3) unit normals of the planes.
        step: m, standard deviation of the weight over the distance from the plane.
    """
    away = (offset * normal.T[:, :, None]).sum(axis=0)
    return np.asarray(weight * np.exp(-0.5 * np.square(away / step)))


def smooth(points: FloatArray, around: Neighbours, config: FitConfig) -> tuple[FloatArray, FloatArray]:
    """Draws points along the normal onto the planes through their surroundings.

    Moving least squares of first order (thesis, chapter 6, terrain), with weights that
    also fade off the plane, so that edges of blocks are not rounded. The first planes are
    level ones: on rubble a plane through all that is near would lean on every edge.

    Args:
        points: (n, 3) m, finite.
        around: their neighbours.
        config: of the fit.

    Returns:
        (n, 3) m, the smoothed points, and (n, 3) unit normals of the last planes.
    """
    points = np.array(points)
    normal = np.tile(UP, (len(points), 1))
    if not len(points):
        return points, normal.reshape(0, 3)
    for _ in range(config.rounds):
        offset = offsets(points, around)
        planes = fit_planes(offset, same_face(offset, around.weight, normal, config.step))
        normal = planes.normal
        points += np.einsum("nd,nd->n", planes.centre, normal)[:, None] * normal
    return points, normal
