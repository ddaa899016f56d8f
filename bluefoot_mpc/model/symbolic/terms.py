"""The terms of the equations of motion as one function, in Pinocchio's coordinates."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca
import pinocchio as pin

from bluefoot_mpc.model.symbolic.algebra import parallel_axis, quaternion_matrix, skew
from bluefoot_mpc.model.symbolic.joints import tree_joints
from bluefoot_mpc.model.symbolic.tree import SymbolicTree, TreeState


def dynamics_function(
    model: pin.Model, frames: Sequence[int], armature: Sequence[float] | None = None
) -> ca.Function:
    """Mass matrix, bias, feet and centroidal terms at ``q`` and ``v``.

    Outputs: ``M`` (nv, nv), ``h`` (nv,), ``foot_position`` (3, k) m in the world,
    ``foot_jacobian`` (3 k, nv) and ``foot_drift`` (3, k) m/s² of the foot points in
    world axes, ``com`` (3,) m, ``centroidal`` (6, nv) momentum matrix (linear,
    angular about the centre of mass, world axes), ``momentum_drift`` (6,) rate of the
    momentum while ``v̇ = 0``.

    Args:
        model: free flyer and revolute joints.
        frames: indices of the feet's frames.
        armature: kg·m², rotor inertia per joint, on the mass matrix only.

    Raises:
        ConfigurationError: the model has other joints.
    """
    tree_joints(model)
    q, v = ca.SX.sym("q", model.nq), ca.SX.sym("v", model.nv)
    world = quaternion_matrix(q[3:7])
    field = world.T @ ca.DM(model.gravity.linear)
    state = TreeState(
        rotation=ca.SX.eye(3), linear=v[:3], angular=v[3:6], joints=q[7:], speeds=v[6:], gravity=field
    )
    tree = SymbolicTree(model, state, armature)
    feet = [tree.foot(frame) for frame in frames]
    jacobians = [ca.horzcat(world, -world @ skew(foot.position), world @ foot.jacobian) for foot in feet]
    outputs = {
        "M": _mass_matrix(tree),
        "h": ca.vertcat(
            tree.linear_bias, tree.angular_bias + ca.cross(tree.com, tree.linear_bias), tree.joint_bias
        ),
        "foot_position": ca.horzcat(*[q[:3] + world @ foot.position for foot in feet]),
        "foot_jacobian": ca.vertcat(*jacobians),
        "foot_drift": ca.horzcat(*[world @ foot.drift for foot in feet]),
        "com": q[:3] + world @ tree.com,
        "centroidal": _centroidal(tree, world),
        "momentum_drift": ca.vertcat(
            world @ (tree.linear_bias + tree.mass * field), world @ tree.angular_bias
        ),
    }
    return ca.Function(
        "dynamics", [q, v], [ca.densify(value) for value in outputs.values()], ["q", "v"], list(outputs),
        {"cse": True},
    )  # fmt: skip


def _mass_matrix(tree: SymbolicTree) -> Any:
    """The mass matrix with the base's twist taken at its origin."""
    lever = tree.mass * skew(tree.com)
    coupling = ca.vertcat(tree.linear_map, tree.angular_map + skew(tree.com) @ tree.linear_map)
    base = ca.vertcat(
        ca.horzcat(tree.mass * ca.SX.eye(3), -lever),
        ca.horzcat(lever, tree.inertia + parallel_axis(tree.mass, tree.com)),
    )
    return ca.vertcat(ca.horzcat(base, coupling), ca.horzcat(coupling.T, tree.joint_inertia))


def _centroidal(tree: SymbolicTree, world: Any) -> Any:
    linear = ca.horzcat(tree.mass * ca.SX.eye(3), -tree.mass * skew(tree.com), tree.linear_map)
    angular = ca.horzcat(ca.SX(3, 3), tree.inertia, tree.angular_map)
    return ca.vertcat(world @ linear, world @ angular)
