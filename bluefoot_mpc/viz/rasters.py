"""Height maps as pictures whose sides run along the odometry frame's axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.terrain.frame import cells_of, centres, heights_at, to_world
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap
from bluefoot_mpc.viz.packing import pack, pack_mask
from bluefoot_mpc.viz.plots import Trace

UNKNOWN = "rgba(138,148,166,0.42)"
"""Colour of cells that are in a map and not known."""
_STRAIGHT = 1e-6
"""rad and share of a cell: so little turned, a map is drawn cell by cell."""


@dataclass(frozen=True, slots=True)
class Raster:
    """Places of a picture of a map.

    Attributes:
        x: (w,) m, odometry frame, middles of the columns.
        y: (h,) m, middles of the rows.
        i: (h, w) row of the map's cell that is shown; -1 outside the map.
        j: (h, w) its column.
    """

    x: FloatArray
    y: FloatArray
    i: NDArray[np.intp]
    j: NDArray[np.intp]

    def show(self, values: FloatArray) -> FloatArray:
        """(h, w) of values of the cells (n, m); NaN outside the map."""
        return np.where(self.i >= 0, values[self.i, self.j], np.nan)

    def heatmap(self, values: FloatArray, **more: Any) -> Trace:
        """A plotly heat map of values of the cells (n, m).

        Args:
            values: (n, m).
            more: the rest of the trace.
        """
        return {"type": "heatmap", "x": pack(self.x), "y": pack(self.y), "z": pack(self.show(values)), **more}

    def unknown(self, known: BoolArray, *, legend: bool = True) -> Trace:
        """A heat map that fills the cells that are not `known` (n, m)."""
        hidden = (self.i >= 0) & ~known[self.i, self.j]
        return {
            "type": "heatmap", "x": pack(self.x), "y": pack(self.y), "z": pack_mask(hidden),
            "colorscale": [[0.0, "rgba(0,0,0,0)"], [1.0, UNKNOWN]], "showscale": False, "hoverinfo": "skip",
            "name": "unknown", "showlegend": legend, "zmin": 0.0, "zmax": 1.0,
        }  # fmt: skip


def raster_of(ground: HeightMap) -> Raster:
    """The picture's places; a map that is turned is sampled at half its cell.

    Args:
        ground: the map.
    """
    n, m = ground.height.shape
    if abs(float(ground.pose[3])) < _STRAIGHT:
        rows, columns = np.mgrid[:n, :m]
        middle = centres(ground)
        return Raster(middle[0, :, 0], middle[:, 0, 1], rows.astype(np.intp), columns.astype(np.intp))
    low, high = bounds(ground)
    step = 0.5 * ground.cell
    x = np.arange(low[0] + 0.5 * step, high[0], step)
    y = np.arange(low[1] + 0.5 * step, high[1], step)
    i, j = cells_of(ground, np.stack(np.meshgrid(x, y), axis=-1))
    return Raster(x, y, i, j)


def together(maps: Sequence[HeightMap]) -> HeightMap:
    """One map of several, along the odometry frame's axes: where they overlap, the last one holds.

    Args:
        maps: one or more, in their order.
    """
    newest = maps[-1]
    if len(maps) == 1:
        return newest
    corners = np.array([bounds(ground) for ground in maps])
    # Maps of one grid keep their cells.
    low = newest.pose[:2] + newest.cell * np.floor(
        (corners[:, 0].min(axis=0) - newest.pose[:2]) / newest.cell + 1e-6
    )
    columns, rows = np.ceil((corners[:, 1].max(axis=0) - low) / newest.cell - 1e-6).astype(int).tolist()
    y, x = np.mgrid[:rows, :columns]
    places = low + newest.cell * (np.stack([x, y], axis=-1) + 0.5)
    height = np.full((rows, columns), np.nan)
    for ground in maps:
        found = heights_at(ground, places)
        height = np.where(np.isfinite(found), found, height)
    pose = np.array([*low.tolist(), 0.0, 0.0])
    known = np.isfinite(height).astype(np.float64)
    return HeightMap(time=newest.time, cell=newest.cell, pose=pose, height=height, confidence=known)


def bounds(ground: HeightMap) -> tuple[FloatArray, FloatArray]:
    """(2,) and (2,) m, least and greatest x and y of a map in the odometry frame."""
    n, m = ground.height.shape
    corners = to_world(ground, ground.cell * np.array([[0, 0], [m, 0], [m, n], [0, n]], dtype=np.float64))
    return corners.min(axis=0), corners.max(axis=0)
