"""Ways over cells made smooth, and taken back from cells to the world."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.cost import yaw_of
from bluefoot_mpc.terrain.frame import to_world
from bluefoot_mpc.terrain.lattice import Path
from bluefoot_mpc.types import BoolArray, FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class SmoothingConfig:
    """How smooth a way becomes, and how far it may leave its cells for that."""

    stiffness: float = 30.0  # weight of a squared second difference against that of a squared distance
    freedom: float = 2.0  # cells, or yaw indices, from the way that was planned
    rounds: int = 6  # attempts before the way stays as it is

    def __post_init__(self) -> None:
        require_nonnegative(stiffness=self.stiffness)
        require_positive(freedom=self.freedom)
        require_range(1, 50, rounds=self.rounds)


def smooth(
    path: Path, cost: FloatArray, config: SmoothingConfig, begin_yaw: float | None = None
) -> FloatArray:
    """(k, 3) i, j, u of a smooth way beside the planned one, in broken cells; one place a column.

    Least squares: near to the cells, with small second differences. First and last cell stay. Where a place
    would round to an infinite cell or lie too far off, the cells around it pull ten times harder, and again,
    until all places are good; after the last round the way stays as it was planned.

    Args:
        path: the planned way.
        cost: (n, m, l) the tensor that it was planned on.
        config: how smooth.
        begin_yaw: yaw index, broken, at which the way begins; None: that of its first cell.
    """
    cells = path.cells.astype(np.float64)
    if begin_yaw is not None:
        cells[0, 2] = begin_yaw
    if cells.shape[0] < 3:
        return cells
    pull = np.ones(cells.shape[0])
    pull[[0, -1]] = 1e6
    for _ in range(config.rounds):
        eased = cells.copy()
        eased[:, ::2] = _least_squares(cells[:, ::2], pull, config.stiffness)
        eased[[0, -1]] = cells[[0, -1]]
        bad = _bad(eased, cells, cost, config.freedom)
        if not bad.any():
            return eased
        around = bad.copy()
        around[:-1] |= bad[1:]
        around[1:] |= bad[:-1]
        pull[around] *= 10.0
    return cells


def poses(places: FloatArray, ground: HeightMap, yaws: int) -> FloatArray:
    """(k, 3) x, y (m) and yaw (rad) in the odometry frame of (k, 3) broken cells i, j, u.

    Args:
        places: i, j, u; whole numbers are centres of cells.
        ground: the map on whose cells the way was planned.
        yaws: yaw indices in a turn.
    """
    at = to_world(ground, (places[:, 1::-1] + 0.5) * ground.cell)
    return np.column_stack((at, yaw_of(places[:, 2], yaws) + ground.pose[3]))


def _least_squares(cells: FloatArray, pull: FloatArray, stiffness: float) -> FloatArray:
    """(k, d) places of least weighted distance and second differences, by a banded solution."""
    from scipy.linalg import solveh_banded  # noqa: PLC0415 - heavy, and only who plans a way needs it

    count = cells.shape[0]
    bands = np.zeros((3, count))
    bands[0] = pull
    for offset, weight in enumerate((1.0, -2.0, 1.0)):
        bands[0, offset : count - 2 + offset] += stiffness * weight * weight
    bands[1, : count - 2] += -2.0 * stiffness
    bands[1, 1 : count - 1] += -2.0 * stiffness
    bands[2, : count - 2] += stiffness
    return np.asarray(solveh_banded(bands, pull[:, None] * cells, lower=True))


def _bad(eased: FloatArray, cells: FloatArray, cost: FloatArray, freedom: float) -> BoolArray:
    """(k,) True for places that round to an infinite cell or lie too far from their own."""
    nearest = np.rint(eased).astype(np.intp)
    inside = np.asarray(((nearest >= 0) & (nearest < cost.shape)).all(axis=1))
    held = np.where(inside[:, None], nearest, 0)
    free: BoolArray = inside & np.isfinite(cost[tuple(held.T)])
    free[0] = True  # where the robot stands already
    bad: BoolArray = ~free | (np.abs(eased - cells) > freedom).any(axis=1)
    return bad
