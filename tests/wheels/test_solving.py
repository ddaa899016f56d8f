import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.wheels.solving import (
    column_space,
    follow,
    general_solution,
    least_squares,
    left_null_space,
    normal_equations,
    null_space,
    pseudo_inverse,
    row_space,
    solve,
    split_domain,
    split_range,
)

RANK_TWO = np.array([[1.0, 2.0, 3.0], [2.0, 4.0, 6.0], [0.0, 1.0, 1.0], [1.0, 3.0, 4.0]])
LENGTHS = (0.3, 0.25)


def arm(q):
    """Planar arm of two links."""
    a, b = LENGTHS
    return np.array([a * np.cos(q[0]) + b * np.cos(q[0] + q[1]), a * np.sin(q[0]) + b * np.sin(q[0] + q[1])])


def arm_jacobian(q):
    a, b = LENGTHS
    s1, c1, s12, c12 = np.sin(q[0]), np.cos(q[0]), np.sin(q[0] + q[1]), np.cos(q[0] + q[1])
    return np.array([[-a * s1 - b * s12, -b * s12], [a * c1 + b * c12, b * c12]])


def line(start, end, count):
    return start + np.linspace(0.0, 1.0, count)[:, None] * (end - start)


def test_the_four_subspaces():
    a = RANK_TWO
    assert [m.shape[1] for m in (column_space(a), row_space(a), null_space(a), left_null_space(a))] == [
        2,
        2,
        1,
        2,
    ]
    np.testing.assert_allclose(a @ null_space(a), 0.0, atol=1e-14)
    np.testing.assert_allclose(a.T @ left_null_space(a), 0.0, atol=1e-14)


def test_every_x_and_b_splits_into_its_two_parts():
    rng = np.random.default_rng(1)
    x, b = rng.normal(size=3), rng.normal(size=4)
    x1, x2 = split_domain(RANK_TWO, x)
    b1, b2 = split_range(RANK_TWO, b)
    np.testing.assert_allclose(x1 + x2, x, atol=1e-14)
    np.testing.assert_allclose(b1 + b2, b, atol=1e-14)
    assert x1 @ x2 == pytest.approx(0.0, abs=1e-14)
    assert b1 @ b2 == pytest.approx(0.0, abs=1e-14)
    np.testing.assert_allclose(RANK_TWO @ x, RANK_TWO @ x1, atol=1e-14)
    np.testing.assert_allclose(RANK_TWO.T @ b2, 0.0, atol=1e-14)
    np.testing.assert_allclose(RANK_TWO.T @ b, RANK_TWO.T @ b1, atol=1e-13)


def test_general_solution_is_particular_and_any_multiple_of_homogeneous():
    b = RANK_TWO @ np.array([1.0, -2.0, 0.5])
    solution = general_solution(RANK_TWO, b)
    for c in (-3.0, 0.0, 10.0):
        np.testing.assert_allclose(RANK_TWO @ solution.at(np.array([c])), b, atol=1e-12)
    np.testing.assert_allclose(solution.particular @ solution.homogeneous, 0.0, atol=1e-14)


def test_normal_equations_pseudo_inverse_and_least_squares_agree_at_full_rank():
    rng = np.random.default_rng(2)
    a, b = rng.normal(size=(5, 3)), rng.normal(size=5)
    x = np.linalg.inv(a.T @ a) @ a.T @ b
    np.testing.assert_allclose(normal_equations(a, b), x, atol=1e-12)
    np.testing.assert_allclose(pseudo_inverse(a) @ b, x, atol=1e-12)
    found = least_squares(a, b)
    np.testing.assert_allclose(found.solution, x, atol=1e-12)
    assert (found.rank, found.unique, found.reached) == (3, True, False)
    assert found.condition == pytest.approx(np.linalg.cond(a))
    np.testing.assert_allclose(a.T @ found.residual, 0.0, atol=1e-12)


def test_report_says_what_rank_and_residual_mean():
    inside = least_squares(RANK_TWO, RANK_TWO @ np.ones(3))
    assert inside.explain() == (
        "b lies in the column space: A x = b has a solution. Rank 2 leaves 1 of 3 free: x is the shortest."
    )
    outside = least_squares(np.eye(3)[:, :2], np.array([1.0, 2.0, 0.5]))
    assert outside.explain() == (
        "b leaves the column space by 0.5: A x = b has no solution, x is the nearest. "
        "The null space is empty: x is the only one."
    )
    nothing = least_squares(np.zeros((2, 2)), np.ones(2))
    assert (nothing.rank, nothing.condition) == (0, np.inf)
    np.testing.assert_array_equal(nothing.solution, 0.0)


def test_a_singular_matrix_needs_more_information():
    b = np.array([1.0, 0.0, 2.0, 1.0])
    with pytest.raises(ConfigurationError, match=r"AᵀA is singular.*rank 2.*damping"):
        normal_equations(RANK_TWO, b)
    shortest = least_squares(RANK_TWO, b).solution
    np.testing.assert_allclose(normal_equations(RANK_TWO, b, damping=1e-4), shortest, atol=1e-4)
    damped = normal_equations(RANK_TWO, b, damping=1.0)
    assert np.linalg.norm(damped) < np.linalg.norm(shortest)
    np.testing.assert_allclose(pseudo_inverse(RANK_TWO, damping=1.0) @ b, damped, atol=1e-12)


@pytest.mark.parametrize(
    ("matrix", "right"),
    [
        (np.zeros((0, 3)), np.zeros(0)), (np.eye(2), np.zeros(3)), (np.ones(3), np.ones(3)),
        (np.eye(2) * np.nan, np.zeros(2)), (np.eye(2), np.array([0.0, np.inf])),
    ],
)  # fmt: skip
def test_equations_that_are_none_are_refused(matrix, right):
    for solver in (least_squares, normal_equations):
        with pytest.raises(ConfigurationError, match="A x = b"):
            solver(matrix, right)


@pytest.mark.parametrize("method", ["normal", "shortest"])
def test_an_arm_follows_a_line(method):
    start = np.array([0.4, 1.2])
    points = line(arm(start), np.array([0.2, 0.35]), 200)
    path = follow(arm, arm_jacobian, points, start, method=method)
    assert path.error.max() < 1e-5
    assert np.all(path.rank == 2)
    np.testing.assert_allclose(arm(path.q[-1]), points[-1], atol=1e-5)


def test_the_documents_differences_drift_and_corrected_ones_do_not():
    start = np.array([0.4, 1.2])
    points = line(arm(start), np.array([0.2, 0.35]), 40)
    drifting = follow(arm, arm_jacobian, points, start, corrected=False)
    corrected = follow(arm, arm_jacobian, points, start)
    assert drifting.error[-1] > 20 * corrected.error[-1]
    assert drifting.error[-1] < 0.01
    finer = follow(arm, arm_jacobian, line(points[0], points[-1], 400), start, corrected=False)
    assert finer.error[-1] < 0.2 * drifting.error[-1]


def test_damping_carries_an_arm_over_a_singular_posture():
    """Stretched out the arm cannot move along itself: JᵀJ is singular, and the line leads out of reach."""
    start = np.array([0.0, 0.0])
    points = line(arm(start), np.array([0.6, 0.1]), 50)
    with pytest.raises(ConfigurationError, match="singular"):
        follow(arm, arm_jacobian, points, start, method="normal")
    path = follow(arm, arm_jacobian, points, start, method="damped", damping=0.05)
    assert np.abs(np.diff(path.q, axis=0)).max() < 0.2
    best = np.linalg.norm(points[-1]) - sum(LENGTHS)
    assert path.error[-1] == pytest.approx(best, abs=5e-3)
    assert path.rank[0] == 1


def test_the_robust_iteration_finds_a_point_from_a_singular_start():
    target = np.array([0.2, 0.3])
    found = solve(arm, arm_jacobian, target, np.zeros(2), preferred=np.array([0.3, 1.0]))
    assert found.converged
    np.testing.assert_allclose(arm(found.q), target, atol=1e-9)


def test_bad_paths_are_refused():
    good = np.zeros((2, 2))
    with pytest.raises(UnknownNameError):
        follow(arm, arm_jacobian, good, np.zeros(2), method="guess")
    with pytest.raises(ConfigurationError, match="damping"):
        follow(arm, arm_jacobian, good, np.zeros(2), method="damped")
    with pytest.raises(ConfigurationError, match="finite"):
        follow(arm, arm_jacobian, good * np.nan, np.zeros(2))
