"""Patches of a height map on which the robot can stand: neither steep, nor rough, nor cut by a step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap

_AROUND = tuple((di, dj) for di in (-1, 0, 1) for dj in (-1, 0, 1))
_HALF = ((0, 1), (1, -1), (1, 0), (1, 1))
"""One offset of each pair of neighbours."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PatchConfig:
    """What a foot can be set on."""

    step: float = 0.010  # m, cells that differ by more do not belong together
    slope_deg: float = 25.0  # degrees, steepest cell and steepest patch that carry
    roughness: float = (
        0.006  # m, root mean square off the plane: of a cell's surroundings, of a patch's cells
    )
    area: float = 0.0016  # m^2, smallest patch that carries a foot: 4 cells of 20 mm
    confidence: float = 0.0  # a height with no more counts as unknown
    least_cells: int = 3  # cells of a plane, the cell itself among them; a cell with fewer is in no patch

    def __post_init__(self) -> None:
        require_positive(step=self.step, roughness=self.roughness, area=self.area)
        require_range(0.0, 89.0, slope_deg=self.slope_deg)
        require_range(0.0, 1.0, confidence=self.confidence)
        require_range(3, 9, least_cells=self.least_cells)


@dataclass(frozen=True, kw_only=True, slots=True)
class Patches:
    """Patches of a map, and what is known of each of the k.

    Attributes:
        label: (n, m) index of the patch of each cell; -1 where the ground is unknown, steep or rough.
        height: (k,) m above the map's origin, mean.
        size: (k,) m^2, area seen from above.
        slope: (k,) rad, of the plane through the patch.
        step: (k,) m, greatest difference of height between neighbouring cells of the patch.
        roughness: (k,) m, root mean square distance of its heights from the plane.
        carries: (k,) whether a foot can be set on it.
    """

    label: NDArray[np.intp]
    height: FloatArray
    size: FloatArray
    slope: FloatArray
    step: FloatArray
    roughness: FloatArray
    carries: BoolArray


def segment(ground: HeightMap, config: PatchConfig | None = None) -> Patches:
    """Connected patches of cells that are flat and even enough, joined across small steps only.

    Slope and roughness of a cell come from a plane through those of its eight
    neighbours that a small step parts from it, so that a cell beside the edge of a
    block belongs to the block's top and not to its side.

    Args:
        ground: the map; any part of it may be unknown.
        config: what can be stood on.
    """
    config = config or PatchConfig()
    height = np.where(ground.confidence > config.confidence, ground.height, np.nan)
    slope, roughness = cell_planes(height, ground.cell, config)
    good = (slope <= math.radians(config.slope_deg)) & (roughness <= config.roughness)  # False at NaN
    label, links = _connect(height, good, config.step)
    return _describe(height, label, links, ground.cell, config)


def cell_planes(height: FloatArray, cell: float, config: PatchConfig) -> tuple[FloatArray, FloatArray]:
    """Slope (n, m) in rad and roughness (n, m) in m around each cell; NaN where too little is known.

    Args:
        height: (n, m) m; NaN where unknown.
        cell: m, side of a cell.
        config: which neighbours belong to a cell's surroundings, and how many it takes.
    """
    shape = (9, *height.shape)
    rise, known = np.zeros(shape), np.zeros(shape)
    for k, (di, dj) in enumerate(_AROUND):
        away = _shifted(height, di, dj) - height
        near = np.abs(away) <= config.step  # False at NaN
        known[k] = near
        rise[k] = np.where(near, away, 0.0)
    place = np.array(_AROUND, dtype=np.float64) * cell
    count = known.sum(axis=0)
    safe = np.maximum(count, 1.0)
    mean_i, mean_j = (np.tensordot(axis, known, 1) / safe for axis in place.T)
    mean = rise.sum(axis=0) / safe
    ii, ij, jj = (
        np.tensordot(product, known, 1) - safe * a * b
        for product, a, b in (
            (place[:, 0] ** 2, mean_i, mean_i),
            (place[:, 0] * place[:, 1], mean_i, mean_j),
            (place[:, 1] ** 2, mean_j, mean_j),
        )
    )
    zi, zj = (
        np.tensordot(axis, rise, 1) - safe * m * mean
        for axis, m in zip(place.T, (mean_i, mean_j), strict=True)
    )
    area = ii * jj - ij * ij
    # Cells in one line say nothing of the slope across it.
    enough = (count >= config.least_cells) & (area > 0.1 * cell**4) & np.isfinite(height)
    area = np.where(enough, area, 1.0)
    slope_i, slope_j = (jj * zi - ij * zj) / area, (ii * zj - ij * zi) / area
    left = np.square(rise).sum(axis=0) - safe * mean**2 - slope_i * zi - slope_j * zj
    slope = np.arctan(np.hypot(slope_i, slope_j))
    roughness = np.sqrt(np.maximum(left, 0.0) / safe)
    return np.where(enough, slope, np.nan), np.where(enough, roughness, np.nan)


def _connect(
    height: FloatArray, good: BoolArray, step: float
) -> tuple[NDArray[np.intp], tuple[NDArray[np.intp], FloatArray]]:
    """Labels (n, m) of the patches, and of each of their links the cell it starts from and its step."""
    number = np.arange(height.size).reshape(height.shape)
    ends = []
    for di, dj in _HALF:
        other = _shifted(height, di, dj)
        rise = np.abs(other - height)
        joined = good & (_shifted(good.astype(np.float64), di, dj) == 1.0) & (rise <= step)
        first = number[joined]
        ends.append((first, first + di * height.shape[1] + dj, rise[joined]))
    start, end, rises = (np.concatenate(part) for part in zip(*ends, strict=True))
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(height.size, height.size))
    _, group = connected_components(graph, directed=False)
    label = np.full(height.size, -1, dtype=np.intp)
    cells = np.flatnonzero(good)
    label[cells] = np.unique(group[cells], return_inverse=True)[1]
    return label.reshape(height.shape), (start, rises)


def _describe(
    height: FloatArray,
    label: NDArray[np.intp],
    links: tuple[NDArray[np.intp], FloatArray],
    cell: float,
    config: PatchConfig,
) -> Patches:
    """Area, plane, step and roughness of every patch."""
    patches = int(label.max(initial=-1)) + 1
    inside = label >= 0
    which, z = label[inside], height[inside]
    i, j = (np.asarray(axis, dtype=np.float64) * cell for axis in np.nonzero(inside))

    def total(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(which, weights=values, minlength=patches), dtype=np.float64)

    count = total(np.ones(len(z)))
    centre = [total(values) / count for values in (i, j, z)]
    di, dj, dz = (values - mean[which] for values, mean in zip((i, j, z), centre, strict=True))
    ii, ij, jj = total(di * di), total(di * dj), total(dj * dj)
    zi, zj, zz = total(dz * di), total(dz * dj), total(dz * dz)
    # A small bias keeps patches one cell wide level across: nothing is known of their slope there.
    bias = 0.01 * cell**2
    ii, jj = ii + bias, jj + bias
    area = ii * jj - ij * ij
    slope_i, slope_j = (jj * zi - ij * zj) / area, (ii * zj - ij * zi) / area
    slope = np.arctan(np.hypot(slope_i, slope_j))
    roughness = np.sqrt(np.maximum(zz - slope_i * zi - slope_j * zj, 0.0) / count)
    step = np.zeros(patches)
    np.maximum.at(step, label.ravel()[links[0]], links[1])
    size = count * cell**2
    carries = (size >= config.area * (1.0 - 1e-9)) & (slope <= math.radians(config.slope_deg))
    carries &= roughness <= config.roughness
    return Patches(
        label=label, height=centre[2], size=size, slope=slope, step=step, roughness=roughness, carries=carries
    )


def _shifted(values: FloatArray, di: int, dj: int) -> FloatArray:
    """(n, m), at [i, j] the value at [i + di, j + dj]; NaN beyond the rim."""
    n, m = values.shape
    padded = np.pad(values, 1, constant_values=np.nan)
    return padded[1 + di : 1 + di + n, 1 + dj : 1 + dj + m]
