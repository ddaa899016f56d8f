"""Mass matrix, bias, feet and centroidal terms of a tree of revolute joints on a floating base.

Everything is written relative to the base's origin, in one set of axes that the
caller chooses by the rotation it starts from: the base's own (identity) or the
world's. The base's six coordinates are then a twist in those axes, and taken
*at the centre of mass* its 6 x 6 block of the mass matrix falls apart into the
mass and the centroidal inertia: eliminating the base costs one 3 x 3 inverse.

Method: composite bodies for the mass matrix and recursive Newton-Euler for the
bias (Featherstone, Rigid Body Dynamics Algorithms, 2008, chapters 5, 6 and 9),
with each body's mass, first moment and inertia summed down the tree, so that a
joint of one leg never meets another leg.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from bluefoot_mpc.model.symbolic.algebra import parallel_axis, skew, turned_inertia
from bluefoot_mpc.model.symbolic.joints import Joint, tree_joints


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class TreeState:
    """State of the robot as expressions, in the axes of the tree.

    Attributes:
        rotation: 3 x 3 rotation_base_to_axes.
        linear: 3, m/s, velocity of the base's origin.
        angular: 3, rad/s, of the base.
        joints: nj, rad.
        speeds: nj, rad/s.
        gravity: 3, m/s², the field (downwards), in the tree's axes.
        linear_acceleration: 3, m/s², linear part of the base's spatial acceleration at its origin;
            with accelerations given, the biases become the forces of inverse dynamics.
        angular_acceleration: 3, rad/s², of the base.
        accelerations: nj, rad/s².
    """

    rotation: Any
    linear: Any
    angular: Any
    joints: Any
    speeds: Any
    gravity: Any
    linear_acceleration: Any = None
    angular_acceleration: Any = None
    accelerations: Any = None


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class FootTerms:
    """One foot point as expressions, in the axes of the tree.

    Attributes:
        position: 3, m, from the base's origin.
        velocity: 3, m/s.
        jacobian: 3 x nj, of the joints while the base rests.
        drift: 3, m/s², its acceleration under the state's accelerations; where they are
            zero (base spatial, joints), what the velocities alone leave.
    """

    position: Any
    velocity: Any
    jacobian: Any
    drift: Any


@dataclass(slots=True)
class _Body:
    """Working values of one body, later of it and all that it carries (from the base's origin)."""

    rotation: Any
    origin: Any
    axis: Any
    angular: Any
    velocity: Any
    acceleration: Any
    spin: Any
    mass: float = 0.0
    moment: Any = None
    inertia: Any = None
    force: Any = None
    torque: Any = None

    def velocity_at(self, point: Any) -> Any:
        return self.velocity + ca.cross(self.angular, point - self.origin)

    def acceleration_at(self, point: Any) -> Any:
        return self.acceleration + self.spin @ (point - self.origin)


class SymbolicTree:
    """The dynamic terms of one state.

    Attributes:
        mass: kg, of the robot.
        angular_velocity: 3, rad/s, of the base.
        com: 3, m, centre of mass from the base's origin.
        com_velocity: 3, m/s.
        inertia: 3 x 3, kg·m², centroidal composite inertia.
        momentum: 3, kg·m²/s, angular momentum about the centre of mass.
        linear_map: 3 x nj, linear momentum per joint speed while the base rests.
        angular_map: 3 x nj, angular momentum about the centre of mass, likewise.
        joint_inertia: nj x nj, block of the mass matrix.
        linear_bias: 3, N, force that the base needs while all accelerations are zero (gravity in it).
        angular_bias: 3, N·m, about the centre of mass, likewise.
        joint_bias: nj, N·m, likewise.
    """

    def __init__(self, model: pin.Model, state: TreeState, armature: Sequence[float] | None = None) -> None:
        """Write the terms.

        Args:
            model: free flyer and revolute joints.
            state: the symbols.
            armature: kg·m², rotor inertia seen at each joint.

        Raises:
            ConfigurationError: the model has other joints.
        """
        self._model, self._state = model, state
        self._joints = tree_joints(model)
        self._bodies = [self._base()]
        for index, joint in enumerate(self._joints):
            self._bodies.append(self._child(joint, index))
        self._accumulate()
        self._totals()
        self._mass_matrix(armature or [0.0] * len(self._joints))

    def foot(self, frame: int) -> FootTerms:
        """Terms of the origin of one of the model's frames, by its index."""
        parent = int(self._model.frames[frame].parentJoint)
        body = self._bodies[parent - 1]
        offset = self._model.frames[frame].placement.translation
        point = body.origin + body.rotation @ ca.DM(offset)
        jacobian = ca.SX(3, len(self._joints))
        for index in self._ancestors(parent - 2):
            carrier = self._bodies[index + 1]
            jacobian[:, index] = ca.cross(carrier.axis, point - carrier.origin)
        # Accelerations were propagated in a frame that falls: the field is taken out again.
        drift = body.acceleration_at(point) + self._state.gravity
        return FootTerms(position=point, velocity=body.velocity_at(point), jacobian=jacobian, drift=drift)

    def _ancestors(self, index: int) -> list[int]:
        """A joint and all that carry it, outermost first."""
        chain = []
        while index >= 0:
            chain.append(index)
            index = self._joints[index].parent
        return chain

    def _base(self) -> _Body:
        state = self._state
        turning = skew(state.angular)
        zero = ca.SX.zeros(3)
        linear = zero if state.linear_acceleration is None else state.linear_acceleration
        change = zero if state.angular_acceleration is None else state.angular_acceleration
        # With spatial acceleration zero the origin still accelerates by omega x v.
        body = _Body(
            rotation=state.rotation, origin=zero, axis=None, angular=state.angular, velocity=state.linear,
            acceleration=linear + ca.cross(state.angular, state.linear) - state.gravity,
            spin=turning @ turning + skew(change),
        )  # fmt: skip
        inertia = self._model.inertias[1]
        lever, central = np.array(inertia.lever), np.array(inertia.inertia)
        return _loaded(body, float(inertia.mass), lever, central, change)

    def _child(self, joint: Joint, index: int) -> _Body:
        parent = self._bodies[joint.parent + 1]
        rotation = joint.turned(parent.rotation, self._state.joints[index])
        origin = parent.origin + parent.rotation @ ca.DM(joint.position)
        axis = rotation @ ca.DM(joint.axis)
        rate = axis * self._state.speeds[index]
        angular = parent.angular + rate
        change = _turning(parent.spin) + ca.cross(parent.angular, rate)
        if self._state.accelerations is not None:
            change += axis * self._state.accelerations[index]
        turning = skew(angular)
        body = _Body(
            rotation=rotation, origin=origin, axis=axis, angular=angular,
            velocity=parent.velocity_at(origin), acceleration=parent.acceleration_at(origin),
            spin=turning @ turning + skew(change),
        )  # fmt: skip
        return _loaded(body, joint.mass, joint.com, joint.inertia, change)

    def _accumulate(self) -> None:
        for index in reversed(range(len(self._joints))):
            body, parent = self._bodies[index + 1], self._bodies[self._joints[index].parent + 1]
            parent.mass += body.mass
            parent.moment += body.moment
            parent.inertia += body.inertia
            parent.force += body.force
            parent.torque += body.torque

    def _totals(self) -> None:
        whole, state = self._bodies[0], self._state
        self.angular_velocity = state.angular
        self.mass = whole.mass
        self.com = whole.moment / whole.mass
        self.inertia = whole.inertia - parallel_axis(whole.mass, self.com)
        self.linear_bias = whole.force
        self.angular_bias = whole.torque - ca.cross(self.com, whole.force)
        columns = [self._momentum_column(body) for body in self._bodies[1:]]
        self._columns = columns
        self.linear_map = ca.horzcat(*[force for force, _ in columns])
        self.angular_map = ca.horzcat(*[torque - ca.cross(self.com, force) for force, torque in columns])
        carried = state.linear + ca.cross(state.angular, self.com)
        self.com_velocity = carried + self.linear_map @ state.speeds / self.mass
        self.momentum = self.inertia @ state.angular + self.angular_map @ state.speeds

    def _momentum_column(self, body: _Body) -> tuple[Any, Any]:
        """Momentum, and its moment about the base's origin, of all that a joint carries at unit speed."""
        linear = ca.cross(body.axis, body.moment - body.mass * body.origin)
        angular = body.inertia @ body.axis + ca.cross(body.moment, ca.cross(body.origin, body.axis))
        return linear, angular

    def _mass_matrix(self, armature: Sequence[float]) -> None:
        count = len(self._joints)
        self.joint_inertia = ca.SX(count, count)
        bias = []
        for index, (linear, angular) in enumerate(self._columns):
            for above in self._ancestors(index):
                carrier = self._bodies[above + 1]
                entry = ca.dot(carrier.axis, angular - ca.cross(carrier.origin, linear))
                self.joint_inertia[index, above] = entry
                self.joint_inertia[above, index] = entry
            self.joint_inertia[index, index] += float(armature[index])
            body = self._bodies[index + 1]
            bias.append(ca.dot(body.axis, body.torque - ca.cross(body.origin, body.force)))
        self.joint_bias = ca.vertcat(*bias)


def _turning(spin: Any) -> Any:
    """Angular acceleration of a body: the antisymmetric part of its spin matrix."""
    return 0.5 * ca.vertcat(spin[2, 1] - spin[1, 2], spin[0, 2] - spin[2, 0], spin[1, 0] - spin[0, 1])


def _loaded(body: _Body, mass: float, lever: Any, inertia: Any, change: Any) -> _Body:
    """Give a body its mass, first moment, inertia, inertial force and its moment about the base's origin.

    Args:
        body: where it is and how it moves.
        mass: kg.
        lever: (3,) m, centre of mass in its frame.
        inertia: (3, 3) kg·m² about the centre, its axes.
        change: 3, rad/s², angular acceleration.
    """
    com = body.origin + body.rotation @ ca.DM(lever)
    central = turned_inertia(body.rotation, inertia)
    body.mass, body.moment = mass, mass * com
    body.inertia = central + parallel_axis(mass, com)
    body.force = mass * body.acceleration_at(com)
    turning = central @ change + ca.cross(body.angular, central @ body.angular)
    body.torque = turning + ca.cross(com, body.force)
    return body
