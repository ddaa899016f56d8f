"""Families of quadratic programs for `qp_stress`: a seed gives an endless series."""

from __future__ import annotations

import functools
import itertools
from collections.abc import Callable, Iterator

import numpy as np

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.qp import QpProblem, QpSize
from bluefoot_mpc.wbc import WholeBodyModel
from bluefoot_mpc.wbc.samples import sample_problems

Problems = Callable[[int], Iterator[QpProblem]]


def body(seed: int) -> Iterator[QpProblem]:
    """As large as a whole-body problem; all matrices drift, feet come and go by the sides of their rows."""
    rng = np.random.default_rng(seed)
    n, m, equalities = 28, 32, 6
    root, matrix = rng.normal(size=(n + 4, n)), rng.normal(size=(m, n))
    inside, gradient = rng.normal(size=n) * 0.3, rng.normal(size=n) * 5.0
    p = QpProblem.empty(QpSize(variables=n, rows=m))
    p.floor[:], p.ceiling[:] = -3.0, 3.0
    for step in itertools.count():
        root += rng.normal(size=root.shape) * 0.02
        matrix += rng.normal(size=matrix.shape) * 0.02
        gradient += rng.normal(size=n) * 0.1
        inside = 0.99 * inside + rng.normal(size=n) * 0.02
        p.hessian[:], p.gradient[:], p.matrix[:] = root.T @ root + 1e-3 * np.eye(n), gradient, matrix
        value = p.matrix @ inside
        p.lower[:], p.upper[:] = value - 1.0, value + 1.0
        p.upper[equalities : m // 2] = np.inf
        still = equalities + 4 * (step // 50 % 3)
        p.lower[:still] = p.upper[:still] = value[:still]
        yield p


def preview(seed: int) -> Iterator[QpProblem]:
    """As large as a preview of 32 samples on two axes: bands about diagonals that change in turn."""
    rng = np.random.default_rng(seed)
    samples, period, height = 32, 0.05, 0.13 / 9.81
    lag = np.subtract.outer(np.arange(samples), np.arange(samples))
    response = np.where(lag >= 0, (1 + 3 * lag + 3 * lag**2) * period**3 / 6 - height * period, 0.0)
    times = period * np.arange(1, samples + 1)
    free = np.stack([np.ones(samples), times, times**2 / 2 - height], axis=1)
    p = QpProblem.empty(QpSize(variables=2 * samples, rows=2 * samples))
    p.hessian[:] = np.kron(np.eye(2), response.T @ response + 1e-5 * np.eye(samples))
    p.matrix[:] = np.kron(np.array([[1.0, 1.0], [1.0, -1.0]]), response)
    p.floor[:], p.ceiling[:] = -200.0, 200.0
    state = np.zeros((3, 2))
    for step in itertools.count():
        state = 0.9 * state + rng.normal(size=(3, 2)) * np.array([[0.003], [0.02], [0.1]])
        side = np.where((np.arange(samples) + step // 3) // 6 % 2 == 0, 1.0, -1.0)
        value = free @ state
        p.gradient[:] = np.concatenate([response.T @ value[:, 0], response.T @ (value[:, 1] - 0.01 * side)])
        width = np.concatenate([np.where(side > 0, 0.02, 0.15), np.where(side < 0, 0.02, 0.15)])
        drift = np.concatenate([value.sum(axis=1), value[:, 0] - value[:, 1]])
        p.lower[:], p.upper[:] = -width - drift, width - drift
        yield p


def whole_body(seed: int, starts: np.ndarray | None = None) -> Iterator[QpProblem]:
    """Problems of whole-body control, from quiet standing to hopeless states, any feet in the air."""
    return sample_problems(whole_body_model(), seed, starts=starts)


@functools.cache
def whole_body_model() -> WholeBodyModel:
    return WholeBodyModel.from_robot(load_robot())


FAMILIES: dict[str, Problems] = {"body": body, "preview": preview, "whole-body": whole_body}
