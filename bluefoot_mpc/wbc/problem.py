"""The whole-body problem as expressions: from state, references and weights to matrices.

Unknowns: joint accelerations (rad/s²) and, per foot, two tangential and one
normal force in units of `force_unit`, so that the solver meets numbers of like
size. The cost is a weighted least squares of the tasks plus a diagonal (posture
and force share); what binds are rows of torque and friction, and bounds.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import casadi as ca

from bluefoot_mpc.model.symbolic import FootTerms, SymbolicTree, TreeState
from bluefoot_mpc.model.symbolic.algebra import quaternion_matrix
from bluefoot_mpc.wbc.constraints.dynamics import ReducedDynamics, ground_axes
from bluefoot_mpc.wbc.constraints.joints import acceleration_bounds
from bluefoot_mpc.wbc.constraints.torque import torque_bounds
from bluefoot_mpc.wbc.constraints.unilateral import force_caps
from bluefoot_mpc.wbc.layout import Layout, parameter_layout
from bluefoot_mpc.wbc.model import WholeBodyModel
from bluefoot_mpc.wbc.tasks import com_task, foot_task, momentum_task, posture_target, trunk_task

BASE = 6
"""Coordinates of the floating base."""


def force_unit(model: WholeBodyModel) -> float:
    """N per unit of a force's unknown: an even share of the weight."""
    return model.weight / len(model.feet)


def task_count(model: WholeBodyModel) -> int:
    """Rows of the least squares: centre of mass, trunk, momentum, feet."""
    return 9 + 3 * len(model.feet)


def reduced_dynamics(model: WholeBodyModel, given: SimpleNamespace) -> ReducedDynamics:
    """Dynamics in world axes as functions of the unknowns, at the state in `given`."""
    tree = SymbolicTree(model.pin_model, _state(model, given), model.actuators.armature.tolist())
    feet = [tree.foot(frame) for frame in model.frames]
    axes = force_unit(model) * ground_axes(given.ground)
    return ReducedDynamics(tree, feet, axes, ca.DM(model.pin_model.gravity.linear))


def assembly_function(model: WholeBodyModel) -> ca.Function:
    """All that changes in the problem, for all feet standing, as one function of the flat parameters.

    Outputs (matrices transposed: CasADi stores columns first, numpy rows first):
    ``rows`` (n, t + 6 + nj): tasks, base acceleration (world axes, at the centre of mass) and
    torque per unit of x; ``side`` (t,) right side of the tasks, negative; ``base`` (6,) that
    acceleration at x = 0; ``lower`` and ``upper`` (nj,) of the torque rows; ``bounds`` (n, 4):
    diagonal of the cost, its linear part, lower and upper bounds of x; ``loaded`` (k,).
    """
    vector, given = parameter_layout(model).symbols()
    dynamics = reduced_dynamics(model, given)
    matrix, side = _least_squares(model, dynamics, given)
    torque, base = dynamics.torque, (dynamics.linear, dynamics.angular)
    lowest, highest = torque_bounds(given.torque, given.strength, given.back_emf, given.v[BASE:])
    bounds, loaded = _bounds(model, given)
    outputs = {
        "rows": ca.vertcat(matrix, *[part.matrix for part in base], torque.matrix).T,
        "side": -side,
        "base": ca.vertcat(*[part.constant for part in base]),
        "lower": lowest - torque.constant,
        "upper": highest - torque.constant,
        "bounds": bounds,
        "loaded": loaded,
    }
    return _function("whole_body", {"parameters": vector}, outputs)


def plan_layout(model: WholeBodyModel) -> Layout:
    """What `plan_function` answers.

    ``acceleration`` Pinocchio's v̇, ``force`` (N, world) of each foot, ``torque`` (N·m), ``com`` and
    ``feet`` accelerations (m/s², world), ``spare`` (N·m) distance of each torque to its
    envelope, ``violation`` by how much rows and bounds are broken at most (of the largest
    torque and acceleration, and of the unit of force; not positive where all hold),
    ``residual`` norm of what the base's equations lack (N, N·m).
    """
    feet = 3 * len(model.feet)
    return Layout(
        {
            "acceleration": model.pin_model.nv, "force": feet, "torque": model.joints, "com": 3,
            "feet": feet, "spare": model.joints, "violation": 1, "residual": 1,
        }
    )  # fmt: skip


def plan_function(model: WholeBodyModel) -> ca.Function:
    """The plan that the unknowns mean, by inverse dynamics: another algorithm than the problem's.

    Inputs: the flat parameters, ``x`` of all feet (0 without contact), ``base`` (6,) its
    acceleration in world axes at the centre of mass, ``bounds`` as `assembly_function` gives
    them. Output: `plan_layout`.
    """
    vector, given = parameter_layout(model).symbols()
    joints, unknowns = model.joints, model.joints + 3 * len(model.feet)
    x, base = ca.SX.sym("x", unknowns), ca.SX.sym("base", BASE)
    bounds = ca.SX.sym("bounds", unknowns, 4)
    rotation = quaternion_matrix(given.q[3:7])
    com = SymbolicTree(model.pin_model, _state(model, given)).com
    linear = base[:3] + ca.cross(com, base[3:])  # at the base's origin
    tree = SymbolicTree(model.pin_model, _state(model, given, (linear, base[3:], x[:joints])))
    feet = [tree.foot(frame) for frame in model.frames]
    axes = force_unit(model) * ground_axes(given.ground)
    pushes = [axes @ x[start : start + 3] for start in range(joints, unknowns, 3)]
    torque, lacking = _balance(model, tree, feet, pushes, x[:joints])
    lowest, highest = torque_bounds(given.torque, given.strength, given.back_emf, given.v[BASE:])
    spare = ca.fmin(highest - torque, torque - lowest)
    outputs = {
        "acceleration": ca.vertcat(rotation.T @ linear, rotation.T @ base[3:], x[:joints]),
        "force": ca.vertcat(*pushes),
        "torque": torque,
        "com": tree.linear_bias / tree.mass + ca.DM(model.pin_model.gravity.linear),
        "feet": ca.vertcat(*[foot.drift for foot in feet]),
        "spare": spare,
        "violation": ca.mmax(ca.vertcat(-spare / given.torque, _broken(x, bounds, joints, given))),
        # A norm, not a largest entry: it is NaN as soon as anything is.
        "residual": ca.norm_2(lacking),
    }
    flat = ca.vertcat(*[outputs[name] for name in plan_layout(model).slices])
    inputs = {"parameters": vector, "x": x, "base": base, "bounds": bounds}
    return _function("whole_body_plan", inputs, {"plan": flat})


def _balance(
    model: WholeBodyModel, tree: SymbolicTree, feet: list[FootTerms], pushes: list[Any], change: Any
) -> tuple[Any, Any]:
    """Joint torques of a motion under the ground's forces, and the six forces that the base then lacks."""
    linear, angular = tree.linear_bias, tree.angular_bias
    torque = tree.joint_bias + ca.DM(model.actuators.armature) * change
    for foot, push in zip(feet, pushes, strict=True):
        linear = linear - push
        angular = angular - ca.cross(foot.position - tree.com, push)
        torque = torque - foot.jacobian.T @ push
    return torque, ca.vertcat(linear, angular)


def _broken(x: Any, bounds: Any, joints: int, given: SimpleNamespace) -> Any:
    """By how much each bound and each side of the friction pyramids is broken; negative where it holds."""
    change, force = slice(0, joints), slice(joints + 2, None, 3)
    parts = [
        (x[change] - bounds[change, 3]) / given.braking,
        (bounds[change, 2] - x[change]) / given.braking,
        x[force] - bounds[force, 3],
        -x[force],
    ]
    for tangent in (joints, joints + 1):
        parts.append(ca.fabs(x[tangent::3]) - given.friction * x[force])
    return ca.vertcat(*parts)


def _state(
    model: WholeBodyModel, given: SimpleNamespace, accelerations: Any = (None, None, None)
) -> TreeState:
    """The robot's state in world axes; accelerations of base (linear, angular) and joints."""
    rotation = quaternion_matrix(given.q[3:7])
    linear, angular, joints = accelerations
    return TreeState(
        rotation=rotation, linear=rotation @ given.v[:3], angular=rotation @ given.v[3:BASE],
        joints=given.q[7:], speeds=given.v[BASE:], gravity=ca.DM(model.pin_model.gravity.linear),
        linear_acceleration=linear, angular_acceleration=angular, accelerations=joints,
    )  # fmt: skip


def _least_squares(
    model: WholeBodyModel, dynamics: ReducedDynamics, given: SimpleNamespace
) -> tuple[Any, Any]:
    inertia = model.mass * model.size**2
    tasks = [
        com_task(dynamics, given),
        trunk_task(dynamics, given),
        momentum_task(dynamics, inertia, given),
        *[foot_task(dynamics, index, given) for index in range(len(model.feet))],
    ]
    weighted = [task.weighted() for task in tasks]
    return ca.vertcat(*[matrix for matrix, _ in weighted]), ca.vertcat(*[side for _, side in weighted])


def _bounds(model: WholeBodyModel, given: SimpleNamespace) -> tuple[Any, Any]:
    """(n, 4) diagonal cost, linear cost, lower and upper bound of every unknown; loads of the feet."""
    lowest, highest = acceleration_bounds(given.q[7:], given.v[BASE:], given, given.horizon)
    caps, loaded = force_caps(given, model.weight)
    even = caps / ca.fmax(ca.sum1(caps), 1e-9 * model.weight)  # of the weight
    unit = force_unit(model) / model.weight
    cost = given.force_weight * unit * unit
    pushes, shares, floors, ceilings = [], [], [], []
    for foot in range(len(model.feet)):
        pushes += [cost] * 3
        shares += [0.0, 0.0, -cost / unit * even[foot]]
        floors += [-ca.inf, -ca.inf, 0.0]
        ceilings += [ca.inf, ca.inf, caps[foot] / force_unit(model)]
    weight = given.posture_weight
    columns = (
        ca.vertcat(weight, *pushes),
        ca.vertcat(-weight * posture_target(given), *shares),
        ca.vertcat(lowest, *floors),
        ca.vertcat(highest, *ceilings),
    )
    return ca.horzcat(*columns), loaded


def _function(name: str, inputs: dict[str, Any], outputs: dict[str, Any]) -> ca.Function:
    dense = [ca.densify(ca.SX(value)) for value in outputs.values()]
    return ca.Function(name, list(inputs.values()), dense, list(inputs), list(outputs), {"cse": True})
