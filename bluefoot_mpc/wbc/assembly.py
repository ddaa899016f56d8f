"""The problem's numbers: parameters in, matrices out, in arrays that are made once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg.lapack import dposv

from bluefoot_mpc.codegen import CodegenConfig, compiled, made_once
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.qp import QpProblem
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.wbc.buffers import Buffers
from bluefoot_mpc.wbc.config import WholeBodyConfig
from bluefoot_mpc.wbc.constraints.friction import SIDES, friction_rows
from bluefoot_mpc.wbc.inputs import WholeBodyInputs
from bluefoot_mpc.wbc.layout import input_sizes, parameter_layout
from bluefoot_mpc.wbc.model import WholeBodyModel
from bluefoot_mpc.wbc.problem import BASE, assembly_function, plan_function, plan_layout, task_count

_NO_LIMIT = 1e9  # finite stand-in for "unlimited"
_NEVER = 1e3  # s, until a lift-off that is not scheduled
_LEAST_RAMP = 1e-6  # s, stands for no ramp at all


@dataclass(frozen=True, slots=True, eq=False)
class Stance:
    """The problem of one set of standing feet; views and arrays that live as long as it does.

    Attributes:
        problem: what the solver gets.
        feet: number of standing feet.
        columns: (n,) which unknowns of all feet these are; None: all.
        rows: (t + 6 + nj, n) tasks, base acceleration, torque, per unit of x.
        bounds: (4, n) diagonal cost, linear cost, lower and upper bound.
        tasks: view: the least squares' matrix.
        base: view: base acceleration.
        diagonal: view of the problem's cost.
    """

    problem: QpProblem
    feet: int
    columns: Any
    rows: FloatArray
    bounds: FloatArray
    tasks: FloatArray
    base: FloatArray
    diagonal: FloatArray


class Assembly:
    """Fills the problem of a tick and reads its answer.

    Attributes:
        parameters: (p,) flat parameters.
        given: named views of them.
        flat_plan: (m,) the plan of the last answer.
        plan: named views of it (`problem.plan_layout`).
    """

    def __init__(self, model: WholeBodyModel, config: WholeBodyConfig) -> None:
        self._model, self._config = model, config
        layout, answer = parameter_layout(model), plan_layout(model)
        self.parameters, self.flat_plan = np.zeros(layout.size), np.zeros(answer.size)
        self.given: Any = layout.cut(self.parameters)
        self.plan: Any = answer.cut(self.flat_plan)
        sizes = input_sizes(model)
        self._inputs = layout.part(self.parameters, tuple(sizes))
        self._default = {name: np.zeros(size) for name, size in sizes.items()}
        self._default["remaining"].fill(_NEVER)
        self._default["ground"][2] = 1.0
        self._allocate()
        self._configure()
        every = np.ones(len(model.feet), dtype=np.bool_)
        self._stances = {every.tobytes(): self._new_stance(every)}
        outputs = [
            self._rows[: self._written], self._side, self._base, self._lower[: model.joints],
            self._upper[: model.joints], self._bounds, self._loaded,
        ]  # fmt: skip
        assemble, evaluate = _functions(model, config.codegen)
        self._assemble = Buffers(assemble, [self.parameters], outputs)
        inputs = [self.parameters, self._x, self._acceleration, self._bounds]
        self._evaluate = Buffers(evaluate, inputs, [self.flat_plan])
        self.reset()

    def reset(self) -> None:
        """Every foot carries fully."""
        self._loaded.fill(1.0)

    def fill(self, inputs: WholeBodyInputs, dt: float) -> bool:
        """Take the state and references of a tick; False where a number of them is not finite.

        Args:
            inputs: of the tick.
            dt: s, of the tick.

        Raises:
            ConfigurationError: an array has not the length of this robot.
        """
        parts = self._parts(inputs)
        try:
            np.concatenate(parts, out=self._inputs)
        except ValueError as error:
            raise ConfigurationError(self._misfit(parts)) from error
        given, voltage = self.given, inputs.voltage
        share = 1.0 if voltage is None else voltage / self._model.actuators.nominal_voltage
        given.strength[0] = strength = self._config.torque_share * share * inputs.derating
        given.horizon[0] = self._config.limit_horizon * dt
        given.dt[0] = dt
        given.loaded[:] = self._loaded
        # One product finds every NaN and inf; a number too large to square is as useless.
        return math.isfinite(self._inputs.dot(self._inputs) + strength + dt)

    def assemble(self, contact: BoolArray) -> Stance:
        """Evaluate the functions and fill the problem of the feet that stand."""
        self._assemble.call()
        stance = self.stance(contact)
        if stance.columns is not None:
            self._rows[: self._written].take(stance.columns, axis=1, out=stance.rows, mode="clip")
            self._bounds.take(stance.columns, axis=1, out=stance.bounds, mode="clip")
        hessian, gradient = stance.problem.hessian, stance.problem.gradient
        # The copy keeps numpy off its slower path for a matrix times its own transpose.
        np.dot(stance.tasks.T, stance.tasks.copy(), out=hessian)
        np.add(stance.diagonal, stance.bounds[0], out=stance.diagonal)
        np.dot(self._side, stance.tasks, out=gradient)
        np.add(gradient, stance.bounds[1], out=gradient)
        return stance

    def stance(self, contact: BoolArray) -> Stance:
        """Where the problem of these standing feet is kept."""
        key = contact.tobytes()
        stance = self._stances.get(key)
        if stance is None:
            stance = self._stances[key] = self._new_stance(contact)
        return stance

    def free_optimum(self, stance: Stance) -> FloatArray | None:
        """(n,) the optimum without rows and bounds: where it breaks none of them, it is *the* optimum."""
        # By rows or by columns is the same for a symmetric matrix, and LAPACK wants columns.
        _, x, failed = dposv(stance.problem.hessian.T, stance.problem.gradient)
        return None if failed else np.negative(x, out=x)

    def evaluate(self, stance: Stance, x: FloatArray) -> None:
        """Write the plan that an answer means to `plan`."""
        acceleration = self._acceleration
        np.dot(stance.base, x, out=acceleration)
        np.add(acceleration, self._base, out=acceleration)
        if stance.columns is None:
            self._x[:] = x
        else:
            self._x.fill(0.0)
            self._x[stance.columns] = x
        self._evaluate.call()

    def _parts(self, i: WholeBodyInputs) -> list[Any]:
        """The caller's arrays in the order of the parameters, flat, with what was left out."""
        d = self._default
        return [
            i.q, i.v, i.contact, i.com,
            d["com_velocity"] if i.com_velocity is None else i.com_velocity,
            d["com_acceleration"] if i.com_acceleration is None else i.com_acceleration,
            i.trunk,
            d["trunk_velocity"] if i.trunk_velocity is None else i.trunk_velocity,
            d["trunk_acceleration"] if i.trunk_acceleration is None else i.trunk_acceleration,
            i.foot.reshape(-1),
            d["foot_velocity"] if i.foot_velocity is None else i.foot_velocity.reshape(-1),
            d["foot_acceleration"] if i.foot_acceleration is None else i.foot_acceleration.reshape(-1),
            i.q[7:] if i.posture is None else i.posture,
            d["posture_velocity"] if i.posture_velocity is None else i.posture_velocity,
            d["posture_acceleration"] if i.posture_acceleration is None else i.posture_acceleration,
            d["remaining"] if i.remaining is None else i.remaining,
            d["ground"] if i.ground is None else i.ground,
        ]  # fmt: skip

    def _misfit(self, parts: list[Any]) -> str:
        pairs = zip(self._default.items(), parts, strict=True)
        wrong = [
            f"{name} has {np.size(part)} values, not {len(d)}"
            for (name, d), part in pairs
            if np.size(part) != len(d)
        ]
        return f"whole-body inputs do not fit the robot: {'; '.join(wrong) or 'arrays must be flat'}"

    def _allocate(self) -> None:
        model, feet = self._model, len(self._model.feet)
        joints, full = model.joints, model.joints + 3 * feet
        self._tasks = task_count(model)
        self._written = self._tasks + BASE + joints  # rows that change; friction follows
        self._rows, self._bounds = np.zeros((self._written + SIDES * feet, full)), np.zeros((4, full))
        self._side, self._base = np.zeros(self._tasks), np.zeros(BASE)
        # Sides of the torque rows, then those of friction; the shorter problems use their beginning.
        self._lower, self._upper = np.full(joints + SIDES * feet, -np.inf), np.zeros(joints + SIDES * feet)
        self._loaded, self._x, self._acceleration = np.zeros(feet), np.zeros(full), np.zeros(BASE)

    def _new_stance(self, contact: BoolArray) -> Stance:
        joints, feet = self._model.joints, int(np.count_nonzero(contact))
        size, count = joints + 3 * feet, joints + SIDES * feet
        whole = feet == len(self._model.feet)
        rows = self._rows if whole else np.zeros((self._written + SIDES * feet, size))
        bounds = self._bounds if whole else np.zeros((4, size))
        rows[self._written :] = friction_rows(joints, feet, self._config.friction)
        problem = QpProblem(
            hessian=np.eye(size), gradient=np.zeros(size), matrix=rows[self._tasks + BASE :],
            lower=self._lower[:count], upper=self._upper[:count], floor=bounds[2], ceiling=bounds[3],
        )  # fmt: skip
        kept = np.concatenate([np.ones(joints, dtype=np.bool_), np.repeat(contact, 3)])
        return Stance(
            problem=problem, feet=feet, columns=None if whole else np.flatnonzero(kept),
            rows=rows[: self._written], bounds=bounds, tasks=rows[: self._tasks],
            base=rows[self._tasks : self._tasks + BASE], diagonal=problem.hessian.reshape(-1)[:: size + 1],
        )  # fmt: skip

    def _configure(self) -> None:
        given, config, actuators = self.given, self._config, self._model.actuators
        weights, gains = config.weights, config.gains
        for name in ("com", "trunk", "momentum", "contact", "swing", "posture", "force"):
            getattr(given, f"{name}_weight")[:] = getattr(weights, name)
        for name in ("com", "trunk", "momentum", "contact", "swing", "posture"):
            getattr(given, f"{name}_gain")[:] = getattr(gains, name)
        given.force_limit[:] = config.force_limit * self._model.weight
        given.ramp[:] = max(config.force_ramp, _LEAST_RAMP)
        given.torque[:] = np.minimum(actuators.torque, _NO_LIMIT)
        given.back_emf[:] = actuators.back_emf
        given.speed[:] = np.minimum(config.speed_share * actuators.speed, _NO_LIMIT)
        given.lower[:] = np.maximum(actuators.lower + config.joint_margin, -_NO_LIMIT)
        given.upper[:] = np.minimum(actuators.upper - config.joint_margin, _NO_LIMIT)
        given.braking[:] = config.joint_acceleration
        given.friction[:] = config.friction


def _functions(model: WholeBodyModel, codegen: bool) -> tuple[Any, Any]:
    """Assembly and plan of a robot, built once per process and robot."""
    build = CodegenConfig(enabled=codegen)

    def make() -> tuple[Any, Any]:
        return compiled(assembly_function(model), build), compiled(plan_function(model), build)

    actuators = model.actuators
    shape = (model.frames, actuators.armature.tobytes(), model.mass, model.weight, model.size)
    functions: tuple[Any, Any] = made_once(make, "whole body", codegen, model.pin_model.saveToString(), shape)
    return functions
