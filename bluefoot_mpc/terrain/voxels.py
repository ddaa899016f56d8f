"""Thinning of point clouds: one point for every small cube that holds some."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class Voxels:
    """A thinned cloud.

    Attributes:
        points: (n, 3) m, centroids of the points of each voxel, in the frame of the cloud.
        count: (n,) number of points that each stands for.
    """

    points: FloatArray
    count: FloatArray


def thin(points: FloatArray, size: float) -> Voxels:
    """The centroid of each voxel that holds points (thesis, chapter 6, terrain).

    Voxels are centred on multiples of `size`, so that level ground at height 0, where
    the odometry frame starts, lies in the middle of a layer and not between two. Points
    that are no finite numbers are left out.

    Args:
        points: (k, 3) m, the cloud; may be empty.
        size: m, side of a voxel.
    """
    require_positive(size=size)
    points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    points = points[np.isfinite(points).all(axis=1)]
    if not len(points):
        return Voxels(points=np.zeros((0, 3)), count=np.zeros(0))
    corner = np.rint(points / size)
    corner -= corner.min(axis=0)
    across = corner.max(axis=0) + 1.0
    # One number a voxel; floats count exactly up to 2^53, which is 200 000 voxels along each axis.
    key = (corner[:, 2] * across[1] + corner[:, 1]) * across[0] + corner[:, 0]
    _, place, count = np.unique(key, return_inverse=True, return_counts=True)
    sums = [np.bincount(place, weights=points[:, axis], minlength=len(count)) for axis in range(3)]
    weight = count.astype(np.float64)
    return Voxels(points=np.stack(sums, axis=1) / weight[:, None], count=weight)
