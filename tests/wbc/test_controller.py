"""Plans of the whole-body controller: forces, limits, tasks, dynamics, backends."""

import copy
import dataclasses
import functools

import numpy as np
import pytest

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.qp import QpProblem, SolverOptions, make_solver, residuals
from bluefoot_mpc.types import Fallback
from bluefoot_mpc.wbc import WholeBodyConfig, WholeBodyController, WholeBodyWeights
from bluefoot_mpc.wbc.samples import Spread, sample_inputs, sample_problems
from tests.wbc.states import DT, OTHERS, bluefoot, dynamics_error, foot_points, other, standing

SOLVERS = ("daqp", "proxsuite")


@functools.cache
def shared(name: str) -> WholeBodyController:
    # The virtual machine for the other robots: these tests need no second build of C.
    model = bluefoot() if name == "bluefoot" else other(name)
    return WholeBodyController(model, WholeBodyConfig(codegen=name == "bluefoot"))


def controller(name: str = "bluefoot") -> WholeBodyController:
    made = shared(name)
    made.reset()
    return made


@functools.cache
def some_problems() -> list[QpProblem]:
    problems = sample_problems(bluefoot(), 4)
    return [copy.deepcopy(next(problems)) for _ in range(30)]


def robots() -> list[str]:
    return ["bluefoot", *OTHERS]


@pytest.mark.parametrize("name", robots())
def test_standing_forces_carry_the_weight(name: str) -> None:
    made = controller(name)
    plan = made.step(standing(made.model), DT)
    assert plan.status is Fallback.SOLVED
    assert plan.reason == ""
    total = plan.foot_force.sum(axis=0)
    np.testing.assert_allclose(total, [0.0, 0.0, made.model.weight], atol=1e-3 * made.model.weight)
    np.testing.assert_allclose(plan.com_acceleration, 0.0, atol=1e-2)
    np.testing.assert_allclose(plan.foot_acceleration, 0.0, atol=1e-2)
    assert dynamics_error(made.model, standing(made.model), plan) < 1e-8


def test_symmetric_stance_has_symmetric_forces() -> None:
    plan = controller().step(standing(bluefoot()), DT)
    left, right = plan.foot_force[[0, 2]], plan.foot_force[[1, 3]]
    np.testing.assert_allclose(left * [1.0, -1.0, 1.0], right, atol=1e-6)
    torque = plan.torque.reshape(4, 4)
    np.testing.assert_allclose(torque[[0, 2], 1:], torque[[1, 3], 1:], atol=1e-6)


@pytest.mark.parametrize("contact", [[1, 1, 1, 0], [1, 0, 0, 1], [0, 1, 1, 0], [1, 0, 0, 0], [0, 0, 0, 0]])
def test_any_set_of_feet_may_stand(contact: list[int]) -> None:
    inputs = standing(bluefoot(), contact)
    plan = controller().step(inputs, DT)
    assert plan.status is Fallback.SOLVED
    assert not plan.foot_force[~inputs.contact].any()
    assert (plan.foot_force[:, 2] >= -1e-9).all()
    assert dynamics_error(bluefoot(), inputs, plan) < 1e-8
    assert ("no foot stands" in plan.reason) == (sum(contact) == 0)


@pytest.mark.parametrize("name", robots())
def test_dynamics_hold_at_random_states(name: str) -> None:
    made, rng = controller(name), np.random.default_rng(11)
    for k in range(60 if name == "bluefoot" else 10):
        inputs = sample_inputs(made.model, rng, Spread().scaled(10.0 ** rng.uniform(-2.0, 0.3)))
        plan = made.step(inputs, DT)
        assert plan.status <= Fallback.NEAREST, (k, plan.reason)
        if plan.status is Fallback.SOLVED:
            scale = max(1.0, made.model.weight / 20.0)
            assert dynamics_error(made.model, inputs, plan) < 1e-8 * scale
            assert plan.residual < 1e-8 * scale


@pytest.mark.parametrize("name", robots())
def test_limits_hold_at_random_states(name: str) -> None:
    made, rng = controller(name), np.random.default_rng(12)
    actuators, config = made.model.actuators, made.config
    weight = made.model.weight
    for _ in range(60 if name == "bluefoot" else 10):
        inputs = dataclasses.replace(sample_inputs(made.model, rng), ground=None)
        plan = made.step(inputs, DT)
        if plan.status is not Fallback.SOLVED:
            continue
        force = plan.foot_force
        assert (force[:, 2] >= -1e-6 * weight).all()
        assert (np.abs(force[:, :2]).max(axis=1) <= config.friction * force[:, 2] + 1e-6 * weight).all()
        strength = inputs.voltage / actuators.nominal_voltage * inputs.derating
        limit, lost = strength * actuators.torque, actuators.back_emf * inputs.v[6:]
        assert (plan.torque <= limit - lost + 1e-5 * limit).all()
        assert (plan.torque >= -limit - lost - 1e-5 * limit).all()
        assert (np.abs(plan.acceleration[6:]) <= config.joint_acceleration + 1e-6).all()


def test_forces_stay_in_the_pyramid_of_a_slope() -> None:
    slope = np.deg2rad(20.0)
    normal = np.array([np.sin(slope), 0.0, np.cos(slope)])
    made = WholeBodyController(bluefoot(), WholeBodyConfig(friction=0.2, codegen=False))
    plan = made.step(standing(bluefoot(), ground=normal), DT)
    pressing = plan.foot_force @ normal
    tangent = plan.foot_force - np.outer(pressing, normal)
    # 0.2 is less than the slope: the robot would slide, and the plan says so.
    assert (np.linalg.norm(tangent, axis=1) <= np.sqrt(2.0) * 0.2 * pressing + 1e-6).all()
    assert plan.com_acceleration[0] > 0.5
    flat = made.step(standing(bluefoot()), DT)
    assert abs(flat.com_acceleration[0]) < 1e-2


def test_torques_saturate_and_say_so() -> None:
    """A twentieth of the torque cannot carry the robot on two legs: the plan stays inside and sinks."""
    plan = controller().step(standing(bluefoot(), [1, 0, 0, 1], derating=0.05), DT)
    assert plan.status is Fallback.SOLVED
    assert np.abs(plan.torque).max() <= 0.075 + 1e-6
    assert plan.saturated.any()
    assert plan.com_acceleration[2] < -0.5
    np.testing.assert_array_equal(plan.saturated, np.abs(plan.torque) > 0.075 - 1e-5)


def test_a_swing_foot_follows_its_acceleration() -> None:
    inputs = standing(bluefoot(), [0, 1, 1, 1])
    wanted = np.zeros((4, 3))
    wanted[0] = [1.0, -0.5, 3.0]
    com = inputs.com + 0.0
    com[:2] += 0.3 * (foot_points(bluefoot(), inputs.q)[3, :2] - com[:2])  # inside the three feet
    q = inputs.q.copy()
    plan = controller().step(dataclasses.replace(inputs, q=q, foot_acceleration=wanted), DT)
    np.testing.assert_allclose(plan.foot_acceleration[0], wanted[0], atol=0.1)
    np.testing.assert_allclose(plan.foot_acceleration[1:], 0.0, atol=0.05)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_centre_of_mass_is_accelerated(axis: int) -> None:
    wanted = np.zeros(3)
    wanted[axis] = 0.5
    plan = controller().step(standing(bluefoot(), com_acceleration=wanted), DT)
    np.testing.assert_allclose(plan.com_acceleration, wanted, atol=0.04)
    np.testing.assert_allclose(plan.foot_acceleration, 0.0, atol=0.02)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_the_trunk_is_turned(axis: int) -> None:
    wanted = np.zeros(3)
    wanted[axis] = 3.0
    plan = controller().step(standing(bluefoot(), trunk_acceleration=wanted), DT)
    np.testing.assert_allclose(plan.acceleration[3:6], wanted, atol=0.1)


def test_the_ankle_takes_its_posture() -> None:
    """Four joints move a foot in three directions: what is left follows the posture."""
    base = standing(bluefoot(), [0, 1, 1, 1])
    posture = base.q[7:].copy()
    posture[3] += 0.1
    plan = controller().step(base, DT)
    turned = controller().step(dataclasses.replace(base, posture=posture), DT)
    assert turned.acceleration[9] > plan.acceleration[9] + 1.0
    np.testing.assert_allclose(turned.foot_acceleration[0], plan.foot_acceleration[0], atol=0.1)


def test_a_standing_foot_that_slides_is_braked() -> None:
    q = bluefoot().posture
    v = np.zeros(22)
    v[0] = 0.1
    plan = controller().step(standing(bluefoot(), v=v, com_velocity=np.array([0.1, 0, 0])), DT)
    gain = controller().config.gains.contact
    np.testing.assert_allclose(plan.foot_acceleration[:, 0], -gain * 0.1, atol=0.15)
    assert q is bluefoot().posture


def test_momentum_task_slows_the_spin() -> None:
    made = WholeBodyController(
        bluefoot(),
        WholeBodyConfig(codegen=False, weights=WholeBodyWeights(momentum=(1.0, 1.0, 1.0), trunk=(0, 0, 0))),
    )
    v = np.zeros(22)
    v[5] = 1.0
    plan = made.step(standing(bluefoot(), [1, 0, 0, 1], v=v), DT)
    levers = foot_points(bluefoot(), bluefoot().posture) - standing(bluefoot()).com
    assert np.cross(levers, plan.foot_force).sum(axis=0)[2] < -1e-3


def test_joints_near_their_stop_are_braked() -> None:
    inputs = standing(bluefoot(), [0, 1, 1, 1])
    q, v = inputs.q.copy(), inputs.v.copy()
    q[7], v[6] = bluefoot().actuators.upper[0] - 0.05, 4.0
    plan = controller().step(dataclasses.replace(inputs, q=q, v=v), DT)
    assert plan.acceleration[6] < -100.0


def test_reset_gives_back_the_first_answer_bit_for_bit() -> None:
    made, rng = controller(), np.random.default_rng(8)
    inputs = [sample_inputs(bluefoot(), rng) for _ in range(5)]
    first = [made.step(x, DT) for x in inputs]
    made.reset()
    second = [made.step(x, DT) for x in inputs]
    for a, b in zip(first, second, strict=True):
        assert a.status is b.status
        for name in ("acceleration", "foot_force", "torque", "com_acceleration"):
            np.testing.assert_array_equal(getattr(a, name), getattr(b, name))


def test_a_foot_that_touches_down_takes_its_load_over_the_ramp() -> None:
    """The ramp's memory lives in the controller, and reset makes every foot carry fully."""
    made, down, cap = controller(), standing(bluefoot()), 2.0 * bluefoot().weight
    made.step(standing(bluefoot(), [1, 1, 1, 0]), DT)
    tick = made.config.force_ramp / 10.0
    forces = [made.step(down, tick).foot_force[3, 2] for _ in range(10)]
    assert forces[0] <= 0.1 * cap + 1e-6
    assert forces[0] < forces[-1] - 0.5
    made.step(standing(bluefoot(), [1, 1, 1, 0]), DT)
    made.reset()
    plan = made.step(dataclasses.replace(down, remaining=np.array([1.0, 0.0, 0.0, 1.0])), tick)
    assert plan.foot_force[3, 2] > 0.4 * bluefoot().weight


@pytest.mark.parametrize("name", robots())
def test_the_shortcut_is_the_optimum(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The optimum without limits is only taken where the solver's is the same."""
    made, rng, taken = controller(name), np.random.default_rng(13), 0
    for _ in range(40 if name == "bluefoot" else 10):
        inputs = sample_inputs(made.model, rng, Spread().scaled(10.0 ** rng.uniform(-3.0, -0.5)))
        made.reset()
        short = made.step(inputs, DT)
        if short.status is not Fallback.SOLVED or short.iterations > 0:
            continue
        taken += 1
        with monkeypatch.context() as patch:
            patch.setattr(made, "config", dataclasses.replace(made.config, free_first=False))
            made.reset()
            full = made.step(inputs, DT)
        assert full.iterations > 0
        scale = max(1.0, made.model.weight / 20.0)
        np.testing.assert_allclose(short.torque, full.torque, atol=1e-6 * scale)
        np.testing.assert_allclose(short.foot_force, full.foot_force, atol=1e-5 * scale)
    assert taken >= 3


def test_plans_do_not_share_memory() -> None:
    made = controller()
    first = made.step(standing(bluefoot()), DT)
    kept = first.torque.copy()
    made.step(standing(bluefoot(), [1, 0, 0, 1]), DT)
    np.testing.assert_array_equal(first.torque, kept)


def test_virtual_machine_and_generated_code_agree() -> None:
    slow = WholeBodyController(bluefoot(), WholeBodyConfig(codegen=False))
    rng = np.random.default_rng(9)
    for _ in range(5):
        inputs = sample_inputs(bluefoot(), rng, Spread().scaled(0.3))
        a, b = controller().step(inputs, DT), slow.step(inputs, DT)
        slow.reset()
        np.testing.assert_allclose(a.torque, b.torque, atol=1e-9)
        np.testing.assert_allclose(a.foot_force, b.foot_force, atol=1e-8)


@pytest.mark.parametrize("name", robots())
def test_backends_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made, rng = controller(name), np.random.default_rng(10)
    monkeypatch.setattr(made, "config", dataclasses.replace(made.config, free_first=False))
    sizes = [solver.size for solver in made._solvers]
    solvers = {"daqp": made._solvers}
    solvers["proxsuite"] = [make_solver("proxsuite", n, SolverOptions(warm_start=False)) for n in sizes]
    scale = max(1.0, made.model.weight / 20.0)
    for _ in range(25 if name == "bluefoot" else 8):
        inputs = sample_inputs(made.model, rng, Spread().scaled(10.0 ** rng.uniform(-2.0, 0.0)))
        plans = []
        for backend in SOLVERS:
            monkeypatch.setattr(made, "_solvers", solvers[backend])
            made.reset()
            plans.append(made.step(inputs, DT))
        a, b = plans
        assert a.status is b.status, (a.reason, b.reason)
        if a.status is Fallback.SOLVED:
            np.testing.assert_allclose(a.com_acceleration, b.com_acceleration, atol=1e-4)
            np.testing.assert_allclose(a.torque, b.torque, atol=1e-4 * scale)


@pytest.mark.parametrize("name", SOLVERS)
def test_answers_are_optimal(name: str) -> None:
    solvers, solved = {}, 0
    for problem in some_problems():
        options = SolverOptions(warm_start=False)
        solver = solvers.setdefault(problem.size, make_solver(name, problem.size, options))
        solution = solver.solve(problem)
        if solution.ok:
            solved += 1
            kkt = residuals(problem, solution)
            scale = max(1.0, np.abs(problem.gradient).max())
            assert max(kkt.primal, kkt.dual / scale) < 1e-5
    assert solved > 20


def test_wrong_inputs_are_named() -> None:
    with pytest.raises(ConfigurationError, match="trunk has 3 values, not 4"):
        controller().step(standing(bluefoot(), trunk=np.zeros(3)), DT)
    with pytest.raises(UnknownNameError, match="daqp"):
        WholeBodyController(bluefoot(), WholeBodyConfig(solver="simplex", codegen=False))
    with pytest.raises(ConfigurationError, match="posture"):
        WholeBodyWeights(posture=0.0)
    with pytest.raises(ConfigurationError, match="friction"):
        WholeBodyConfig(friction=0.0)
