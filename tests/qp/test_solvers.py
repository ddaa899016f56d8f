"""Every solver behind the one interface, on problems whose answers are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.qp import (
    SOLVERS,
    QpProblem,
    QpSize,
    QpSolution,
    QpStatus,
    Solver,
    SolverOptions,
    installed_solvers,
    make_solver,
    registry,
    residuals,
)
from tests.qp.problems import hard_problem, known, random_problem, series

MAIN = ("daqp", "proxsuite")
SIZE = QpSize(variables=28, rows=32)
# CasADi's own active-set method gives up on dense problems of this size; its library daqp is an
# older one that does not know repeated equalities; quadprog refuses them by construction.
UNCHECKED_GAP = 1e-3  # ProxQP stops there unless it is asked to look, which CasADi does not let one
WEAK = {"casadi-qrqp"}
NO_REPEATED_EQUALITIES = {"casadi-qrqp", "casadi-daqp", "quadprog"}


def test_main_solvers_are_installed() -> None:
    assert set(MAIN) <= set(installed_solvers()) <= set(SOLVERS)


@pytest.mark.parametrize("name", installed_solvers())
@pytest.mark.parametrize(("case", "problem", "optimum"), known(), ids=[case for case, _, _ in known()])
def test_known_optimum(name: str, case: str, problem: QpProblem, optimum: list[float]) -> None:
    if case == "equality twice" and name in NO_REPEATED_EQUALITIES:
        pytest.skip("not for this solver")
    solution = make_solver(name, problem.size).solve(problem)
    assert solution.ok, solution.status
    accuracy = UNCHECKED_GAP if name == "casadi-proxqp" else 1e-5
    np.testing.assert_allclose(solution.x, optimum, atol=accuracy)
    if solution.row_multiplier is not None and solution.bound_multiplier is not None:
        assert residuals(problem, solution).worst < accuracy


@pytest.mark.parametrize("name", [name for name in installed_solvers() if name not in WEAK])
def test_kkt_residuals_on_random_feasible_problems(name: str) -> None:
    rng = np.random.default_rng(3)
    solver = make_solver(name, SIZE)
    reference = make_solver("daqp", SIZE, SolverOptions(warm_start=False))
    for _ in range(6):
        p = random_problem(rng)
        solution = solver.solve(p)
        if name == "highs" and not solution.ok:
            continue  # it fails now and then, and says so
        assert solution.ok, solution.status
        assert residuals(p, solution).worst < 1e-5
        np.testing.assert_allclose(solution.x, reference.solve(p).x, atol=2e-5)


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("name", MAIN)
def test_series_warm_and_cold_agree(name: str, fixed: bool) -> None:
    warm = make_solver(name, SIZE, SolverOptions(fixed_matrices=fixed))
    cold = make_solver(name, SIZE, SolverOptions(warm_start=False))
    for p in series(4, 60, fixed):
        a, b = warm.solve(p), cold.solve(p)
        assert a.ok
        assert b.ok
        assert residuals(p, a).worst < 1e-6
        np.testing.assert_allclose(a.x, b.x, atol=1e-6)


@pytest.mark.parametrize("fixed", [False, True])
def test_daqp_warm_start_saves_steps(fixed: bool) -> None:
    warm = make_solver("daqp", SIZE, SolverOptions(fixed_matrices=fixed))
    cold = make_solver("daqp", SIZE, SolverOptions(warm_start=False, fixed_matrices=fixed))
    problems = series(5, 40, fixed)
    steps = [[solver.solve(p).iterations for p in problems] for solver in (warm, cold)]
    assert sum(steps[0][1:]) < 0.3 * sum(steps[1][1:])


def test_fixed_matrices_are_read_once() -> None:
    first, second = series(6, 2, fixed_matrices=True)
    kept = make_solver("daqp", SIZE, SolverOptions(fixed_matrices=True))
    kept.solve(first)
    fresh = make_solver("daqp", SIZE).solve(second).x
    second.hessian[:] = np.nan  # not looked at
    np.testing.assert_allclose(kept.solve(second).x, fresh, atol=1e-9)
    kept.reset()
    assert kept.solve(second).status is QpStatus.FAILED


@pytest.mark.parametrize("warm_start", [False, True])
@pytest.mark.parametrize("name", MAIN)
def test_reset_repeats_bit_for_bit(name: str, warm_start: bool) -> None:
    problems = series(7, 20)
    problems[8].gradient[3] = np.nan
    problems[12].lower[7], problems[12].upper[7] = 1e4, np.inf  # cannot be reached
    solver = make_solver(name, SIZE, SolverOptions(warm_start=warm_start))
    runs = []
    for _ in range(3):
        runs.append([answer_bytes(solver.solve(p)) for p in problems])
        solver.reset()
    assert runs[0] == runs[1] == runs[2]


def answer_bytes(solution: QpSolution) -> bytes:
    return solution.x.tobytes() + solution.status.encode() + str(solution.iterations).encode()


def test_daqp_without_warm_start_forgets_what_it_saw() -> None:
    problems = series(8, 12)
    solver = make_solver("daqp", SIZE, SolverOptions(warm_start=False))
    for p in problems:
        fresh = make_solver("daqp", SIZE, SolverOptions(warm_start=False)).solve(p)
        assert solver.solve(p).x.tobytes() == fresh.x.tobytes()


def unreachable_row(p: QpProblem) -> None:
    p.matrix[9], p.lower[9], p.upper[9] = p.matrix[8], 3.0, np.inf
    p.lower[8], p.upper[8] = -np.inf, 2.0


def contradicting_equalities(p: QpProblem) -> None:
    p.matrix[1] = p.matrix[0]
    p.lower[1] = p.upper[1] = p.upper[0] + 1.0


def row_against_bounds(p: QpProblem) -> None:
    p.matrix[8] = 1.0
    p.floor[:], p.ceiling[:] = -1.0, 1.0
    p.lower[8], p.upper[8] = 29.0, 40.0


def crossed_sides(p: QpProblem) -> None:
    p.lower[8], p.upper[8] = 1.0, 0.0


def crossed_bounds(p: QpProblem) -> None:
    p.floor[2], p.ceiling[2] = 1.0, 0.0


@pytest.mark.parametrize(
    "spoil",
    [unreachable_row, contradicting_equalities, row_against_bounds, crossed_sides, crossed_bounds],
)
@pytest.mark.parametrize("name", installed_solvers())
def test_infeasible_is_never_called_solved(name: str, spoil: Callable[[QpProblem], None]) -> None:
    good = random_problem(np.random.default_rng(9))
    bad = random_problem(np.random.default_rng(9))
    spoil(bad)
    solver = make_solver(name, SIZE)
    before = solver.solve(good)
    answer = solver.solve(bad)
    assert not answer.ok
    assert np.isnan(answer.x).all()
    if name == "daqp":
        assert answer.status is QpStatus.INFEASIBLE
    if before.ok:
        assert_recovers(solver, good)


def assert_recovers(solver: Solver, good: QpProblem) -> None:
    again = solver.solve(good)
    assert again.ok
    assert residuals(good, again).worst < 1e-5


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["hessian", "gradient", "matrix"])
@pytest.mark.parametrize("name", installed_solvers())
def test_numbers_that_are_none_fail_at_once(name: str, where: str, value: float) -> None:
    good = random_problem(np.random.default_rng(10))
    bad = random_problem(np.random.default_rng(10))
    getattr(bad, where).flat[5] = value
    solver = make_solver(name, SIZE)
    answer = solver.solve(bad)
    assert answer.status is QpStatus.FAILED
    assert answer.iterations == 0
    assert np.isnan(answer.x).all()
    if name not in WEAK:
        assert_recovers(solver, good)


@pytest.mark.parametrize("where", ["lower", "upper", "floor", "ceiling"])
@pytest.mark.parametrize("name", MAIN)
def test_sides_that_are_no_numbers_fail(name: str, where: str) -> None:
    p = random_problem(np.random.default_rng(11))
    getattr(p, where)[4] = np.nan
    assert make_solver(name, SIZE).solve(p).status is QpStatus.FAILED
    p = random_problem(np.random.default_rng(11))
    getattr(p, where)[4] = np.inf if where in ("lower", "floor") else -np.inf
    assert not make_solver(name, SIZE).solve(p).ok


@pytest.mark.parametrize("name", MAIN)
def test_unbounded_and_indefinite_costs_give_no_answer(name: str) -> None:
    p = QpProblem.empty(QpSize(variables=2, rows=1))
    p.hessian[:], p.gradient[:] = -np.eye(2), [1.0, 0.0]
    assert not make_solver(name, p.size).solve(p).ok
    p.hessian[:] = 0.0
    answer = make_solver(name, p.size).solve(p)
    assert not answer.ok or np.abs(answer.x).max() > 1e3


@pytest.mark.parametrize("name", MAIN)
def test_nearly_flat_cost_is_held_by_bounds(name: str) -> None:
    p = QpProblem.empty(QpSize(variables=2, rows=1))
    p.hessian[:], p.gradient[:] = np.eye(2) * 1e-6, [1.0, -1.0]
    p.floor[:], p.ceiling[:] = -50.0, 50.0
    answer = make_solver(name, p.size).solve(p)
    assert answer.ok
    np.testing.assert_allclose(answer.x, [-50.0, 50.0], atol=1e-5)


@pytest.mark.parametrize(
    ("seed", "index", "spread"), [(2, 833, 0.0), (11, 965, 0.0), (13, 79, 2.0), (13, 2977, 2.0)]
)
@pytest.mark.parametrize("name", MAIN)
def test_problems_that_broke_a_solver(name: str, seed: int, index: int, spread: float) -> None:
    """The first is daqp's, from equalities said twice, the others proxsuite's."""
    p = hard_problem(seed, index, spread)
    answer = make_solver(name, SIZE).solve(p)
    assert answer.ok
    assert residuals(p, answer).worst < 1e-5 * (1.0 + np.abs(p.gradient).max())


@pytest.mark.parametrize("fixed", [False, True])
@pytest.mark.parametrize("name", MAIN)
def test_rows_may_turn_into_equalities_and_back(name: str, fixed: bool) -> None:
    """Feet are switched by the sides of rows, in a solver of one size."""
    solver = make_solver(name, SIZE, SolverOptions(fixed_matrices=fixed))
    rng = np.random.default_rng(12)
    problems = series(12, 40, fixed)
    for k, p in enumerate(problems):
        rows = rng.choice(np.arange(10, 28), size=4 * (k // 3 % 3), replace=False)
        inside = make_solver("daqp", SIZE).solve(p).x
        p.lower[rows] = p.upper[rows] = p.matrix[rows] @ inside + 0.01
        answer = solver.solve(p)
        assert answer.ok, (k, answer.status)
        assert residuals(p, answer).worst < 1e-6
        np.testing.assert_allclose(answer.x, make_solver("daqp", SIZE).solve(p).x, atol=1e-6)


@pytest.mark.parametrize("name", MAIN)
def test_few_iterations_are_no_answer(name: str) -> None:
    p = random_problem(np.random.default_rng(13))
    answer = make_solver(name, SIZE, SolverOptions(max_iterations=1)).solve(p)
    assert answer.status is not QpStatus.SOLVED
    assert np.isnan(answer.x).all()


def test_daqp_says_that_it_ran_out_of_iterations() -> None:
    p = random_problem(np.random.default_rng(13))
    p.lower[:6], p.upper[:6] = -np.inf, np.inf
    answer = make_solver("daqp", SIZE, SolverOptions(max_iterations=2)).solve(p)
    assert answer.status is QpStatus.MAX_ITERATIONS


@pytest.mark.parametrize("lie", ["outside", "not finite"])
def test_a_solver_that_lies_is_not_believed(lie: str) -> None:
    class Liar(Solver):
        def _solve(self, problem: QpProblem) -> QpSolution:
            x = np.full(2, 7.0 if lie == "outside" else np.nan)
            return QpSolution(x=x, status=QpStatus.SOLVED)

        def _forget(self) -> None:
            pass

    p = QpProblem.empty(QpSize(variables=2, rows=1))
    liar = Liar(p.size, SolverOptions())
    assert liar.solve(p).ok is (lie == "outside")  # nothing forbids it yet
    p.ceiling[0] = 6.0
    assert liar.solve(p).status is QpStatus.FAILED
    p.ceiling[0], p.matrix[0], p.lower[0] = np.inf, [1.0, 1.0], 14.1
    assert liar.solve(p).status is QpStatus.FAILED


def test_unverified_answers_are_finite_still() -> None:
    class Liar(Solver):
        def _solve(self, problem: QpProblem) -> QpSolution:
            return QpSolution(x=np.array([7.0, problem.gradient[0]]), status=QpStatus.SOLVED)

        def _forget(self) -> None:
            pass

        def _load(self, problem: QpProblem) -> QpStatus | None:
            return None

    p = QpProblem.empty(QpSize(variables=2, rows=1))
    p.ceiling[0] = 6.0
    liar = Liar(p.size, SolverOptions(verify=False))
    assert liar.solve(p).ok
    p.gradient[0] = np.nan
    assert not liar.solve(p).ok


def test_acceptance_is_relative_to_large_sides() -> None:
    class Near(Solver):
        def _solve(self, problem: QpProblem) -> QpSolution:
            return QpSolution(x=problem.ceiling * (1.0 + 5e-6), status=QpStatus.SOLVED)

        def _forget(self) -> None:
            pass

    p = QpProblem.empty(QpSize(variables=1, rows=0))
    p.ceiling[:] = 1e4
    assert Near(p.size, SolverOptions()).solve(p).ok
    assert not Near(p.size, SolverOptions(acceptance=1e-6)).solve(p).ok


def test_unknown_name_lists_the_valid_ones() -> None:
    with pytest.raises(UnknownNameError, match="Did you mean 'proxsuite'") as caught:
        make_solver("proxsuit", SIZE)
    assert set(caught.value.valid) == set(SOLVERS)


def test_missing_package_says_how_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    find = registry.importlib.util.find_spec
    monkeypatch.setattr(
        registry.importlib.util, "find_spec", lambda name: None if name == "clarabel" else find(name)
    )
    with pytest.raises(ConfigurationError, match=r"pip install clarabel\. Installed: .*daqp"):
        make_solver("clarabel", SIZE)
    assert "clarabel" not in installed_solvers()
    assert "clarabel" in SOLVERS


def test_another_size_is_a_programming_error() -> None:
    solver = make_solver("daqp", SIZE)
    with pytest.raises(ConfigurationError, match="was given a problem of"):
        solver.solve(QpProblem.empty(QpSize(variables=28, rows=31)))
    with pytest.raises(ConfigurationError, match="impossible size"):
        make_solver("daqp", QpSize(variables=0, rows=3))


@pytest.mark.parametrize("name", installed_solvers())
def test_problem_without_rows(name: str) -> None:
    p = QpProblem.empty(QpSize(variables=3, rows=0))
    p.gradient[:], p.ceiling[1] = [-1.0, -2.0, 3.0], 0.5
    answer = make_solver(name, p.size).solve(p)
    assert answer.ok
    accuracy = UNCHECKED_GAP if name == "casadi-proxqp" else 1e-6
    np.testing.assert_allclose(answer.x, [1.0, 0.5, -3.0], atol=accuracy)


@pytest.mark.parametrize(
    "wrong", [{"max_iterations": 0}, {"tolerance": 0.0}, {"acceptance": -1.0}, {"tolerance": np.nan}]
)
def test_impossible_options_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(ConfigurationError, match=next(iter(wrong))):
        SolverOptions(**wrong)  # type: ignore[arg-type]
