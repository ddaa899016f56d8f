"""Floor that a robot can get at, and how much of it its LIDAR has seen."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import BoolArray, FloatArray, LidarScan

CELL = 0.05
"""m, edge of a cell of the grid."""

ROBOT_RADIUS = 0.30
"""m, disc around the robot's outline with its legs in a swing."""

LIDAR_HEIGHT = 0.25
"""m, of the scan plane above level floor."""

LIDAR_RANGE = 5.6
"""m, reach of the URG-04LX."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Grid:
    """The floor of a plan in square cells; rows run along y, columns along x, from the least coordinates.

    Attributes:
        corner: m, least x and y of the first cell, in world.
        cell: m, edge of a cell.
        centres: (rows, columns) True where the disc's centre can get to from the origin.
        floor: (rows, columns) True where the disc can cover the floor: what there is to see.
    """

    corner: tuple[float, float]
    cell: float
    centres: BoolArray
    floor: BoolArray

    @property
    def area(self) -> float:
        """m² of floor that the disc can cover."""
        return float(np.count_nonzero(self.floor)) * self.cell**2

    def points(self) -> FloatArray:
        """Centres of all cells (rows · columns, 2), row by row, m in world."""
        rows, columns = self.floor.shape
        return _cell_points(self.corner, self.cell, rows, columns)

    def holds(self, x: float, y: float) -> bool:
        """True where the disc's centre can be at a point, m in world."""
        column = math.floor((x - self.corner[0]) / self.cell)
        row = math.floor((y - self.corner[1]) / self.cell)
        rows, columns = self.centres.shape
        return 0 <= row < rows and 0 <= column < columns and bool(self.centres[row, column])


def reachable(plan: WorldPlan, radius: float = ROBOT_RADIUS, cell: float = CELL) -> Grid:
    """What a disc can get at from the origin.

    Args:
        plan: of the world.
        radius: m, of the disc.
        cell: m, edge of a cell.
    """
    x0, y0, x1, y1 = plan.bounds
    rows, columns = math.ceil((y1 - y0) / cell - 1e-9), math.ceil((x1 - x0) / cell - 1e-9)
    points = _cell_points((x0, y0), cell, rows, columns)
    grid_points = points.reshape(rows, columns, 2)
    away = np.full((rows, columns), np.inf)
    for solid in _obstacles(plan):
        near = _around(solid, radius, (x0, y0), cell)
        here = grid_points[near]
        found = footprint.distance(here.reshape(-1, 2), solid).reshape(here.shape[:2])
        away[near] = np.minimum(away[near], found)
    inside = _inside(points, plan.bounds, radius).reshape(rows, columns)
    parts, _ = label((away >= radius) & inside)
    start = parts[math.floor(-y0 / cell), math.floor(-x0 / cell)]
    centres = (parts == start) & (start > 0)
    floor = away > 0.0
    if centres.any():
        floor &= distance_transform_edt(~centres) * cell <= radius + 0.5 * cell
    else:
        floor = np.zeros_like(centres)
    return Grid(corner=(x0, y0), cell=cell, centres=centres, floor=floor)


class Coverage:
    """What scans have shown of a grid's floor, so far.

    Scans that must not be used, or are none, show nothing. A cell is seen when it lies in reach, inside the
    sector, and nearer than what its ray hit, or at most one cell farther. A ray without an echo shows
    nothing: it may have been lost.

    Attributes:
        grid: whose floor is looked at.
        seen: (rows, columns) True where a scan has shown the floor.
    """

    def __init__(self, grid: Grid) -> None:
        self.grid = grid
        self.seen: BoolArray = np.zeros_like(grid.floor)
        self._left: NDArray[np.intp] = np.flatnonzero(grid.floor)
        self._points = grid.points()[self._left]
        self._count = max(1, len(self._left))

    @property
    def fraction(self) -> float:
        """Seen share of the floor, 0..1."""
        return 1.0 - len(self._left) / self._count

    def add(self, pose: FloatArray, scan: LidarScan) -> None:
        """Take in one scan, if it is one.

        Args:
            pose: (3,) m, m, rad: the LIDAR's place and direction in world.
            scan: what it measured there.
        """
        if not _is_usable(scan) or not len(self._left):
            return
        reach = np.fmin(scan.distance + self.grid.cell, LIDAR_RANGE)
        reach[np.isnan(scan.distance)] = 0.0
        offset = self._points - pose[:2]
        square = offset[:, 0] ** 2 + offset[:, 1] ** 2
        near = np.flatnonzero(square <= float(reach.max()) ** 2)
        bearing = np.arctan2(offset[near, 1], offset[near, 0]) - pose[2]
        bearing = (bearing + math.pi) % (2.0 * math.pi) - math.pi
        ray, spacing = _nearest_ray(scan.bearing, bearing)
        shown = square[near] <= reach[ray] ** 2
        shown &= np.abs(scan.bearing[ray] - bearing) <= spacing
        seen = near[shown]
        self.seen.flat[self._left[seen]] = True
        left = np.ones(len(self._left), dtype=bool)
        left[seen] = False
        self._left, self._points = self._left[left], self._points[left]


def seen_fraction(grid: Grid, poses: Iterable[FloatArray], scans: Iterable[LidarScan]) -> float:
    """Share of a grid's floor, 0..1, that scans have shown.

    Args:
        grid: from `reachable`.
        poses: of the LIDAR for each scan, (3,) m, m, rad in world; see `lidar_pose`.
        scans: what it measured.
    """
    coverage = Coverage(grid)
    for pose, scan in zip(poses, scans, strict=True):
        coverage.add(pose, scan)
    return coverage.fraction


def lidar_pose(q: FloatArray, mount: FloatArray) -> FloatArray:
    """Place and direction of the LIDAR in the plane, (3,) m, m, rad in world.

    Args:
        q: (7,) or longer: trunk position in world, m, and quaternion xyzw.
        mount: (3,) m, of the LIDAR in the base frame.
    """
    rotation = rotation_from_quaternion(q[3:7])
    place = q[:3] + rotation @ mount
    return np.array([place[0], place[1], math.atan2(rotation[1, 0], rotation[0, 0])])


def visible(
    solids: Iterable[Solid], eye: FloatArray, points: FloatArray, height: float = LIDAR_HEIGHT
) -> BoolArray:
    """Which points no solid hides, by geometry: (n,) True where the straight line is free.

    Args:
        solids: that may stand between.
        eye: (2,) m in world.
        points: (n, 2) m in world.
        height: m, of the level plane in which is looked.
    """
    free = np.ones(len(points), dtype=bool)
    for solid in footprint.crossing(solids, height):
        free &= ~_cuts(eye, points, solid)
    return free


def _cuts(eye: FloatArray, points: FloatArray, solid: Solid) -> BoolArray:
    """(n,) True where the line from the eye to a point goes through a solid's footprint."""
    direction, start = points - eye, eye - np.array([solid.x, solid.y])
    if solid.shape == "cylinder":
        square = np.maximum(np.sum(direction**2, axis=1), 1e-12)
        share = np.clip(-(direction @ start) / square, 0.0, 1.0)
        nearest = start + share[:, None] * direction
        return np.asarray(np.hypot(nearest[:, 0], nearest[:, 1]) < 0.5 * solid.size[0])
    cosine, sine = math.cos(solid.yaw), math.sin(solid.yaw)
    rotation = np.array([[cosine, -sine], [sine, cosine]])
    start, direction = start @ rotation, direction @ rotation
    # Slabs: the line is inside both pairs of sides over a common part of its length.
    direction = np.where(np.abs(direction) < 1e-12, 1e-12, direction)
    half = 0.5 * np.array(solid.size[:2])
    ends = np.stack([(-half - start) / direction, (half - start) / direction])
    enter, leave = ends.min(axis=0).max(axis=1), ends.max(axis=0).min(axis=1)
    return np.asarray((enter < leave) & (leave > 0.0) & (enter < 1.0))


def _is_usable(scan: LidarScan) -> bool:
    """True for a scan that may be used: one distance to each of some rising bearings."""
    if not scan.valid or scan.bearing.ndim != 1 or scan.distance.shape != scan.bearing.shape:
        return False
    is_rising = bool(np.all(np.diff(scan.bearing) > 0.0))  # never where one is NaN
    return is_rising and len(scan.bearing) > 0 and bool(np.isfinite(scan.bearing[[0, -1]]).all())


def _nearest_ray(bearings: FloatArray, wanted: FloatArray) -> tuple[NDArray[np.intp], float]:
    """Of each wanted bearing the nearest ray, and how far a ray speaks for its surroundings, rad."""
    spacing = float(bearings[-1] - bearings[0]) / max(1, len(bearings) - 1)
    if spacing == 0.0:
        return np.zeros(len(wanted), dtype=np.intp), math.radians(0.5)
    index = np.rint((wanted - bearings[0]) / spacing)
    return np.clip(index, 0, len(bearings) - 1).astype(np.intp), abs(spacing)


def _obstacles(plan: WorldPlan) -> tuple[Solid, ...]:
    solids = footprint.in_the_way(plan.solids)
    marker = plan.marker
    if marker is None:
        return solids
    size = (2.0 * marker.radius, 2.0 * marker.radius, marker.z + marker.radius)
    return *solids, Solid(
        name="marker_disc", shape="cylinder", x=marker.x, y=marker.y, z=0.5 * size[2], size=size
    )


def _around(solid: Solid, margin: float, corner: tuple[float, float], cell: float) -> tuple[slice, slice]:
    """Rows and columns of the cells within a margin (m) of a solid, and some more."""
    ends = footprint.corners(solid)
    low = np.maximum(np.floor((ends.min(axis=0) - margin - corner) / cell), 0.0).astype(int)
    high = np.maximum(np.ceil((ends.max(axis=0) + margin - corner) / cell), 0.0).astype(int)
    return slice(int(low[1]), int(high[1])), slice(int(low[0]), int(high[0]))


def _inside(points: FloatArray, bounds: tuple[float, float, float, float], margin: float) -> BoolArray:
    """(n,) True where points keep a margin to the bounds, within a hair."""
    x0, y0, x1, y1 = bounds
    least = np.minimum(points - (x0, y0), np.array([x1, y1]) - points).min(axis=1)
    return np.asarray(least >= margin - 1e-9)


def _cell_points(corner: tuple[float, float], cell: float, rows: int, columns: int) -> FloatArray:
    x = corner[0] + (np.arange(columns) + 0.5) * cell
    y = corner[1] + (np.arange(rows) + 0.5) * cell
    return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
