"""Planners side by side on one cost tensor, as in the thesis' table (chapter 6, terrain): starts by windows.

Beside them stands the optimum on the same graph. Made-up rough ground to compare them on is here too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import UnknownNameError
from bluefoot_mpc.terrain.graph import optimal
from bluefoot_mpc.terrain.lattice import Goal, Start
from bluefoot_mpc.terrain.windows import WINDOWS, Aim, search
from bluefoot_mpc.types import FloatArray, HeightMap


@dataclass(frozen=True, kw_only=True, slots=True)
class Comparison:
    """What each planner's way costs, from each start.

    Attributes:
        starts: (s) cells.
        windows: (w) cells, sizes of the windows.
        greedy: (s, w) cost of the windows' ways; infinite where they got stuck.
        optimal: (s,) cost of the cheapest way; infinite where there is none.
    """

    starts: tuple[Start, ...]
    windows: tuple[int, ...]
    greedy: FloatArray
    optimal: FloatArray

    @property
    def ratio(self) -> FloatArray:
        """(s, w) cost of the windows' ways over that of the cheapest; infinite where they got stuck."""
        found = np.isfinite(self.greedy)
        return np.where(
            found, np.where(found, self.greedy, 1.0) / np.maximum(self.optimal, 1e-12)[:, None], np.inf
        )


def compare(
    cost: FloatArray,
    starts: Sequence[Start],
    goal: Goal | None = None,
    windows: Sequence[int] = WINDOWS,
    aim: Aim = Aim.MEAN,
) -> Comparison:
    """Plan with every window and with A*, from every start to one goal.

    Args:
        cost: (n, m, l) costs.
        starts: first cells.
        goal: as default anywhere in the last column.
        windows: cells.
        aim: which cell of a window is aimed at.
    """
    greedy = [[search(cost, start, goal, window, aim=aim).cost for window in windows] for start in starts]
    best = [optimal(cost, start, goal).cost for start in starts]
    return Comparison(
        starts=tuple(starts), windows=tuple(windows), greedy=np.array(greedy), optimal=np.array(best)
    )


def spread_starts(cost: FloatArray, column: int, u: int, count: int = 4) -> list[Start]:
    """Cells of a column and a yaw index, evenly over those where the robot can stand; fewer where few are.

    Args:
        cost: (n, m, l) costs.
        column: j.
        u: yaw index.
        count: cells.
    """
    free = np.flatnonzero(np.isfinite(cost[:, column, u]))
    inner = np.linspace(0, free.size - 1, count + 2)[1:-1] if free.size else np.zeros(0)
    return [(int(free[k]), column, u) for k in np.unique(np.rint(inner).astype(np.intp))]


def _blocks(rng: np.random.Generator, cells: int, count: int, sides: tuple[int, int]) -> FloatArray:
    """(cells, cells) m, even ground with rectangular blocks of up to 30 mm on it."""
    height = np.zeros((cells, cells))
    corners = rng.integers(0, cells, (count, 2))
    sizes = rng.integers(*sides, (count, 2))
    tops = rng.uniform(0.0, 0.03, count)
    for (i, j), (a, b), top in zip(corners.tolist(), sizes.tolist(), tops.tolist(), strict=True):
        height[i : i + a, j : j + b] = top
    return height


def _rolling(rng: np.random.Generator, cells: int, width: float) -> FloatArray:
    """(cells, cells) m, hills and hollows as wide as `width` cells."""
    frequency = np.hypot(np.fft.fftfreq(cells)[:, None], np.fft.rfftfreq(cells)[None, :])
    shape = np.exp(-2.0 * (np.pi * width * frequency) ** 2)
    height = np.fft.irfft2(np.fft.rfft2(rng.normal(size=(cells, cells))) * shape, s=(cells, cells))
    return np.asarray(0.02 * height / height.std())


def _half_seen(rng: np.random.Generator, cells: int) -> FloatArray:
    """(cells, cells) m, rubble of which spots are unknown, as in shadows of a LIDAR."""
    height = _blocks(rng, cells, 300, (3, 9))
    for i, j, radius in zip(*rng.integers(0, cells, (2, 12)).tolist(), rng.integers(1, 4, 12), strict=True):
        height[max(i - radius, 0) : i + radius, max(j - radius, 0) : j + radius] = np.nan
    return height


GROUNDS: dict[str, Callable[[np.random.Generator, int], FloatArray]] = {
    "rubble": lambda rng, cells: _blocks(rng, cells, 400, (3, 9)),
    "scattered": lambda rng, cells: _blocks(rng, cells, 60, (4, 12)),
    "large blocks": lambda rng, cells: _blocks(rng, cells, 14, (10, 26)),
    "hills": lambda rng, cells: _rolling(rng, cells, 10.0),
    "measured": lambda rng, cells: _blocks(rng, cells, 60, (4, 12)) + rng.normal(0.0, 0.003, (cells, cells)),
    "half seen": _half_seen,
}
"""Grounds that are made up, by name."""


def made_ground(name: str, seed: int, cells: int = 100, cell: float = 0.02) -> HeightMap:
    """Rough ground of a kind.

    Args:
        name: one of `GROUNDS`.
        seed: of all that is random.
        cells: of a side.
        cell: m.

    Raises:
        UnknownNameError: there is no such kind.
    """
    if name not in GROUNDS:
        raise UnknownNameError("ground", name, GROUNDS)
    height = GROUNDS[name](np.random.default_rng(seed), cells)
    confidence = np.isfinite(height).astype(np.float64)
    return HeightMap(time=0.0, cell=cell, pose=np.zeros(4), height=height, confidence=confidence)
