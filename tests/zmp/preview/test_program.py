"""The reduced program against the whole one, written down plainly."""

import dataclasses

import numpy as np
import pytest

from bluefoot_mpc.qp import QpSize, QpSolution, QpStatus, SolverOptions, make_solver
from bluefoot_mpc.zmp.preview import PreviewConfig
from bluefoot_mpc.zmp.preview.model import preview_maps
from bluefoot_mpc.zmp.preview.problem import PreviewProblem
from bluefoot_mpc.zmp.preview.program import PreviewProgram, sizes
from tests.zmp.preview import scenes
from tests.zmp.preview.straightforward import program, rollout

CONFIG = PreviewConfig(samples=12, interval=0.08, rows=(6, 20))


class Bench:
    """A problem and its program."""

    def __init__(self, config=CONFIG, solver="daqp", solvers=None):
        self.config = config
        maps = preview_maps(config)
        self.problem = PreviewProblem(config, maps)
        if solvers is None:
            options = SolverOptions(warm_start=False)
            solvers = tuple(make_solver(solver, size, options) for size in sizes(config))
        self.program = PreviewProgram(config, maps, solvers)
        self.optimum = self.problem.path_map(maps.optimum)

    def take(self, inputs, start):
        assert self.problem.read(inputs, start)
        np.matmul(self.optimum, self.problem.given, out=self.problem.path)
        return self.problem.evaluate()

    def whole(self):
        n = self.config.samples
        offsets = np.concatenate([self.problem._offsets.ravel(), self.problem._offsets[n - 1]])
        return program(self.config, self.problem.given, self.problem.levers, self.problem.normals, offsets)


def cases(config, count, seed=0, scale=1.5):
    rng = np.random.default_rng(seed)
    for k in range(count):
        schedule = (scenes.walk if k % 3 else scenes.trot)(config, rng.random())
        height = config.height * rng.uniform(0.8, 1.3, size=config.samples) if k % 2 else None
        yield scenes.inputs(schedule, height=height), scenes.state(rng, scale)


@pytest.fixture(scope="module")
def bench():
    return Bench()


def test_the_optimum_is_that_of_the_whole_problem(bench):
    options = SolverOptions(warm_start=False, max_iterations=2000)
    whole_size = QpSize(variables=2 * 12 + 8 * 12 + 4, rows=8 * 12 + 4)
    solver, met = make_solver("daqp", whole_size, options), []
    for inputs, start in cases(CONFIG, 60, scale=3.0):
        met.append(int((bench.take(inputs, start) < 0.0).sum()))
        assert bench.program.solve(bench.problem).solved
        whole = bench.whole()
        # Prices of 1e4 and jerks of 1e-7 in one hessian: scale what is unknown.
        scale = 1.0 / np.sqrt(np.diag(whole.hessian))
        scaled = dataclasses.replace(
            whole,
            hessian=1e6 * scale[:, None] * whole.hessian * scale,
            gradient=1e6 * scale * whole.gradient,
            matrix=whole.matrix * scale,
        )
        solution = solver.solve(scaled)
        assert solution.ok
        jerks = (scale * solution.x)[:24].reshape(2, 12).T
        positions = rollout(CONFIG)[1][:12] @ (jerks - bench.problem.path[36:])
        assert np.abs(positions).max() < 1e-6
    assert max(met) > CONFIG.rows[0] > 3 > min(met)


def test_kkt_conditions_hold_for_the_whole_problem(bench):
    for inputs, start in cases(CONFIG, 60, seed=1):
        bench.take(inputs, start)
        assert bench.program.solve(bench.problem).solved
        whole = bench.whole()
        jerks = bench.problem.path[36:].T.ravel()
        slack = np.maximum(0.0, -bench.problem.residuals)
        x = np.concatenate([jerks, slack])
        # The price of a slack is the multiplier of its row.
        multiplier = whole.hessian.diagonal()[24:] * slack
        scale = np.sqrt(whole.hessian.diagonal())
        stationary = (whole.hessian @ x + whole.gradient + whole.matrix.T @ multiplier) / scale
        assert np.abs(stationary).max() < 1e-6
        assert (whole.matrix @ x - whole.upper).max() < 1e-9


def test_rows_of_the_problem_are_those_of_the_path(bench):
    for inputs, start in cases(CONFIG, 6, seed=2):
        residuals = bench.take(inputs, start)
        whole = bench.whole()
        x = np.concatenate([bench.problem.path[36:].T.ravel(), np.zeros(len(residuals))])
        assert whole.upper - whole.matrix @ x == pytest.approx(residuals, abs=1e-9)


@pytest.mark.parametrize("rows", [(1,), (3, 5), (16, 48), (100,), (1000,)])
def test_the_answer_does_not_depend_on_the_sizes(bench, rows):
    other = Bench(dataclasses.replace(CONFIG, rows=rows))
    for inputs, start in cases(CONFIG, 20, seed=3):
        for each in (bench, other):
            each.take(inputs, start)
            assert each.program.solve(each.problem).solved
        assert other.problem.path[:12] == pytest.approx(bench.problem.path[:12], abs=1e-7)


@pytest.mark.parametrize("name", ["proxsuite", "casadi-daqp", "casadi-qpoases"])
def test_the_answer_does_not_depend_on_the_solver(bench, name):
    other = Bench(solver=name)
    for inputs, start in cases(CONFIG, 12, seed=4):
        bench.take(inputs, start)
        assert bench.program.solve(bench.problem).solved
        other.take(inputs, start)
        assert other.program.solve(other.problem).solved
        assert other.problem.path[:12] == pytest.approx(bench.problem.path[:12], abs=1e-5)


def test_one_met_row_gives_the_optimum_by_hand(bench):
    reach = np.tile([0.05, 0.05], (12, 1))
    inputs = scenes.inputs(scenes.walk(CONFIG), reach=reach)
    bench.take(inputs, np.zeros((3, 2)))
    problem = bench.problem
    # Move all walls out but one, which stands 1 mm inside the unconstrained optimum.
    problem._offsets[:] = 10.0
    point = problem.path[5].copy()
    problem._offsets[12 + 5] = np.array([point[0] - 1e-3, 10.0, 10.0, 10.0])
    problem.evaluate()
    assert bench.program.solve(problem).solved
    root = np.vstack([preview_maps(CONFIG).forced @ preview_maps(CONFIG).root])
    response, price = root[5], CONFIG.weights.reach_slack
    multiplier = 1e-3 / (response @ response + 1.0 / price)
    assert problem.path[5, 0] == pytest.approx(point[0] - multiplier * response @ response, abs=1e-9)
    assert -problem.residuals.min() == pytest.approx(multiplier / price, rel=1e-6)


def test_without_a_solver_the_approximate_plan_is_near(bench):
    gained = []
    for inputs, start in cases(CONFIG, 40, seed=5, scale=0.5):
        bench.take(inputs, start)
        assert bench.program.solve(bench.problem).solved
        best, least = bench.problem.path[:12].copy(), bench.problem.residuals.min()
        if bench.take(inputs, start).min() > -1e-3:
            continue
        before = np.abs(bench.problem.path[:12] - best).max()
        result = bench.program.approximate(bench.problem)
        assert result.solved == (bench.problem.residuals.min() > -CONFIG.nearest_violation)
        assert bench.problem.residuals.min() > least - 2e-3
        gained.append(np.abs(bench.problem.path[:12] - best).max() / before)
    assert len(gained) > 20
    assert np.median(gained) < 0.01


@pytest.mark.parametrize("factor", [0.0, 0.9, 1.1, -1.0])
def test_a_wrong_answer_is_noticed(factor):
    class Wrong:
        def __init__(self, size):
            self.solver = make_solver("daqp", size, SolverOptions(warm_start=False))

        def solve(self, problem):
            right = self.solver.solve(problem)
            return dataclasses.replace(right, row_multiplier=factor * right.row_multiplier)

        def reset(self):
            self.solver.reset()

    wrong = Bench(solvers=tuple(Wrong(size) for size in sizes(CONFIG)))
    inputs, start = next(cases(CONFIG, 1))
    assert wrong.take(inputs, start).min() < -1e-3
    assert not wrong.program.solve(wrong.problem).solved


def test_a_failing_solver_leaves_the_unconstrained_optimum():
    def answer(problem):
        return QpSolution(x=np.zeros(problem.size.variables), status=QpStatus.INFEASIBLE, iterations=3)

    solvers = tuple(scenes.BrokenSolver(answer) for _ in sizes(CONFIG))
    broken = Bench(solvers=solvers)
    inputs, start = next(cases(CONFIG, 1))
    residuals = broken.take(inputs, start).copy()
    path = broken.problem.path.copy()
    result = broken.program.solve(broken.problem)
    assert not result.solved
    assert result.iterations == 3 * sum(solver.calls for solver in solvers) > 0
    assert np.array_equal(broken.problem.path, path)
    assert np.array_equal(broken.problem.residuals, residuals)
