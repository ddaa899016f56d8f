"""The problem's numbers: parameters in, matrices out, in arrays that are made once."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import CodegenConfig, compiled
from bluefoot_mpc.qp.problem import QpProblem, QpSize
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.wbc.config import WholeBodyConfig
from bluefoot_mpc.wbc.constraints.friction import SIDES, friction_rows
from bluefoot_mpc.wbc.inputs import WholeBodyInputs
from bluefoot_mpc.wbc.layout import parameter_layout
from bluefoot_mpc.wbc.model import WholeBodyModel
from bluefoot_mpc.wbc.problem import ACCELERATION_UNIT, assembly_function, force_unit, task_count

_UP = np.array([0.0, 0.0, 1.0])


class Buffers:
    """A CasADi function on numpy arrays that it reads and writes in place, without copies.

    `call` is only good as long as this object lives.

    Args:
        function: dense function.
        inputs: one array per input, in its order; columns first where it is a matrix.
        outputs: likewise.
    """

    def __init__(self, function: ca.Function, inputs: list[FloatArray], outputs: list[FloatArray]) -> None:
        self._kept = (function, inputs, outputs)
        pair: Any = function.buffer()  # CasADi's annotations ask for the size that a memoryview carries
        self._buffer, self.call = pair
        for index, array in enumerate(inputs):
            self._buffer.set_arg(index, array.reshape(-1).data)
        for index, array in enumerate(outputs):
            self._buffer.set_res(index, array.reshape(-1).data)


@dataclass(slots=True)
class Stance:
    """The problem of one number of standing feet, and the parts it was built from.

    Attributes:
        problem: what the solver gets.
        rows: (t + 6 + nj, n) tasks, base acceleration, torque; per unit of x.
        bounds: (4, n) diagonal cost, linear cost, lower and upper bound.
        tasks: (t, n) view: the least squares' matrix.
        plan: (6 + nj, n) view: base acceleration and torque.
        torque: (nj, n) view.
    """

    problem: QpProblem
    rows: FloatArray
    bounds: FloatArray
    tasks: FloatArray
    plan: FloatArray
    torque: FloatArray


class Assembly:
    """Fills the problem of a tick.

    Attributes:
        parameters: (p,) flat parameters; write through `given`.
        given: named views of them.
        base: (6,) base acceleration at x = 0.
        stances: problems by number of standing feet.
        codegen: whether functions are built from C.
    """

    def __init__(self, model: WholeBodyModel, config: WholeBodyConfig) -> None:
        self._model, self._config = model, config
        self.codegen = config.codegen
        layout = parameter_layout(model)
        self.parameters = np.zeros(layout.size)
        self.given: Any = layout.views(self.parameters)
        self._tasks, joints, feet = task_count(model), model.joints, len(model.feet)
        self._full = joints + 3 * feet
        self._rows = np.zeros((self._tasks + 6 + joints, self._full))
        self._bounds = np.zeros((4, self._full))
        self._side, self.base = np.zeros(self._tasks), np.zeros(6)
        self._lower, self._upper = np.zeros(joints), np.zeros(joints)
        function = compiled(assembly_function(model), CodegenConfig(enabled=config.codegen))
        outputs = [self._rows, self._side, self.base, self._lower, self._upper, self._bounds]
        self._function = Buffers(function, [self.parameters], outputs)
        self._call = self._function.call
        self.stances = tuple(self._stance(count) for count in range(feet + 1))
        self._columns: dict[bytes, Any] = {}
        self._configure()
        self._rest = self.parameters.copy()

    def fill(self, inputs: WholeBodyInputs, caps: FloatArray, dt: float) -> bool:
        """Take the state and references of a tick; False where a number of them is not finite.

        Args:
            inputs: of the tick.
            caps: (k,) N, largest normal forces.
            dt: s, of the tick.

        Raises:
            ValueError: an array has not the length of this robot.
        """
        given = self.given
        np.copyto(self.parameters, self._rest)
        given.q[:], given.v[:] = inputs.q, inputs.v
        given.contact[:], given.force_cap[:] = inputs.contact, caps
        given.com[:], given.trunk[:], given.foot[:] = inputs.com, inputs.trunk, inputs.foot.reshape(-1)
        given.posture[:] = inputs.q[7:] if inputs.posture is None else inputs.posture
        for name in _OPTIONAL:
            value = getattr(inputs, name)
            if value is not None:
                getattr(given, name)[:] = value.reshape(-1)
        voltage = inputs.voltage
        share = 1.0 if voltage is None else voltage / self._model.actuators.nominal_voltage
        given.strength[0] = self._config.torque_share * share * inputs.derating
        given.horizon[0] = self._config.limit_horizon * dt
        # One product finds every NaN and inf; a number too large to square is as useless.
        return math.isfinite(self._finite @ self._finite)

    def assemble(self, contact: BoolArray) -> Stance:
        """Evaluate the functions and fill the problem of the feet that stand."""
        self._call()
        stance = self.stances[int(np.count_nonzero(contact))]
        if stance.rows is not self._rows:
            columns = self._chosen(contact)
            np.take(self._rows, columns, axis=1, out=stance.rows, mode="clip")
            np.take(self._bounds, columns, axis=1, out=stance.bounds, mode="clip")
        problem, joints = stance.problem, self._model.joints
        np.matmul(stance.tasks.T, stance.tasks, out=problem.hessian)
        problem.hessian.reshape(-1)[:: problem.hessian.shape[0] + 1] += stance.bounds[0]
        np.matmul(self._side, stance.tasks, out=problem.gradient)
        np.subtract(stance.bounds[1], problem.gradient, out=problem.gradient)
        problem.matrix[:joints] = stance.torque
        problem.lower[:joints] = self._lower
        problem.upper[:joints] = self._upper
        return stance

    def _chosen(self, contact: BoolArray) -> Any:
        """Indices of the unknowns that the standing feet leave."""
        key = contact.tobytes()
        columns = self._columns.get(key)
        if columns is None:
            kept = np.concatenate([np.ones(self._model.joints, dtype=bool), np.repeat(contact, 3)])
            columns = self._columns[key] = np.flatnonzero(kept)
        return columns

    def _stance(self, count: int) -> Stance:
        joints, whole = self._model.joints, count == len(self._model.feet)
        size = joints + 3 * count
        rows = self._rows if whole else np.zeros((len(self._rows), size))
        bounds = self._bounds if whole else np.zeros((4, size))
        problem = QpProblem.empty(QpSize(variables=size, rows=joints + SIDES * count))
        problem.matrix[joints:] = friction_rows(joints, count, self._config.friction)
        problem.upper[joints:] = 0.0
        problem.floor, problem.ceiling = bounds[2], bounds[3]
        return Stance(
            problem=problem, rows=rows, bounds=bounds, tasks=rows[: self._tasks],
            plan=rows[self._tasks :], torque=rows[self._tasks + 6 :],
        )  # fmt: skip

    def _configure(self) -> None:
        given, config, actuators = self.given, self._config, self._model.actuators
        weights, gains = config.weights, config.gains
        for name in ("com", "trunk", "momentum", "contact", "swing", "posture", "force"):
            getattr(given, f"{name}_weight")[:] = getattr(weights, name)
        for name in ("com", "trunk", "momentum", "contact", "swing", "posture"):
            getattr(given, f"{name}_gain")[:] = getattr(gains, name)
        given.ground[:] = _UP
        # Finite stand-ins for "no limit", so that one product can tell whether all inputs are finite.
        given.torque[:] = np.minimum(actuators.torque, _NO_LIMIT)
        given.speed[:] = np.minimum(config.speed_share * actuators.speed, _NO_LIMIT)
        given.lower[:] = np.maximum(actuators.lower + config.joint_margin, -_NO_LIMIT)
        given.upper[:] = np.minimum(actuators.upper - config.joint_margin, _NO_LIMIT)
        given.braking[:] = config.joint_acceleration
        self._finite = self.parameters[: parameter_layout(self._model).slices["com_weight"].start]


_NO_LIMIT = 1e9
_OPTIONAL = (
    "com_velocity", "com_acceleration", "trunk_velocity", "trunk_acceleration", "foot_velocity",
    "foot_acceleration", "posture_velocity", "posture_acceleration", "ground",
)  # fmt: skip


def unscaled(model: WholeBodyModel, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Joint accelerations (nj,) rad/s² and forces of the standing feet (k, 3) N, ground axes."""
    joints = model.joints
    return ACCELERATION_UNIT * x[:joints], (force_unit(model) * x[joints:]).reshape(-1, 3)
