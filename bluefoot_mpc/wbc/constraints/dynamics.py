"""Floating-base dynamics, met by construction: the base's accelerations are eliminated.

With the base's twist taken at the centre of mass, its six equations are
``m a + L a_j + h_l = Σ f`` and ``I ω̇ + K a_j + h_a = Σ r x f``. Solving them for the base
leaves the joint accelerations and the forces as unknowns, and no equality for
a solver to miss: the plan obeys the dynamics to rounding. What a servo must
do then follows as rows of torque, ``τ = M_j v̇ + h_j - Σ Jᵀ f``.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import casadi as ca

from bluefoot_mpc.model.symbolic import FootTerms, SymbolicTree
from bluefoot_mpc.model.symbolic.algebra import skew, symmetric_inverse
from bluefoot_mpc.wbc.rows import Rows


class ReducedDynamics:
    """Accelerations and torques as functions of joint accelerations and contact forces, world axes.

    Attributes:
        tree: the terms it was made from.
        feet: the foot points.
        axes: 3 x 3, axes of the ground (columns: two tangents, normal), times the unit of the forces.
        linear: 3, m/s², base's spatial acceleration at the centre of mass, linear.
        angular: 3, rad/s², the base's angular acceleration.
        com: 3, m/s², acceleration of the centre of mass.
        momentum: 3, N·m, rate of the angular momentum about the centre of mass.
        torque: nj, N·m.
    """

    def __init__(self, tree: SymbolicTree, feet: Sequence[FootTerms], axes: Any, gravity: Any) -> None:
        self.tree, self.feet, self.axes = tree, tuple(feet), axes
        joints, count = tree.joint_inertia.size1(), len(feet)
        self._joints, self._unknowns = joints, joints + 3 * count
        push = ca.horzcat(*[axes] * count) / tree.mass
        turn = ca.horzcat(*[skew(foot.position - tree.com) @ axes for foot in feet])
        nothing = ca.SX(3, joints)
        inverse = symmetric_inverse(tree.inertia)
        self.linear = Rows(
            matrix=ca.horzcat(-tree.linear_map / tree.mass, push), constant=-tree.linear_bias / tree.mass
        )
        self.angular = Rows(
            matrix=inverse @ ca.horzcat(-tree.angular_map, turn), constant=-(inverse @ tree.angular_bias)
        )
        self.com = Rows(matrix=ca.horzcat(nothing, push), constant=ca.SX(gravity))
        self.momentum = Rows(matrix=ca.horzcat(nothing, turn), constant=ca.SX.zeros(3))
        self.torque = self._torque()

    def foot(self, index: int) -> Rows:
        """3, m/s², acceleration of a foot point."""
        foot = self.feet[index]
        lever = skew(foot.position - self.tree.com)
        own = ca.horzcat(foot.jacobian, ca.SX(3, self._unknowns - self._joints))
        return Rows(
            matrix=self.linear.matrix - lever @ self.angular.matrix + own,
            constant=self.linear.constant - lever @ self.angular.constant + foot.drift,
        )

    def _torque(self) -> Rows:
        tree, joints = self.tree, self._joints
        linear, angular = self.linear.matrix, self.angular.matrix
        # What the base takes from the joints is symmetric: half of it is computed.
        shared = ca.SX(joints, joints)
        for row in range(joints):
            for column in range(row + 1):
                moved = ca.dot(tree.linear_map[:, row], linear[:, column])
                turned = ca.dot(tree.angular_map[:, row], angular[:, column])
                shared[row, column] = shared[column, row] = moved + turned
        contact = ca.horzcat(*[foot.jacobian.T @ self.axes for foot in self.feet])
        pushed = (
            tree.linear_map.T @ linear[:, joints:] - angular[:, :joints].T @ self.momentum.matrix[:, joints:]
        )
        rest = tree.linear_map.T @ self.linear.constant + tree.angular_map.T @ self.angular.constant
        return Rows(
            matrix=ca.horzcat(tree.joint_inertia + shared, pushed - contact), constant=rest + tree.joint_bias
        )


def ground_axes(normal: Any) -> Any:
    """3 x 3 axes on the ground: a tangent near x, one near y, and the unit normal, as columns."""
    upward = normal / ca.norm_2(normal)
    side = ca.vertcat(0.0, upward[2], -upward[1])  # normal x (1, 0, 0), turned to lie near y
    side = side / ca.norm_2(side)
    return ca.horzcat(ca.cross(side, upward), side, upward)
