"""Patches of a height map on which the robot can stand: neither steep, nor rough, nor cut by a step."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap

T = TypeVar("T", bound=np.generic)
Labels = NDArray[np.intp]

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

    label: Labels
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
    return _describe(height, _label(height, good, config.step), ground.cell, config)


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


def _label(height: FloatArray, good: BoolArray, step: float) -> Labels:
    """(n, m) patch of each cell: first of those that are well inside, then of the rest.

    A cell is inside where small steps part it from good cells all around. Patches grow
    together through such cells alone: two stray heights across a gap join nothing.
    """
    inside = good.copy()
    for di, dj in _AROUND:
        inside &= _joined(height, good, (di, dj), step)
    label = _components(height, inside, step)
    _spread(label, height, good, step)
    left = good & (label < 0)
    rest = _components(height, left, step)
    return np.where(left, rest + label.max(initial=-1) + 1, label)


def _joined(height: FloatArray, good: BoolArray, offset: tuple[int, int], step: float) -> BoolArray:
    """(n, m) whether a cell and its neighbour at an offset are good, and a small step apart."""
    rise = np.abs(_shifted(height, *offset) - height)  # NaN where either is unknown: not small
    return np.asarray(good & (_shifted(good.astype(np.float64), *offset) == 1.0) & (rise <= step))


def _components(height: FloatArray, good: BoolArray, step: float) -> Labels:
    """(n, m) from 0: cells that are joined, one by one, have the same label; -1 where they are not good."""
    number = np.arange(height.size).reshape(height.shape)
    starts, ends = [], []
    for di, dj in _HALF:
        first = number[_joined(height, good, (di, dj), step)]
        starts.append(first)
        ends.append(first + di * height.shape[1] + dj)
    start, end = np.concatenate(starts), np.concatenate(ends)
    graph = coo_array((np.ones(len(start)), (start, end)), shape=(height.size, height.size))
    _, group = connected_components(graph, directed=False)
    label = np.full(height.size, -1, dtype=np.intp)
    cells = np.flatnonzero(good)
    label[cells] = np.unique(group[cells], return_inverse=True)[1]
    return label.reshape(height.shape)


def _spread(label: Labels, height: FloatArray, good: BoolArray, step: float) -> None:
    """Give good cells beside patches the label of the neighbour that is nearest in height, where one is."""
    least, nearest = np.full(height.shape, step), np.full(height.shape, -1, dtype=np.intp)
    padded = np.pad(label, 1, constant_values=-1)
    for di, dj in _AROUND:
        rise = np.abs(_shifted(height, di, dj) - height)
        other = _window(padded, di, dj)
        better = good & (label < 0) & (other >= 0) & (rise <= least)
        least[better], nearest[better] = rise[better], other[better]
    np.copyto(label, nearest, where=nearest >= 0)


def _describe(height: FloatArray, label: Labels, cell: float, config: PatchConfig) -> Patches:
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
    size = count * cell**2
    carries = (size >= config.area * (1.0 - 1e-9)) & (slope <= math.radians(config.slope_deg))
    carries &= roughness <= config.roughness
    return Patches(
        label=label, height=centre[2], size=size, slope=slope, step=_steps(height, label, patches),
        roughness=roughness, carries=carries,
    )  # fmt: skip


def _steps(height: FloatArray, label: Labels, patches: int) -> FloatArray:
    """(k,) m, greatest difference of height between neighbouring cells of each patch."""
    step = np.zeros(patches)
    padded = np.pad(label, 1, constant_values=-1)
    for di, dj in _HALF:
        same = (label >= 0) & (_window(padded, di, dj) == label)
        np.maximum.at(step, label[same], np.abs(_shifted(height, di, dj) - height)[same])
    return step


def _shifted(values: FloatArray, di: int, dj: int) -> FloatArray:
    """(n, m), at [i, j] the value at [i + di, j + dj]; NaN beyond the rim."""
    return _window(np.pad(values, 1, constant_values=np.nan), di, dj)


def _window(padded: NDArray[T], di: int, dj: int) -> NDArray[T]:
    """(n, m) of an array with a rim of one cell, moved by an offset."""
    n, m = padded.shape[0] - 2, padded.shape[1] - 2
    return padded[1 + di : 1 + di + n, 1 + dj : 1 + dj + m]
