"""Problems to solve: with known optima, random, degenerate and broken ones."""

from __future__ import annotations

import functools

import numpy as np

from bluefoot_mpc.qp import QpProblem, QpSize

INF = np.inf


def known() -> list[tuple[str, QpProblem, list[float]]]:
    """Two variables each, optimum worked out by hand."""

    def make(
        gradient: list[float],
        rows: list[list[float]],
        sides: list[tuple[float, float]],
        bounds: list[tuple[float, float]] | None = None,
        hessian: list[list[float]] | None = None,
    ) -> QpProblem:
        p = QpProblem.empty(QpSize(variables=2, rows=2))
        if hessian:
            p.hessian[:] = hessian
        p.gradient[:] = gradient
        for i, (row, (low, high)) in enumerate(zip(rows, sides, strict=True)):
            p.matrix[i], p.lower[i], p.upper[i] = row, low, high
        for i, (low, high) in enumerate(bounds or []):
            p.floor[i], p.ceiling[i] = low, high
        return p

    one, off = [1.0, 1.0], (-INF, INF)
    return [
        ("free", make([-1.0, 2.0], [], []), [1.0, -2.0]),
        ("coupled", make([-2.0, -3.0], [], [], hessian=[[2.0, 1.0], [1.0, 2.0]]), [1 / 3, 4 / 3]),
        ("upper row", make([-1.0, -1.0], [one], [(-INF, 1.0)]), [0.5, 0.5]),
        ("lower row", make([1.0, 1.0], [one], [(-1.0, INF)]), [-0.5, -0.5]),
        ("idle rows", make([-1.0, 2.0], [one, one], [(-5.0, 5.0), off]), [1.0, -2.0]),
        ("equality", make([0.0, 0.0], [[1.0, 2.0]], [(5.0, 5.0)]), [1.0, 2.0]),
        ("ceiling", make([-2.0, 0.0], [], [], [(-INF, 1.0), (-INF, INF)]), [1.0, 0.0]),
        ("floor", make([3.0, 0.0], [], [], [(-1.0, INF), (-INF, INF)]), [-1.0, 0.0]),
        ("fixed variable", make([-2.0, -2.0], [one], [(-INF, 3.0)], [(0.25, 0.25), off]), [0.25, 2.0]),
        ("corner", make([-9.0, -9.0], [one], [(-INF, 3.0)], [(0.0, 1.0), (0.0, 2.5)]), [1.0, 2.0]),
        ("equality twice", make([0.0, 0.0], [[1, 2], [2, 4]], [(5.0, 5.0), (10.0, 10.0)]), [1.0, 2.0]),
        ("row twice", make([-1.0, -1.0], [one, one], [(-INF, 1.0), (-INF, 1.0)]), [0.5, 0.5]),
        ("empty row", make([-1.0, 0.5], [[0.0, 0.0]], [(-1.0, 1.0)]), [1.0, -0.5]),
    ]  # fmt: skip


def random_problem(rng: np.random.Generator, n: int = 28, m: int = 32, equalities: int = 6) -> QpProblem:
    """Feasible, with rows of all kinds, a repeated one and an empty one."""
    p = QpProblem.empty(QpSize(variables=n, rows=m))
    root = rng.normal(size=(n, n))
    p.hessian[:] = root.T @ root / n + 1e-3 * np.eye(n)
    p.gradient[:] = rng.normal(size=n) * 3.0
    p.matrix[:] = rng.normal(size=(m, n))
    p.matrix[-1], p.matrix[-2] = 0.0, p.matrix[-3]
    inside = rng.normal(size=n) * 0.3
    p.lower[:] = p.matrix @ inside - rng.exponential(size=m)
    p.upper[:] = p.matrix @ inside + rng.exponential(size=m)
    p.lower[:equalities] = p.upper[:equalities] = p.matrix[:equalities] @ inside
    p.upper[equalities : m // 2] = INF
    p.floor[: n // 2] = inside[: n // 2] - rng.exponential(size=n // 2)
    p.ceiling[n // 4 :] = inside[n // 4 :] + rng.exponential(size=n - n // 4)
    return p


def series(seed: int, count: int, fixed_matrices: bool = False) -> list[QpProblem]:
    """Problems that change little from one to the next, as in a control loop."""
    rng = np.random.default_rng(seed)
    first = random_problem(rng)
    problems = [first]
    wander = np.zeros(first.gradient.size)
    for _ in range(count - 1):
        wander += rng.normal(size=wander.size) * 0.3
        before = problems[-1]
        p = QpProblem.empty(first.size)
        p.hessian[:], p.matrix[:] = before.hessian, before.matrix
        if not fixed_matrices:
            scale = rng.normal(size=p.hessian.shape[0]) * 0.01
            p.hessian[:] += np.diag(scale**2)
        p.gradient[:] = first.gradient + wander
        p.lower[:], p.upper[:], p.floor[:], p.ceiling[:] = (
            first.lower, first.upper, first.floor, first.ceiling
        )  # fmt: skip
        problems.append(p)
    return problems


@functools.cache
def hard_problem(seed: int, index: int, spread: float) -> QpProblem:
    """One of a series with badly scaled costs, empty, repeated and dependent rows, and fixed variables.

    Those named in the tests are the ones of many thousands that a solver failed on as it comes.
    """
    rng = np.random.default_rng(seed)
    for _ in range(index):
        _hard(rng, spread)
    return _hard(rng, spread)


def _hard(rng: np.random.Generator, spread: float) -> QpProblem:
    n, m = 28, 32
    p = QpProblem.empty(QpSize(variables=n, rows=m))
    root, scale = rng.normal(size=(n, n)), 10.0 ** rng.uniform(-spread, spread)
    p.hessian[:] = scale * (root.T @ root) / n + 10.0 ** rng.uniform(-6, -2) * np.eye(n)
    p.gradient[:] = rng.normal(size=n) * 10.0 ** rng.uniform(-2, 3)
    p.matrix[:] = rng.normal(size=(m, n))
    if rng.random() < 0.3:
        p.matrix[rng.random(p.matrix.shape) < 0.6] = 0.0
    if rng.random() < 0.3:
        p.matrix[m // 2 :] = 0.0
    x = rng.normal(size=n) * 0.5
    value = p.matrix @ x
    equalities, below = int(rng.integers(0, 8)), rng.exponential(size=m)
    p.lower[:], p.upper[:] = value - below, value + rng.exponential(size=m)
    p.lower[:equalities] = p.upper[:equalities] = value[:equalities]
    if rng.random() < 0.3 and equalities > 2:
        p.matrix[1], p.lower[1], p.upper[1] = 2 * p.matrix[0], 2 * p.lower[0], 2 * p.lower[0]
    if rng.random() < 0.3:
        p.matrix[-1], p.lower[-1], p.upper[-1] = p.matrix[-2], p.lower[-2], p.upper[-2]
    for side, none in ((p.upper, INF), (p.lower, -INF)):
        free = rng.random(m) < 0.3
        free[:equalities] = False
        side[free] = none
    bounded = rng.random(n) < 0.6
    p.floor[bounded] = x[bounded] - rng.exponential(size=bounded.sum())
    bounded = rng.random(n) < 0.6
    p.ceiling[bounded] = x[bounded] + rng.exponential(size=bounded.sum())
    if rng.random() < 0.1:
        j = rng.integers(n)
        p.floor[j] = p.ceiling[j] = x[j]
    return p
