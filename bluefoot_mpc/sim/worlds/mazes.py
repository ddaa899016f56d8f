"""Worlds of narrow ways: a maze, and a hall with corridors that lead nowhere."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.sim.worlds.lattice import STEPS, Cell, Lattice, lines
from bluefoot_mpc.sim.worlds.layout import Layout

_SPACING = (1.32, 1.46)
"""m between the middles of walls, which are 0.10 m thick."""

_CORRIDORS = (3, 2, 2, 1, 1)
"""Cells of the blind corridors that are asked for; one cell is a niche."""


def maze(rng: np.random.Generator) -> Layout:
    """A maze of twelve to sixteen cells: one way between any two, but for at most one more opening."""
    columns, rows = ((4, 3), (3, 4), (4, 4), (5, 3))[int(rng.integers(4))]
    lattice = Lattice(lines(rng, columns, _SPACING), lines(rng, rows, _SPACING))
    _carve(lattice, rng)
    for _ in range(int(rng.integers(0, 2))):
        cells = list(lattice.cells())
        one = cells[int(rng.integers(len(cells)))]
        others = [cell for cell in lattice.neighbours(one) if not lattice.are_joined(one, cell)]
        if others:
            lattice.join(one, others[int(rng.integers(len(others)))])
    cells = list(lattice.cells())
    return _start_in(lattice, cells[int(rng.integers(len(cells)))], rng)


def dead_ends(rng: np.random.Generator) -> Layout:
    """A hall with blind corridors, niches, and a trap of three walls in its middle."""
    while True:
        lattice = Lattice(lines(rng, 5, _SPACING), lines(rng, 5, _SPACING))
        corner = (int(rng.integers(0, 3)), int(rng.integers(0, 3)))
        hall = {(corner[0] + c, corner[1] + r) for c in range(3) for r in range(3)}
        _open(lattice, hall)
        blind = [_grow(lattice, hall, length, rng) for length in _CORRIDORS]
        if sum(length >= 2 for length in blind) >= 2 and sum(blind) >= 6:
            break
    trap = (corner[0] + 1, corner[1] + 1)
    mouth = STEPS[int(rng.integers(4))]
    for cell in lattice.neighbours(trap):
        if (cell[0] - trap[0], cell[1] - trap[1]) != mouth:
            lattice.part(trap, cell)
    starts = sorted(hall - {trap})
    return _start_in(lattice, starts[int(rng.integers(len(starts)))], rng)


def _carve(lattice: Lattice, rng: np.random.Generator) -> None:
    """Join all cells, one way between any two, by a walk that turns back where it cannot go on."""
    way = [(int(rng.integers(lattice.columns)), int(rng.integers(lattice.rows)))]
    visited = set(way)
    while way:
        fresh = [cell for cell in lattice.neighbours(way[-1]) if cell not in visited]
        if not fresh:
            way.pop()
            continue
        cell = fresh[int(rng.integers(len(fresh)))]
        lattice.join(way[-1], cell)
        visited.add(cell)
        way.append(cell)


def _open(lattice: Lattice, cells: set[Cell]) -> None:
    """Join all neighbours within a set."""
    for cell in cells:
        for other in lattice.neighbours(cell):
            if other in cells:
                lattice.join(cell, other)


def _grow(lattice: Lattice, hall: set[Cell], length: int, rng: np.random.Generator) -> int:
    """Add a corridor that leaves the hall and ends blindly; returns how many cells long it became."""
    used = lattice.used()
    doors = [
        (cell, other) for cell in sorted(hall) for other in lattice.neighbours(cell) if other not in used
    ]
    if not doors:
        return 0
    cell, head = doors[int(rng.integers(len(doors)))]
    lattice.join(cell, head)
    for grown in range(1, length):
        used = lattice.used()
        ahead = [other for other in lattice.neighbours(head) if other not in used]
        if not ahead:
            return grown
        following = ahead[int(rng.integers(len(ahead)))]
        lattice.join(head, following)
        head = following
    return length


def _start_in(lattice: Lattice, cell: Cell, rng: np.random.Generator) -> Layout:
    """The lattice's walls, with the origin in a cell, and x along an open way from there."""
    ways = [
        turn
        for turn, step in enumerate(STEPS)
        if lattice.are_joined(cell, (cell[0] + step[0], cell[1] + step[1]))
    ]
    x, y = lattice.middle(cell)
    layout = lattice.layout().moved(-x, -y)
    return layout.turned(-ways[int(rng.integers(len(ways)))])
