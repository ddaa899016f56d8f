import numpy as np
import pytest

from bluefoot_mpc.model.linear import (
    column_space,
    general_solution,
    left_null_space,
    null_space,
    pseudo_inverse,
    row_space,
    subspaces,
)


def matrix_of_rank(rng, rows, columns, rank):
    return rng.normal(size=(rows, rank)) @ rng.normal(size=(rank, columns))


SHAPES = [(3, 4, 3), (3, 4, 2), (4, 3, 3), (4, 3, 2), (6, 4, 4), (5, 5, 1), (3, 3, 0)]


@pytest.mark.parametrize(("rows", "columns", "rank"), SHAPES)
def test_the_four_subspaces_span_domain_and_range(rows, columns, rank):
    matrix = matrix_of_rank(np.random.default_rng(1), rows, columns, rank)
    spaces = subspaces(matrix)
    assert spaces.rank == rank == np.linalg.matrix_rank(matrix)
    for first, second, size in (
        (column_space(matrix), left_null_space(matrix), rows),
        (row_space(matrix), null_space(matrix), columns),
    ):
        basis = np.hstack([first, second])
        assert first.shape == (size, rank)
        np.testing.assert_allclose(basis.T @ basis, np.eye(size), atol=1e-12)
    np.testing.assert_allclose(matrix @ null_space(matrix), 0.0, atol=1e-12)
    np.testing.assert_allclose(left_null_space(matrix).T @ matrix, 0.0, atol=1e-12)


@pytest.mark.parametrize(("rows", "columns", "rank"), SHAPES)
def test_general_solution_is_every_least_squares_solution(rows, columns, rank):
    rng = np.random.default_rng(2)
    matrix, right = matrix_of_rank(rng, rows, columns, rank), rng.normal(size=rows)
    solution = general_solution(matrix, right)
    expected = np.linalg.lstsq(matrix, right, rcond=1e-9)[0]
    np.testing.assert_allclose(solution.particular, expected, atol=1e-10)
    np.testing.assert_allclose(solution.homogeneous.T @ solution.particular, 0.0, atol=1e-10)
    other = solution.at(rng.normal(size=columns - rank))
    for x in (solution.particular, other):
        np.testing.assert_allclose(matrix.T @ (matrix @ x - right), 0.0, atol=1e-10)
        np.testing.assert_allclose(right - matrix @ x, solution.residual, atol=1e-10)
    assert solution.rank == rank
    np.testing.assert_allclose(solution.nearest_to(other), other, atol=1e-10)


@pytest.mark.parametrize(("rows", "columns", "rank"), SHAPES)
def test_pseudo_inverse_fulfils_the_four_penrose_conditions(rows, columns, rank):
    a = matrix_of_rank(np.random.default_rng(3), rows, columns, rank)
    p = pseudo_inverse(a)
    np.testing.assert_allclose(a @ p @ a, a, atol=1e-10)
    np.testing.assert_allclose(p @ a @ p, p, atol=1e-10)
    np.testing.assert_allclose((a @ p).T, a @ p, atol=1e-10)
    np.testing.assert_allclose((p @ a).T, p @ a, atol=1e-10)


def test_damped_pseudo_inverse_is_the_damped_least_squares_one():
    a = np.random.default_rng(4).normal(size=(3, 4))
    expected = np.linalg.inv(a.T @ a + 0.09 * np.eye(4)) @ a.T
    np.testing.assert_allclose(pseudo_inverse(a, damping=0.3), expected, atol=1e-12)


def test_tolerance_decides_what_counts_as_rank():
    nearly = np.diag([1.0, 1e-7])
    assert subspaces(nearly).rank == 2
    assert subspaces(nearly, tolerance=1e-6).rank == 1
    assert np.abs(pseudo_inverse(nearly, tolerance=1e-6)).max() == pytest.approx(1.0)
