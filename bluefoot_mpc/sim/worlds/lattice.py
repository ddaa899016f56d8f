"""Worlds of cells between lines: which neighbours are joined decides where walls stand."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from bluefoot_mpc.sim.worlds.layout import WALL_THICKNESS, Layout, Point
from bluefoot_mpc.types import FloatArray

Cell = tuple[int, int]
"""Column along x and row along y."""

STEPS: tuple[Cell, ...] = ((1, 0), (0, 1), (-1, 0), (0, -1))
"""To the four neighbours, leftward round from x."""


class Lattice:
    """Cells between lines of uneven spacing, and the pairs of neighbours without a wall between.

    Attributes:
        x: (columns + 1,) m, lines across x.
        y: (rows + 1,) m, lines across y.
        joined: pairs of cells with an open edge between them, the lesser first.

    Args:
        x: m, lines across x, rising.
        y: m, lines across y, rising.
    """

    def __init__(self, x: FloatArray, y: FloatArray) -> None:
        self.x, self.y = x, y
        self.columns, self.rows = len(x) - 1, len(y) - 1
        self.joined: set[tuple[Cell, Cell]] = set()

    def join(self, one: Cell, other: Cell) -> None:
        """Open the edge between two neighbours."""
        self.joined.add((min(one, other), max(one, other)))

    def part(self, one: Cell, other: Cell) -> None:
        """Close it."""
        self.joined.discard((min(one, other), max(one, other)))

    def are_joined(self, one: Cell, other: Cell) -> bool:
        """True where nothing stands between two neighbours."""
        return (min(one, other), max(one, other)) in self.joined

    def cells(self) -> Iterator[Cell]:
        """All cells, column by column."""
        return ((column, row) for column in range(self.columns) for row in range(self.rows))

    def neighbours(self, cell: Cell) -> list[Cell]:
        """The up to four neighbours within the lattice."""
        around = ((cell[0] + step[0], cell[1] + step[1]) for step in STEPS)
        return [(c, r) for c, r in around if 0 <= c < self.columns and 0 <= r < self.rows]

    def used(self) -> set[Cell]:
        """Cells that are joined with any other."""
        return {cell for pair in self.joined for cell in pair}

    def middle(self, cell: Cell) -> Point:
        """Centre of a cell, m."""
        column, row = cell
        return float(self.x[column : column + 2].mean()), float(self.y[row : row + 2].mean())

    def layout(self) -> Layout:
        """Walls on every closed edge of the used cells, straight runs in one piece.

        The bounds end at the outermost walls.
        """
        half, used = 0.5 * WALL_THICKNESS, self.used()
        columns, rows = [cell[0] for cell in used], [cell[1] for cell in used]
        layout = Layout(
            (
                float(self.x[min(columns)]) + half, float(self.y[min(rows)]) + half,
                float(self.x[max(columns) + 1]) - half, float(self.y[max(rows) + 1]) - half,
            )
        )  # fmt: skip
        for column in range(self.columns + 1):
            closed = [self._is_closed((column - 1, row), (column, row), used) for row in range(self.rows)]
            for low, high in _runs(closed):
                x = float(self.x[column])
                layout.line((x, float(self.y[low])), (x, float(self.y[high])))
        for row in range(self.rows + 1):
            closed = [
                self._is_closed((column, row - 1), (column, row), used) for column in range(self.columns)
            ]
            for low, high in _runs(closed):
                y = float(self.y[row])
                layout.line((float(self.x[low]), y), (float(self.x[high]), y))
        return layout

    def _is_closed(self, one: Cell, other: Cell, used: set[Cell]) -> bool:
        return (one in used or other in used) and not self.are_joined(one, other)


def lines(rng: np.random.Generator, count: int, spacing: tuple[float, float]) -> FloatArray:
    """(count + 1,) m, lines with spacings drawn between two bounds, the first at zero."""
    return np.concatenate([[0.0], np.cumsum(rng.uniform(*spacing, count))]).round(3)


def _runs(flags: list[bool]) -> Iterator[tuple[int, int]]:
    """First entry of each stretch of True, and the one after its last."""
    padded = [False, *flags, False]
    edges = [index for index, (one, other) in enumerate(pairwise(padded)) if one != other]
    return zip(edges[::2], edges[1::2], strict=True)
