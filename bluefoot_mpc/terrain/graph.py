"""The cheapest way over a cost tensor: A*, by a library's compiled search.

The same graph, moves, start and goal as the windows of `terrain.windows`, so that its way never costs more.

The heuristic is the cheapest way to the goal when one of the two coordinates may be chosen freely in each
column: once the yaw, once the place sideways; the larger of the two counts. It drops a constraint, so it
never overestimates, and it is consistent, h(a) <= c(b) + h(b) for every step from a to b. Dijkstra's search
on the reduced costs c(b) + h(b) - h(a), bounded by what is known to suffice (the best of some greedy ways),
is A*. Cells whose cheapest way from the start and to the goal, by the same bounds, costs more stay out of it.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.terrain.lattice import Goal, Path, Start, reached_path, short_path, whole_goal
from bluefoot_mpc.terrain.windows import search
from bluefoot_mpc.types import BoolArray, FloatArray

_BOUNDING_WINDOWS = (1, 5)
"""Windows whose greedy ways bound the search from above."""
_SLACK = 1e-9
"""Of the bound, that sums may differ by rounding."""
_NO_WAY = "no way leads from the first cell to the goal"


def optimal(cost: FloatArray, start: Start, goal: Goal | None = None) -> Path:
    """The cheapest way from a cell to a column.

    Args:
        cost: (n, m, l) costs, none below zero; infinite where nobody can stand.
        start: the first cell.
        goal: where to end; as default anywhere in the last column.

    Returns:
        The way; where there is none, it is not `reached` and says so.

    Raises:
        ConfigurationError: start or goal is no cell of the tensor.
    """
    goal = whole_goal(cost, start, goal or Goal())
    cells = np.array([start])
    if not np.isfinite(cost[start]):
        return short_path(cells, f"nobody can stand on the first cell {start}")
    layers = np.ascontiguousarray(cost[:, start[1] : (goal.j or 0) + 1].transpose(1, 0, 2))
    ends = np.full(layers.shape[1:], np.inf)
    ends[slice(None) if goal.i is None else goal.i, slice(None) if goal.u is None else goal.u] = 0.0
    to_go = _bounds(layers[::-1], ends)[::-1]
    if not np.isfinite(to_go[0, start[0], start[2]]):
        return short_path(cells, _NO_WAY)
    ways = [search(cost, start, goal, window) for window in _BOUNDING_WINDOWS]
    greedy = min(ways, key=lambda way: way.cost)
    begin = np.full(layers.shape[1:], np.inf)
    begin[start[0], start[2]] = 0.0
    come = _bounds(layers, begin)
    come += layers
    most = greedy.cost * (1.0 + _SLACK)
    keep = come + to_go <= most if math.isfinite(most) else np.isfinite(come + to_go)
    found = _a_star(layers, to_go, keep, most)
    if found is None:
        return greedy if greedy.reached else short_path(cells, _NO_WAY)
    found[:, 1] += start[1]
    way = reached_path(cost, found)
    return way if way.cost <= greedy.cost else greedy


def reachable(cost: FloatArray, start: Start) -> BoolArray:
    """(n, m, l) True for the finite cells that can be reached from a cell, itself included."""
    n, m, turns = cost.shape
    found = np.zeros((n, m, turns), dtype=np.bool_)
    found[start] = np.isfinite(cost[start])
    around = np.zeros((n + 2, turns + 2), dtype=np.bool_)
    for j in range(start[1] + 1, m):
        around[1:-1, 1:-1] = found[:, j - 1]
        aside = around[:-2] | around[1:-1] | around[2:]
        found[:, j] = (aside[:, :-2] | aside[:, 1:-1] | aside[:, 2:]) & np.isfinite(cost[:, j])
    return found


def _bounds(layers: FloatArray, ends: FloatArray) -> FloatArray:
    """(k, n, l) least that must be paid in the layers before each, by both relaxations.

    Args:
        layers: (k, n, l) costs of the layers, in the order in which they are gone through.
        ends: (n, l) 0 on cells of layer 0 where one may begin, infinite elsewhere.
    """
    by_place = _cheapest(layers.min(axis=2), ends.min(axis=1))
    by_yaw = _cheapest(layers.min(axis=1), ends.min(axis=0))
    bounds = np.maximum(by_place[:, :, None], by_yaw[:, None, :])
    np.maximum(bounds[0], ends, out=bounds[0])
    return bounds


def _cheapest(layers: FloatArray, ends: FloatArray) -> FloatArray:
    """(k, n) least cost of all cells before each, where a step changes the index by at most one.

    Args:
        layers: (k, n) costs.
        ends: (n,) 0 or infinite, for layer 0.
    """
    paid = np.empty_like(layers)
    paid[0] = ends
    around = np.full(layers.shape[1] + 2, np.inf)
    for k in range(1, layers.shape[0]):
        np.add(paid[k - 1], layers[k - 1], out=around[1:-1])
        np.minimum(around[:-2], around[1:-1], out=paid[k])
        np.minimum(paid[k], around[2:], out=paid[k])
    return paid


def _a_star(layers: FloatArray, to_go: FloatArray, keep: BoolArray, most: float) -> NDArray[np.intp] | None:
    """(k, 3) i, layer, u of the cheapest way over kept cells; None without one."""
    from scipy.sparse import csr_array  # noqa: PLC0415 - heavy, and only who plans a way needs it
    from scipy.sparse.csgraph import dijkstra  # noqa: PLC0415

    nodes = np.flatnonzero(keep)
    first = np.flatnonzero(nodes < keep[0].size)
    last = np.flatnonzero(nodes >= keep.size - keep[0].size)
    if first.size == 0 or last.size == 0:
        return None
    starts, targets, weights = _steps(layers, to_go, keep, nodes)
    graph = csr_array((weights, targets, starts), shape=(nodes.size, nodes.size))
    limit = max(most - float((layers + to_go).flat[nodes[first[0]]]), 0.0) + _SLACK * min(most, 1.0)
    far, before = dijkstra(graph, indices=int(first[0]), return_predecessors=True, limit=limit)
    node = int(last[np.argmin(far[last])])
    if not np.isfinite(far[node]):
        return None
    way = [node]
    while before[way[-1]] >= 0:
        way.append(int(before[way[-1]]))
    layer, i, u = np.unravel_index(nodes[way[::-1]], keep.shape)
    return np.stack((i, layer, u), axis=1)


def _steps(
    layers: FloatArray, to_go: FloatArray, keep: BoolArray, nodes: NDArray[np.intp]
) -> tuple[NDArray[np.int32], NDArray[np.int32], FloatArray]:
    """Row starts, columns and reduced costs of the graph: the nine steps from each kept cell."""
    number = np.full((keep.shape[0] + 1, keep.shape[1] + 2, keep.shape[2] + 2), -1, dtype=np.int32)
    number[:-1, 1:-1, 1:-1][keep] = np.arange(nodes.size, dtype=np.int32)
    layer, i, u = np.unravel_index(nodes, keep.shape)
    width = number.shape[2]
    here = ((layer + 1) * number.shape[1] + i + 1) * width + u + 1
    aside = np.array([di * width + du for di in (-1, 0, 1) for du in (-1, 0, 1)])
    targets = number.ravel()[here[:, None] + aside]
    there = targets >= 0
    starts = np.zeros(nodes.size + 1, dtype=np.int32)
    np.cumsum(there.sum(axis=1), out=starts[1:])
    chosen = targets[there]
    paid = (layers.ravel()[nodes] + to_go.ravel()[nodes])[chosen]
    weights = paid - np.repeat(to_go.ravel()[nodes], np.diff(starts))
    # Rounding may take a step of no reduced cost below zero.
    return starts, chosen, np.maximum(weights, 0.0)
