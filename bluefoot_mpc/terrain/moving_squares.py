"""Moving least squares: each point of a cloud is drawn onto the plane that fits its surroundings."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class FitConfig:
    """How the surroundings of a point are fitted. Defaults by measurement: docs/terrain-surface.md."""

    neighbours: int = 32  # at most so many, the nearest ones
    radius: float = 0.06  # m, none beyond
    width: float = 0.03  # m, standard deviation of the Gaussian weight over distance
    step: float = 0.01  # m, standard deviation of the weight over the distance from the plane: keeps edges
    rounds: int = 2  # fits of the smoothing

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
        centre: (n, 3) m, a point of each plane.
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


def fit_planes(points: FloatArray, around: Neighbours, weight: FloatArray) -> Planes:
    """The plane of least squares through the surroundings of every point: principal axes, smallest first.

    Args:
        points: (n, 3) m.
        around: their neighbours.
        weight: (n, k) of the neighbours; a row of zeros gives a level plane through the point.
    """
    near = points[around.index] - points[:, None]
    total = weight.sum(axis=1)
    share = weight / np.where(total > 0.0, total, 1.0)[:, None]
    centre = np.einsum("nk,nkd->nd", share, near)
    near -= centre[:, None]
    spread, axes = np.linalg.eigh(np.matmul((near * share[:, :, None]).transpose(0, 2, 1), near))
    normal = axes[:, :, 0]
    normal = np.where(normal[:, 2:] < 0.0, -normal, normal)
    normal[total <= 0.0] = (0.0, 0.0, 1.0)
    return Planes(centre=centre + points, normal=normal, spread=np.maximum(spread, 0.0))


def same_face(points: FloatArray, around: Neighbours, normal: FloatArray, config: FitConfig) -> FloatArray:
    """(n, k) weights that fade with the distance from the plane through the point itself.

    What lies a step above or below belongs to another face, and would tilt the fit.

    Args:
        points: (n, 3) m.
        around: their neighbours.
        normal: (n, 3) unit normals of the planes.
        config: height of a step that counts as one.
    """
    away = np.einsum("nkd,nd->nk", points[around.index] - points[:, None], normal)
    return np.asarray(around.weight * np.exp(-0.5 * np.square(away / config.step)))


def smooth(points: FloatArray, around: Neighbours, config: FitConfig) -> FloatArray:
    """(n, 3) m, the points drawn along the normal onto the planes through their surroundings.

    Moving least squares of first order (thesis, chapter 6, terrain), with weights that
    also fade off the plane, so that edges of blocks are not rounded.

    Args:
        points: (n, 3) m, finite.
        around: their neighbours.
        config: of the fit.
    """
    if not len(points):
        return np.zeros((0, 3))
    normal = np.broadcast_to((0.0, 0.0, 1.0), points.shape)
    for _ in range(config.rounds):
        planes = fit_planes(points, around, same_face(points, around, normal, config))
        normal = planes.normal
        off = np.einsum("nd,nd->n", planes.centre - points, normal)
        points = points + off[:, None] * normal
    return points
