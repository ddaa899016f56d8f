"""What stands in when there is no optimum: tested with a solver that fails on purpose."""

import dataclasses
import functools

import numpy as np
import pytest

import bluefoot_mpc.wbc.controller as controller_module
from bluefoot_mpc.qp import QpProblem, QpSize, QpSolution, QpStatus
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.wbc import WholeBodyConfig, WholeBodyController
from bluefoot_mpc.wbc.ladder import nearest_point, static_forces, static_torque
from bluefoot_mpc.wbc.samples import Spread, sample_inputs
from tests.wbc.states import DT, bluefoot, com_of, dynamics_error, foot_points, standing


class Failing:
    """Stands in for a solver: fails on demand, and leaves garbage in x."""

    def __init__(self, real) -> None:
        self.real, self.status = real, QpStatus.MAX_ITERATIONS

    def solve(self, problem: QpProblem) -> QpSolution:
        if self.status is QpStatus.SOLVED:
            return self.real.solve(problem)
        return QpSolution(x=np.full(len(problem.gradient), 1e30), status=self.status, iterations=7)

    def reset(self) -> None:
        self.real.reset()


@functools.cache
def shared() -> WholeBodyController:
    return WholeBodyController(bluefoot())


def fresh() -> WholeBodyController:
    made = shared()
    made.reset()
    return made


@pytest.fixture
def broken(monkeypatch: pytest.MonkeyPatch) -> WholeBodyController:
    """A controller whose solvers all fail until told otherwise."""
    made = fresh()
    monkeypatch.setattr(made, "config", WholeBodyConfig(free_first=False))
    monkeypatch.setattr(made, "_solvers", [Failing(solver) for solver in made._solvers])
    return made


def work(made: WholeBodyController, status: QpStatus = QpStatus.SOLVED) -> None:
    for solver in made._solvers:
        solver.status = status


def sane(plan, model=None) -> None:
    model = model or bluefoot()
    for name in ("acceleration", "foot_force", "torque", "com_acceleration", "foot_acceleration"):
        assert np.isfinite(getattr(plan, name)).all(), name
    assert (np.abs(plan.torque) <= 1.5 * 1.05 + 0.243 * 20.0).all()
    assert (plan.foot_force[:, 2] >= 0.0).all()


@pytest.mark.parametrize("status", [QpStatus.MAX_ITERATIONS, QpStatus.INFEASIBLE, QpStatus.FAILED])
def test_nearest_point_stands_in_for_a_solver_that_fails(
    broken: WholeBodyController, status: QpStatus
) -> None:
    work(broken, status)
    inputs = standing(bluefoot())
    plan = broken.step(inputs, DT)
    assert plan.status is Fallback.NEAREST
    assert status.value in plan.reason
    sane(plan)
    np.testing.assert_allclose(plan.foot_force.sum(axis=0), [0.0, 0.0, bluefoot().weight], atol=1e-2)
    assert dynamics_error(bluefoot(), inputs, plan) < 1e-8


def test_quiet_standing_needs_no_solver(broken: WholeBodyController, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the optimum without limits keeps them, no solver is asked."""
    monkeypatch.setattr(broken, "config", WholeBodyConfig())
    plan = broken.step(standing(bluefoot()), DT)
    assert plan.status is Fallback.SOLVED
    assert plan.iterations == 0
    # Two legs at a twentieth of their torque: limits bind.
    assert broken.step(standing(bluefoot(), [1, 0, 0, 1], derating=0.05), DT).status is Fallback.NEAREST


@pytest.mark.parametrize("how", ["wider limits", "nearest point"])
def test_what_stands_in_is_near_the_optimum(
    broken: WholeBodyController, how: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Limits bind in most of these states; both rungs keep to what the optimum does."""
    if how == "nearest point":  # no solver works at all
        real = controller_module.make_solver
        monkeypatch.setattr(controller_module, "make_solver", lambda *given: Failing(real(*given)))
        monkeypatch.setattr(broken, "_spare", {})
    rng, apart = np.random.default_rng(1), []
    for _ in range(40):
        inputs = sample_inputs(bluefoot(), rng, Spread().scaled(0.3))
        broken.reset()
        work(broken)
        best = broken.step(inputs, DT)
        if best.status is not Fallback.SOLVED:
            continue
        broken.reset()
        work(broken, QpStatus.FAILED)
        near = broken.step(inputs, DT)
        assert near.status is Fallback.NEAREST
        assert near.reason.startswith(how)
        sane(near)
        apart.append(np.abs(near.torque - best.torque).max())
    assert len(apart) > 20
    assert np.median(apart) < 0.02
    assert max(apart) < 1.0


def test_infeasible_states_end_on_the_ladder() -> None:
    made, rng = fresh(), np.random.default_rng(2)
    rungs = set()
    for _ in range(150):
        plan = made.step(sample_inputs(bluefoot(), rng, Spread().scaled(6.0)), DT)
        rungs.add(plan.status)
        for name in ("acceleration", "foot_force", "torque"):
            assert np.isfinite(getattr(plan, name)).all()
        assert plan.status is Fallback.SOLVED or plan.reason
    assert rungs == {Fallback.SOLVED, Fallback.NEAREST}


def test_previous_plan_then_stance_then_sit(monkeypatch: pytest.MonkeyPatch) -> None:
    """A state that is not known: the rungs follow each other in time, and recovery is immediate."""
    made = fresh()
    monkeypatch.setattr(made, "config", WholeBodyConfig(shift_time=0.05, stance_time=0.1))
    inputs = standing(bluefoot())
    good = made.step(inputs, DT)
    blind = dataclasses.replace(inputs, q=np.full(23, np.nan))
    plans = [made.step(blind, DT) for _ in range(10)]
    assert [plan.status for plan in plans[:2]] == [Fallback.SHIFTED] * 2
    assert [plan.status for plan in plans[2:7]] == [Fallback.STANCE] * 5
    assert plans[-1].status is Fallback.SIT
    np.testing.assert_array_equal(plans[0].torque, good.torque)
    np.testing.assert_allclose(plans[3].torque, good.torque, atol=0.02)
    for plan in plans:
        sane(plan)
        assert "not finite" in plan.reason
        assert plan.residual == np.inf
    made.reset()
    assert made.step(blind, DT).status is Fallback.STANCE  # the time without a plan starts anew
    assert made.step(inputs, DT).status is Fallback.SOLVED
    assert made.step(blind, DT).status is Fallback.SHIFTED


@pytest.mark.parametrize(
    "field", ["q", "v", "com", "trunk", "foot", "com_acceleration", "posture", "remaining"]
)
def test_nan_anywhere_never_reaches_the_plan(field: str) -> None:
    made = fresh()
    inputs = standing(bluefoot(), com_acceleration=np.zeros(3), posture=bluefoot().posture[7:].copy())
    inputs = dataclasses.replace(inputs, remaining=np.full(4, 0.3))
    value = np.array(getattr(inputs, field), dtype=float)
    value.flat[0] = np.nan
    plan = made.step(dataclasses.replace(inputs, **{field: value}), DT)
    assert plan.status is Fallback.STANCE
    sane(plan)
    plan = made.step(dataclasses.replace(inputs, voltage=np.inf), DT)
    assert plan.status is Fallback.STANCE


def test_shifted_plan_lets_lifted_feet_go() -> None:
    made = fresh()
    inputs = standing(bluefoot())
    made.step(inputs, DT)
    lifted = dataclasses.replace(inputs, v=np.full(22, np.nan), contact=np.array([True, False, True, True]))
    plan = made.step(lifted, DT)
    assert plan.status is Fallback.SHIFTED
    assert not plan.foot_force[1].any()
    assert plan.foot_force[0, 2] > 1.0


def test_blind_in_the_air_asks_for_no_force() -> None:
    made = fresh()
    blind = dataclasses.replace(standing(bluefoot(), [0, 0, 0, 0]), q=np.full(23, np.nan))
    plan = made.step(blind, DT)
    assert plan.status is Fallback.STANCE
    assert not plan.foot_force.any()
    sane(plan)


def test_singular_stance_is_solved() -> None:
    """All feet in one place under the trunk, and legs stretched out: slack, not failure."""
    made = fresh()
    q = bluefoot().posture.copy()
    q[7:] = 0.0
    inputs = dataclasses.replace(standing(bluefoot()), q=q)
    plan = made.step(inputs, DT)
    assert plan.status <= Fallback.NEAREST
    assert np.isfinite(plan.torque).all()
    assert dynamics_error(bluefoot(), inputs, plan) < 1e-8 or plan.status is Fallback.NEAREST


def test_static_forces_balance_the_robot() -> None:
    q = bluefoot().posture.copy()
    q[7] += 0.3
    levers = foot_points(bluefoot(), q) - com_of(bluefoot(), q)
    for contact in ([1, 1, 1, 1], [0, 1, 1, 1]):
        forces = static_forces(bluefoot(), q, np.array(contact, dtype=bool))
        assert forces[:, 2].sum() == pytest.approx(bluefoot().weight)
        moment = np.cross(levers, forces).sum(axis=0)
        if sum(contact) == 4:
            np.testing.assert_allclose(moment, 0.0, atol=1e-9)
        assert not forces[~np.array(contact, dtype=bool)].any()
    still = static_torque(bluefoot(), q, forces)
    assert np.isfinite(still).all()


def test_nearest_point_of_contradicting_rows_lies_between() -> None:
    problem = QpProblem.empty(QpSize(variables=2, rows=2))
    problem.matrix[:] = [[1.0, 0.0], [1.0, 0.0]]
    problem.lower[:], problem.upper[:] = [1.0, -np.inf], [np.inf, -1.0]
    x = nearest_point(problem)
    assert x is not None
    np.testing.assert_allclose(x, 0.0, atol=1e-6)
    problem.hessian[0, 0] = np.nan
    assert nearest_point(problem) is None
