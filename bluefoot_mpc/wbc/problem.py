"""The whole-body problem as expressions: from state, references and weights to matrices.

Unknowns, scaled so that the solver meets numbers of like size: joint accelerations
in units of `ACCELERATION_UNIT` and, per foot, two tangential and one normal force in
units of `force_unit`. The cost is a weighted least squares of the tasks plus a diagonal
(posture and force share); what binds are rows of torque and friction, and bounds.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.model.symbolic import SymbolicTree, TreeState
from bluefoot_mpc.model.symbolic.algebra import quaternion_matrix
from bluefoot_mpc.wbc.constraints.dynamics import ReducedDynamics, ground_axes
from bluefoot_mpc.wbc.constraints.joints import acceleration_bounds
from bluefoot_mpc.wbc.constraints.torque import torque_bounds
from bluefoot_mpc.wbc.layout import parameter_layout
from bluefoot_mpc.wbc.model import WholeBodyModel
from bluefoot_mpc.wbc.tasks import com_task, foot_task, momentum_task, posture_target, trunk_task

ACCELERATION_UNIT = 100.0
"""rad/s² of a joint per unit of its unknown."""


def force_unit(model: WholeBodyModel) -> float:
    """N per unit of a force's unknown: an even share of the weight."""
    return model.weight / len(model.feet)


def task_count(model: WholeBodyModel) -> int:
    """Rows of the least squares: centre of mass, trunk, momentum, feet."""
    return 9 + 3 * len(model.feet)


def reduced_dynamics(model: WholeBodyModel, given: SimpleNamespace) -> ReducedDynamics:
    """Dynamics in world axes as functions of the unknowns, at the state in `given`."""
    rotation = quaternion_matrix(given.q[3:7])
    gravity = ca.DM(model.pin_model.gravity.linear)
    state = TreeState(
        rotation=rotation, linear=rotation @ given.v[:3], angular=rotation @ given.v[3:6],
        joints=given.q[7:], speeds=given.v[6:], gravity=gravity,
    )  # fmt: skip
    tree = SymbolicTree(model.pin_model, state, model.actuators.armature.tolist())
    feet = [tree.foot(frame) for frame in model.frames]
    return ReducedDynamics(tree, feet, ground_axes(given.ground), gravity)


def assembly_function(model: WholeBodyModel) -> ca.Function:
    """All that changes in the problem, for all feet standing, as one function of the flat parameters.

    Outputs (matrices transposed: CasADi stores columns first, numpy rows first):
    ``rows`` (n, t + 6 + nj) of tasks, base acceleration and torque; ``side`` (t,) right
    side of the tasks; ``base`` (6,) the base's acceleration at x = 0; ``lower`` and ``upper``
    (nj,) of the torque rows; ``bounds`` (n, 4): diagonal of the cost, its linear part,
    lower and upper bounds of x.
    """
    layout = parameter_layout(model)
    vector, given = layout.symbols()
    dynamics = reduced_dynamics(model, given)
    rotation = quaternion_matrix(given.q[3:7])
    matrix, side = _least_squares(model, dynamics, rotation, given)
    base = dynamics.base(rotation)
    torque = dynamics.torque
    lowest, highest = torque_bounds(given.torque, given.strength, model.actuators.back_emf, given.v[6:])
    units = _units(model)
    rows = ca.vertcat(matrix, base.matrix, torque.matrix)
    rows = ca.horzcat(*[units[j] * rows[:, j] for j in range(len(units))])
    outputs = {
        "rows": rows.T,
        "side": side,
        "base": base.constant,
        "lower": lowest - torque.constant,
        "upper": highest - torque.constant,
        "bounds": _bounds(model, given, units),
    }
    return _function("whole_body", {"parameters": vector}, outputs)


def check_function(model: WholeBodyModel) -> ca.Function:
    """Inverse dynamics of a plan, by another algorithm than the problem's.

    Inputs: ``q``, ``v``, ``ground`` (3,) normal, ``acceleration`` (nv,) Pinocchio's v̇ and
    ``force`` (3 k,) N in the ground's axes. Outputs: ``torque`` (nj,) N·m, ``residual`` (6,)
    N and N·m that the base lacks, ``force`` (3 k,) N world axes, ``com`` (3,) m/s², acceleration of
    the centre of mass, ``feet`` (3 k,) m/s², accelerations of the foot points.
    """
    pin_model, count = model.pin_model, len(model.feet)
    q, v = ca.SX.sym("q", pin_model.nq), ca.SX.sym("v", pin_model.nv)
    ground, force = ca.SX.sym("ground", 3), ca.SX.sym("force", 3 * count)
    change = ca.SX.sym("acceleration", pin_model.nv)
    rotation = quaternion_matrix(q[3:7])
    gravity = ca.DM(pin_model.gravity.linear)
    state = TreeState(
        rotation=rotation, linear=rotation @ v[:3], angular=rotation @ v[3:6], joints=q[7:], speeds=v[6:],
        gravity=gravity, linear_acceleration=rotation @ change[:3],
        angular_acceleration=rotation @ change[3:6], accelerations=change[6:],
    )  # fmt: skip
    tree = SymbolicTree(pin_model, state)
    feet = [tree.foot(frame) for frame in model.frames]
    axes = ground_axes(ground)
    pushes = [axes @ force[3 * i : 3 * i + 3] for i in range(count)]
    linear, angular = tree.linear_bias, tree.angular_bias
    torque = tree.joint_bias + ca.DM(model.actuators.armature) * change[6:]
    for foot, push in zip(feet, pushes, strict=True):
        linear = linear - push
        angular = angular - ca.cross(foot.position - tree.com, push)
        torque = torque - foot.jacobian.T @ push
    outputs = {
        "torque": torque,
        "residual": ca.vertcat(linear, angular),
        "force_in_world": ca.vertcat(*pushes),
        "com": tree.linear_bias / tree.mass + gravity,
        "feet": ca.vertcat(*[foot.drift for foot in feet]),
    }
    inputs = {"q": q, "v": v, "ground": ground, "acceleration": change, "force": force}
    return _function("whole_body_check", inputs, outputs)


def _least_squares(
    model: WholeBodyModel, dynamics: ReducedDynamics, rotation: Any, given: SimpleNamespace
) -> tuple[Any, Any]:
    inertia = model.mass * model.size**2
    tasks = [
        com_task(dynamics, given),
        trunk_task(dynamics, rotation @ given.v[3:6], given),
        momentum_task(dynamics, inertia, given),
        *[foot_task(dynamics, index, given) for index in range(len(model.feet))],
    ]
    weighted = [task.weighted() for task in tasks]
    return ca.vertcat(*[matrix for matrix, _ in weighted]), ca.vertcat(*[side for _, side in weighted])


def _bounds(model: WholeBodyModel, given: SimpleNamespace, units: Any) -> Any:
    """(n, 4) diagonal cost, linear cost, lower and upper bound of every unknown, in its unit."""
    feet, joints = len(model.feet), model.joints
    lowest, highest = acceleration_bounds(given.q[7:], given.v[6:], given, given.horizon)
    share = given.force_cap / ca.fmax(ca.sum1(given.force_cap), 1e-9)
    ratio = force_unit(model) / model.weight
    push = given.force_weight * ratio * ratio
    pushes, shares, floors, caps = [], [], [], []
    for foot in range(feet):
        pushes += [push] * 3
        shares += [0.0, 0.0, -push * share[foot] / ratio]
        floors += [-ca.inf, -ca.inf, 0.0]
        caps += [ca.inf, ca.inf, given.force_cap[foot] / force_unit(model)]
    unit = units[:joints]
    weight = given.posture_weight * unit * unit
    return ca.horzcat(
        ca.vertcat(weight, *pushes),
        ca.vertcat(-weight * posture_target(given) / unit, *shares),
        ca.vertcat(lowest / unit, *floors),
        ca.vertcat(highest / unit, *caps),
    )


def _units(model: WholeBodyModel) -> Any:
    feet = len(model.feet)
    return np.concatenate([np.full(model.joints, ACCELERATION_UNIT), np.full(3 * feet, force_unit(model))])


def _function(name: str, inputs: dict[str, Any], outputs: dict[str, Any]) -> ca.Function:
    dense = [ca.densify(ca.SX(value)) for value in outputs.values()]
    return ca.Function(name, list(inputs.values()), dense, list(inputs), list(outputs), {"cse": True})
