"""From the points of a sweep to a surface: thinned, smoothed, with normals and flat candidates."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.terrain.moving_squares import FitConfig, find_neighbours, smooth
from bluefoot_mpc.terrain.normals import flat, normals, roughness
from bluefoot_mpc.terrain.voxels import thin
from bluefoot_mpc.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class SurfaceConfig:
    """How a surface is reconstructed."""

    voxel: float = 0.02  # m, side of a voxel
    fit: FitConfig = field(default_factory=FitConfig)
    least_neighbours: int = 6  # a point with fewer around it is not surface
    least_support: float = 0.4  # share of its surroundings near its plane; a point with less is not surface
    flatness: float = 0.06  # e_max: 1 - cos of the angle to the vertical that is flat; 0.06 is 20 degrees

    def __post_init__(self) -> None:
        require_positive(voxel=self.voxel)
        require_range(3, self.fit.neighbours, least_neighbours=self.least_neighbours)
        require_range(0.0, 1.0, least_support=self.least_support, flatness=self.flatness)


@dataclass(frozen=True, kw_only=True, slots=True)
class Surface:
    """A reconstructed surface of n points, in the frame of the cloud.

    Attributes:
        points: (n, 3) m, smoothed.
        normals: (n, 3) unit vectors, z not negative.
        flat: (n,) candidates for footholds.
        roughness: (n,) m, how far what was measured around them strays from their plane, root mean square.
        curvature: (n,) 0..1/3, share of the variance along the normal.
    """

    points: FloatArray
    normals: FloatArray
    flat: BoolArray
    roughness: FloatArray
    curvature: FloatArray


def reconstruct(points: FloatArray, config: SurfaceConfig | None = None) -> Surface:
    """Voxel grid, moving least squares, normals, flat candidates (thesis, chapter 6, terrain).

    Points that are no finite numbers are left out, and so are those with too few
    others around them, or too few near the plane through them: stray echoes, and
    most of the sides of blocks. An empty or scattered cloud gives an empty surface.

    Args:
        points: (k, 3) m, the cloud, z up.
        config: how it is done.
    """
    config = config or SurfaceConfig()
    voxels = thin(points, config.voxel)
    around = find_neighbours(voxels.points, voxels.count, config.fit)
    dense = (around.weight > 0.0).sum(axis=1) >= config.least_neighbours
    if not dense.any():
        return _empty()
    smoothed, guess = smooth(voxels.points, around, config.fit)
    found = normals(smoothed, around, guess, config.fit)
    rough = roughness(voxels.points, smoothed, around, found.normal)
    kept = dense & (found.support >= config.least_support)
    return Surface(
        points=smoothed[kept],
        normals=found.normal[kept],
        flat=flat(found.normal[kept], config.flatness),
        roughness=rough[kept],
        curvature=found.curvature[kept],
    )


def _empty() -> Surface:
    return Surface(
        points=np.zeros((0, 3)), normals=np.zeros((0, 3)), flat=np.zeros(0, dtype=np.bool_),
        roughness=np.zeros(0), curvature=np.zeros(0),
    )  # fmt: skip
