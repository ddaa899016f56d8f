"""Between the odometry frame and the cells of a height map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.types import FloatArray, HeightMap

Cells = NDArray[np.intp]


def to_map(ground: HeightMap, places: FloatArray) -> FloatArray:
    """(..., 2) m, horizontal places in the map's frame.

    Args:
        ground: the map.
        places: (..., 2) m in the odometry frame.
    """
    x, y, _, yaw = ground.pose.tolist()
    c, s = math.cos(yaw), math.sin(yaw)
    away = np.asarray(places, dtype=np.float64) - (x, y)
    return np.asarray(away @ np.array(((c, -s), (s, c))))


def to_world(ground: HeightMap, places: FloatArray) -> FloatArray:
    """(..., 2) m, horizontal places in the odometry frame.

    Args:
        ground: the map.
        places: (..., 2) m in the map's frame.
    """
    x, y, _, yaw = ground.pose.tolist()
    c, s = math.cos(yaw), math.sin(yaw)
    return np.asarray(np.asarray(places, dtype=np.float64) @ np.array(((c, s), (-s, c))) + (x, y))


def cells_of(ground: HeightMap, places: FloatArray) -> tuple[Cells, Cells]:
    """Indices (i, j) of the cells that hold places; -1, -1 outside the map.

    Args:
        ground: the map.
        places: (..., 2) m in the odometry frame.
    """
    index = np.floor(to_map(ground, places) / ground.cell)
    n, m = ground.height.shape
    inside = np.isfinite(index).all(axis=-1) & (index >= 0.0).all(axis=-1)
    inside &= (index[..., 1] < n) & (index[..., 0] < m)
    index = np.where(inside[..., None], index, -1.0).astype(np.intp)
    return index[..., 1], index[..., 0]


def centres(ground: HeightMap) -> FloatArray:
    """(n, m, 2) m, centres of the cells in the odometry frame."""
    n, m = ground.height.shape
    x, y = np.meshgrid((np.arange(m) + 0.5) * ground.cell, (np.arange(n) + 0.5) * ground.cell)
    return to_world(ground, np.stack((x, y), axis=-1))


def heights_at(ground: HeightMap, places: FloatArray) -> FloatArray:
    """(...,) m in the odometry frame, heights of the cells that hold places; NaN where unknown or outside.

    Args:
        ground: the map.
        places: (..., 2) m in the odometry frame.
    """
    i, j = cells_of(ground, places)
    found = np.where(i >= 0, ground.height[i, j], np.nan)
    return np.asarray(found + ground.pose[2])


def bilinear(ground: HeightMap, layers: FloatArray, places: FloatArray) -> FloatArray:
    """(..., k) values between the centres of a map's cells; NaN where one of the four around is, or outside.

    Args:
        ground: the map, for its frame and cells.
        layers: (n, m, k) values of its cells, such as heights and slopes.
        places: (..., 2) m in the odometry frame.
    """
    n, m = ground.height.shape
    at = to_map(ground, places) / ground.cell - 0.5
    low = np.floor(at)
    inside = (low >= 0.0).all(axis=-1) & (low[..., 0] < m - 1) & (low[..., 1] < n - 1)
    low = np.where(inside[..., None], low, 0.0)
    j, i = np.moveaxis(low.astype(np.intp), -1, 0)
    along, aside = np.moveaxis(at - low, -1, 0)[..., None]
    if n < 2 or m < 2:
        return np.full((*at.shape[:-1], layers.shape[-1]), np.nan)
    near = layers[i, j] * (1.0 - along) + layers[i, j + 1] * along
    far = layers[i + 1, j] * (1.0 - along) + layers[i + 1, j + 1] * along
    return np.where(inside[..., None], near * (1.0 - aside) + far * aside, np.nan)
