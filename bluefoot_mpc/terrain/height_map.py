"""From a cloud to a height map: cells, upper heights, dilation, median, Sobel (thesis, chapter 6)."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.cells import CellConfig, cell_heights
from bluefoot_mpc.terrain.filters import close_gaps, dilate, median, neighbours, slopes
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap

LARGEST = 1_000_000
"""Cells of a map, at most: a slip in a configuration must not take all memory."""


@dataclass(frozen=True, kw_only=True, slots=True)
class MapConfig:
    """How a cloud becomes a height map."""

    cell: float = 0.020  # m, side of a cell
    cells: CellConfig = field(default_factory=CellConfig)  # height of a cell from its points
    dilation: int = 0  # cells by which high ground grows
    median: int = 3  # cells along the median filter's square, odd; 1 = none
    spike: float = 0.010  # m off its square's median from which a height is replaced; 0 = always, as printed
    gap: int = 1  # cells, widest gap between known cells that is bridged
    gap_step: float = 0.010  # m, of height across a gap that is bridged, at most
    gap_trust: float = 0.6  # confidence of the cells on both sides of a gap that is bridged, at least
    gap_confidence: float = 0.3  # of its neighbours' confidence, in a bridged gap
    capacity: int = 200_000  # points that are kept, the newest

    def __post_init__(self) -> None:
        require_positive(cell=self.cell, gap_step=self.gap_step)
        require_nonnegative(dilation=self.dilation, gap=self.gap, spike=self.spike)
        require_range(0.005, 0.1, cell=self.cell)
        require_range(0, 10, dilation=self.dilation, gap=self.gap)
        require_range(1, 10_000_000, capacity=self.capacity)
        require_range(0.0, 1.0, gap_confidence=self.gap_confidence, gap_trust=self.gap_trust)
        require_range(1, 15, median=self.median)
        if self.median % 2 == 0:
            raise ConfigurationError(f"median = {self.median} must be odd: a cell has a square around it")


@dataclass(frozen=True, kw_only=True, slots=True)
class Region:
    """Which piece of the ground a map covers.

    Attributes:
        pose: (4,) x, y, z (m), yaw (rad) of the map's frame in the odometry frame: corner of cell (0, 0).
        n: cells sideways.
        m: cells forward.
    """

    pose: FloatArray
    n: int
    m: int

    def __post_init__(self) -> None:
        if self.pose.shape != (4,):
            raise ConfigurationError(f"a region's pose is x, y, z, yaw, not of shape {self.pose.shape}")
        require_finite(pose=tuple(self.pose.tolist()))
        if not (self.n >= 1 and self.m >= 1 and self.n * self.m <= LARGEST):
            raise ConfigurationError(f"a region of {self.n} x {self.m} cells must have 1 to {LARGEST} cells")

    @classmethod
    def spanning(cls, x: tuple[float, float], y: tuple[float, float], cell: float) -> Self:
        """The region over ranges of x and y (m, odometry frame), along its axes and on the common grid.

        Its corner lies on a whole number of cells from the odometry frame's origin. So the cells of two such
        regions fall on each other, and their maps merge without resampling.

        Args:
            x: least and greatest, forward.
            y: least and greatest, to the left.
            cell: m.
        """
        low_x, low_y = math.floor(x[0] / cell + 1e-6), math.floor(y[0] / cell + 1e-6)
        m, n = math.ceil(x[1] / cell - 1e-6) - low_x, math.ceil(y[1] / cell - 1e-6) - low_y
        return cls(pose=np.array([low_x * cell, low_y * cell, 0.0, 0.0]), n=n, m=m)


@dataclass(frozen=True, kw_only=True, slots=True)
class ReachConfig:
    """Where a region is looked for."""

    near: float = 0.30  # m ahead of the robot, nearest
    far: float = 1.50  # m ahead, farthest
    side: float = 0.60  # m to either side
    length: float = 0.80  # m, of the region forward
    width: float = 0.80  # m, of the region sideways

    def __post_init__(self) -> None:
        require_nonnegative(near=self.near)
        require_positive(side=self.side, length=self.length, width=self.width)
        if self.far - self.near < self.length or 2.0 * self.side < self.width:
            raise ConfigurationError(
                f"a region of {self.length:g} x {self.width:g} m does not fit within reach, "
                f"{self.near:g}..{self.far:g} m ahead and {self.side:g} m to either side"
            )


class MapBuilder:
    """Collects the points of scans and makes height maps of them.

    Args:
        config: how.
    """

    def __init__(self, config: MapConfig | None = None) -> None:
        self._config = config or MapConfig()
        self.reset()

    def reset(self) -> None:
        """Forget all points."""
        self._points: list[FloatArray] = []
        self._times: list[float] = []
        self._count = 0

    def __len__(self) -> int:
        """Points that are kept."""
        return self._count

    def add(self, points: FloatArray, time: float, origin: FloatArray | None = None) -> None:
        """Take the points of one scan in; those that are no numbers are left out.

        Args:
            points: (k, 3) m, odometry frame.
            time: s, end of the scan.
            origin: (3,) m, the LIDAR in the odometry frame: tells how steeply rays came down, and so how a
                range's error becomes one of height. Without it `CellConfig.noise` holds for all points.
        """
        points = np.asarray(points, dtype=np.float64).reshape(-1, 3)
        points = points[np.isfinite(points).all(axis=1)]
        if len(points) == 0:
            return
        noise = self._config.cells.height_noise(points, origin)
        self._points.append(np.column_stack((points, noise)))
        self._times.append(time)
        self._count += len(points)
        while self._count - len(self._points[0]) >= self._config.capacity:
            self._count -= len(self._points.pop(0))
            self._times.pop(0)

    def points(self) -> FloatArray:
        """(n, 3) m, all points that are kept, odometry frame, oldest first."""
        return self._table()[:, :3]

    def build(self, region: Region) -> HeightMap:
        """The height map of a region; all of it unknown where there are no points.

        Args:
            region: which piece of the ground.
        """
        config, cell = self._config, self._config.cell
        table = self._table()
        index, away, inside = _cell_index(table, region, cell)
        table = table[inside]
        shape = (region.n, region.m)
        raw, confidence = cell_heights(
            index[inside], table[:, 2] - region.pose[2], table[:, 3], region.n * region.m, config.cells,
            away[inside],
        )  # fmt: skip
        raw, confidence = raw.reshape(shape), confidence.reshape(shape)
        sure = np.where(confidence >= config.gap_trust, raw, np.nan)
        bridged, gaps = close_gaps(sure, config.gap, config.gap_step, seen=~np.isnan(raw))
        gaps &= np.isnan(raw)
        whole = np.where(gaps, bridged, raw)
        near = np.fmax.reduce(neighbours(confidence, config.gap), axis=0)
        confidence = np.where(gaps, config.gap_confidence * near, confidence)
        height = median(dilate(whole, config.dilation), config.median, config.spike)
        return HeightMap(
            time=self._times[-1] if self._times else 0.0, cell=cell, pose=region.pose.copy(), height=height,
            confidence=confidence,
        )  # fmt: skip

    def _table(self) -> FloatArray:
        """(n, 4) m, x, y, z and standard deviation of the height, oldest first."""
        return np.vstack(self._points) if self._points else np.zeros((0, 4))


def gradients(ground: HeightMap) -> tuple[FloatArray, FloatArray]:
    """Rise per metre forward and to the left of each cell, in the map's frame: Sobel's, scaled to slope.

    NaN where the cell, or too much around it, is unknown.

    Args:
        ground: the map.

    Returns:
        (n, m) along x and (n, m) along y.
    """
    return slopes(ground.height, ground.cell)


def known_share(ground: HeightMap) -> float:
    """Share of the map's cells whose height is known, 0..1; 0 for a region that nothing was seen of."""
    return float(np.count_nonzero(np.isfinite(ground.height)) / ground.height.size)


def choose_region(
    points: FloatArray, place: FloatArray, reach: ReachConfig | None = None, config: MapConfig | None = None
) -> Region:
    """The region with the highest gradient variation within reach (thesis, chapter 6).

    Variation is the sum of squared deviations of the slope from the region's mean, over the cells that are
    known: a steady ramp has none, and what was not seen counts as none. Without points it is the region
    straight ahead; what is unknown in it stays unknown in its map.

    Args:
        points: (k, 3) m, odometry frame.
        place: (3,) x, y (m) and yaw (rad) of the robot in the odometry frame.
        reach: where to look, and how large the region is.
        config: of the map that it is for.
    """
    reach, config = reach or ReachConfig(), config or MapConfig()
    search = _reachable(place, reach, config.cell)
    n, m = round(reach.width / config.cell), round(reach.length / config.cell)
    builder = MapBuilder(config)
    builder.add(points, 0.0)
    rough = _variation(builder.build(search), n, m)
    i, j = (rough.shape[0] - 1) // 2, 0
    if rough.max() > rough[i, j]:
        i, j = divmod(int(rough.argmax()), rough.shape[1])
    x, y, z, yaw = search.pose.tolist()
    c, s = math.cos(yaw), math.sin(yaw)
    along, aside = j * config.cell, i * config.cell
    return Region(pose=np.array([x + c * along - s * aside, y + s * along + c * aside, z, yaw]), n=n, m=m)


def _reachable(place: FloatArray, reach: ReachConfig, cell: float) -> Region:
    """What lies within reach ahead of a place, turned as the robot is."""
    x, y, yaw = place.tolist()
    c, s = math.cos(yaw), math.sin(yaw)
    n, m = round(2.0 * reach.side / cell), round((reach.far - reach.near) / cell)
    corner = (x + c * reach.near + s * reach.side, y + s * reach.near - c * reach.side)
    return Region(pose=np.array([*corner, 0.0, yaw]), n=n, m=m)


def _variation(ground: HeightMap, n: int, m: int) -> FloatArray:
    """(n', m') sum of squared deviations of the slope over each window of n x m cells, by its first cell."""
    total = np.zeros(
        tuple(max(size - window, 0) + 1 for size, window in zip(ground.height.shape, (n, m), strict=True))
    )
    for slope in gradients(ground):
        known = np.isfinite(slope)
        value = np.where(known, slope, 0.0)
        count, first, second = (
            _window_sums(part, n, m) for part in (known.astype(float), value, value * value)
        )
        total += np.maximum(second - first * first / np.maximum(count, 1.0), 0.0)
    return total


def _window_sums(values: FloatArray, n: int, m: int) -> FloatArray:
    """Sums of an array over each window of n x m of its entries."""
    total = np.pad(values, ((1, 0), (1, 0))).cumsum(axis=0).cumsum(axis=1)
    return np.asarray(total[n:, m:] - total[:-n, m:] - total[n:, :-m] + total[:-n, :-m])


def _cell_index(
    points: FloatArray, region: Region, cell: float
) -> tuple[NDArray[np.intp], FloatArray, BoolArray]:
    """Where points are: (k,) flat index of the cell, (k, 2) -1..1 in it, (k,) whether the region holds it."""
    x, y, _, yaw = region.pose.tolist()
    c, s = math.cos(yaw), math.sin(yaw)
    away_x, away_y = points[:, 0] - x, points[:, 1] - y
    along, aside = (c * away_x + s * away_y) / cell, (c * away_y - s * away_x) / cell
    i, j = np.floor(aside), np.floor(along)
    inside = (i >= 0.0) & (i < region.n) & (j >= 0.0) & (j < region.m)
    index = np.where(inside, i * region.m + j, 0.0).astype(np.intp)
    return index, 2.0 * np.column_stack((along - j, aside - i)) - 1.0, inside
