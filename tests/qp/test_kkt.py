"""Residuals see what is wrong with an answer."""

from __future__ import annotations

import numpy as np
import pytest

from bluefoot_mpc.qp import QpProblem, QpSize, QpSolution, QpStatus, make_solver, residuals
from tests.qp.problems import random_problem


def answer(x: list[float], row: list[float], bound: list[float]) -> QpSolution:
    return QpSolution(
        x=np.array(x), status=QpStatus.SOLVED, row_multiplier=np.array(row), bound_multiplier=np.array(bound)
    )


def problem() -> QpProblem:
    """x + y <= 1 pushes back from (1, 1): optimum (½, ½), multiplier ½."""
    p = QpProblem.empty(QpSize(variables=2, rows=1))
    p.gradient[:], p.matrix[0], p.upper[0] = [-1.0, -1.0], [1.0, 1.0], 1.0
    return p


def test_optimum_has_none() -> None:
    assert residuals(problem(), answer([0.5, 0.5], [0.5], [0.0, 0.0])).worst == 0.0


@pytest.mark.parametrize(
    ("x", "row", "which", "value"),
    [
        ([1.0, 1.0], [0.0], "primal", 1.0),
        ([0.5, 0.5], [0.25], "dual", 0.25),
        ([0.0, 0.0], [1.0], "complementarity", 1.0),
        ([0.5, 0.5], [-0.5], "complementarity", 0.5),  # pushes from a side that does not exist
    ],
)
def test_each_error_shows(x: list[float], row: list[float], which: str, value: float) -> None:
    assert getattr(residuals(problem(), answer(x, row, [0.0, 0.0])), which) == pytest.approx(value)


def test_gap_is_that_of_the_objectives() -> None:
    """Primal 0 at the origin; dual by the side: -y - ½ x'x."""
    found = residuals(problem(), answer([0.0, 0.0], [1.0], [0.0, 0.0]))
    assert found.gap == pytest.approx(1.0)


def test_bounds_count() -> None:
    p = problem()
    p.ceiling[0] = 0.25
    found = residuals(p, answer([0.25, 0.75], [0.25], [0.5, 0.0]))
    assert found.worst == pytest.approx(0.0)
    assert residuals(p, answer([0.5, 0.5], [0.5], [0.0, 0.0])).primal == pytest.approx(0.25)


def test_without_multipliers_only_the_primal_one_is_known() -> None:
    found = residuals(problem(), QpSolution(x=np.zeros(2), status=QpStatus.SOLVED))
    assert found.primal == 0.0
    assert np.isnan([found.dual, found.complementarity, found.gap, found.worst]).all()


def test_a_disturbed_answer_is_told_from_a_right_one() -> None:
    p = random_problem(np.random.default_rng(1))
    right = make_solver("daqp", p.size).solve(p)
    assert residuals(p, right).worst < 1e-9
    wrong = QpSolution(
        x=right.x + 1e-3, status=right.status,
        row_multiplier=right.row_multiplier, bound_multiplier=right.bound_multiplier,
    )  # fmt: skip
    assert residuals(p, wrong).worst > 1e-4
