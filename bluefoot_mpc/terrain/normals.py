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
        curvature: (n,) 0..1/3, share of the variance along the normal: 0 on a plane.
        support: (n,) 0..1, share of the surroundings' weight that lies near the plane.
    """

    normal: FloatArray
    curvature: FloatArray
    support: FloatArray


def normals(points: FloatArray, around: Neighbours, guess: FloatArray, config: FitConfig) -> Normals:
    """Principal component normals, pointing up (thesis, chapter 6, terrain).

    Args:
        points: (n, 3) m, smoothed.
        around: their neighbours.
        guess: (n, 3) unit normals of planes off which points count less; level ones where nothing is known.
        config: of the fit.
    """
    if not len(points):
        return Normals(normal=np.zeros((0, 3)), curvature=np.zeros(0), support=np.zeros(0))
    offset = offsets(points, around)
    near = same_face(offset, around.weight, guess, config.step)
    planes = fit_planes(offset, near)
    weight = around.weight.sum(axis=1)
    total = planes.spread.sum(axis=1)
    return Normals(
        normal=planes.normal,
        curvature=planes.spread[:, 0] / np.where(total > 0.0, total, 1.0),
        support=near.sum(axis=1) / np.where(weight > 0.0, weight, 1.0),
    )


def roughness(measured: FloatArray, points: FloatArray, around: Neighbours, normal: FloatArray) -> FloatArray:
    """(n,) m, how far what was measured around points strays from the planes through them, root mean square.

    The sensor's noise is in it, and so are steps: neighbours count by their distance alone.

    Args:
        measured: (n, 3) m, the points before they were smoothed.
        points: (n, 3) m, the same points smoothed.
        around: their neighbours.
        normal: (n, 3) unit normals of the planes.
    """
    total = around.weight.sum(axis=1)
    height = -np.einsum("nd,nd->n", points, normal)[:, None]
    away = height + sum(measured[:, axis].take(around.index) * normal[:, axis, None] for axis in range(3))
    mean = np.einsum("nk,nk,nk->n", around.weight, away, away) / np.where(total > 0.0, total, 1.0)
    return np.asarray(np.sqrt(mean))


def flat(normal: FloatArray, greatest: float) -> BoolArray:
    """(n,) where 1 - u . n < e_max with u straight up: candidates for footholds (thesis, chapter 6).

    Args:
        normal: (n, 3) unit normals.
        greatest: e_max; 1 - cos of the angle that is flat enough.
    """
    return np.asarray(1.0 - normal @ np.array(UP) < greatest)
