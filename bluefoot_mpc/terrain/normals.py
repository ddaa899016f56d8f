"""Normals of a cloud: the direction in which its surroundings extend least."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.terrain.moving_squares import UP, FitConfig, Neighbours, fit_planes, offsets, same_face
from bluefoot_mpc.types import BoolArray, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class Normals:
    """Normals of n points of a surface.

    Attributes:
        normal: (n, 3) unit vectors, z not negative.
        roughness: (n,) m, root mean square distance of the surroundings from the plane.
        curvature: (n,) 0..1/3, share of the variance along the normal: 0 on a plane.
    """

    normal: FloatArray
    roughness: FloatArray
    curvature: FloatArray


def normals(points: FloatArray, around: Neighbours, guess: FloatArray, config: FitConfig) -> Normals:
    """Principal component normals, pointing up (thesis, chapter 6, terrain).

    Args:
        points: (n, 3) m, smoothed.
        around: their neighbours.
        guess: (n, 3) unit normals of planes off which points count less; level ones where nothing is known.
        config: of the fit.
    """
    if not len(points):
        return Normals(normal=np.zeros((0, 3)), roughness=np.zeros(0), curvature=np.zeros(0))
    offset = offsets(points, around)
    planes = fit_planes(offset, same_face(offset, around.weight, guess, config.step))
    total = planes.spread.sum(axis=1)
    return Normals(
        normal=planes.normal,
        roughness=np.sqrt(planes.spread[:, 0]),
        curvature=planes.spread[:, 0] / np.where(total > 0.0, total, 1.0),
    )


def flat(normal: FloatArray, greatest: float) -> BoolArray:
    """(n,) where 1 - u . n < e_max with u straight up: candidates for footholds (thesis, chapter 6).

    Args:
        normal: (n, 3) unit normals.
        greatest: e_max; 1 - cos of the angle that is flat enough.
    """
    return np.asarray(1.0 - normal @ np.array(UP) < greatest)
