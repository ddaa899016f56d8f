"""A Pinocchio model as a list of bodies and revolute joints, with everything but these refused."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.symbolic.algebra import cleaned, skew
from bluefoot_mpc.types import FloatArray

_REVOLUTE = ("JointModelRX", "JointModelRY", "JointModelRZ", "JointModelRevoluteUnaligned")


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Joint:
    """One revolute joint and the body that it carries, as constants of the model.

    Attributes:
        name: of the joint.
        parent: index of the joint that carries it in the list, -1 for the floating base.
        rotation: (3, 3) axes of the joint at angle zero in the parent's axes.
        position: (3,) m, joint in the parent's frame.
        axis: (3,) unit axis of rotation in the joint's frame.
        mass: kg, of the body.
        com: (3,) m, the body's centre of mass in the joint's frame.
        inertia: (3, 3) kg·m² about that centre, joint's axes.
    """

    name: str
    parent: int
    rotation: FloatArray
    position: FloatArray
    axis: FloatArray
    mass: float
    com: FloatArray
    inertia: FloatArray

    def turned(self, rotation: Any, angle: Any) -> Any:
        """Rotation of the body in the frame in which `rotation` gives the parent."""
        start = rotation @ ca.DM(self.rotation)
        cosine, sine = ca.cos(angle), ca.sin(angle)
        along = np.flatnonzero(np.abs(self.axis) == 1.0)
        if along.size == 0:
            axis = ca.DM(self.axis)
            return start @ (cosine * ca.DM.eye(3) + sine * skew(axis) + (1.0 - cosine) * (axis @ axis.T))
        # About a coordinate axis two columns turn and the third stays.
        third = int(along[0])
        sine = sine * float(self.axis[third])
        first, second = (third + 1) % 3, (third + 2) % 3
        columns = [start[:, 0], start[:, 1], start[:, 2]]
        columns[first] = cosine * start[:, first] + sine * start[:, second]
        columns[second] = cosine * start[:, second] - sine * start[:, first]
        return ca.horzcat(*columns)


def tree_joints(model: pin.Model) -> tuple[Joint, ...]:
    """The revolute joints of a robot on a free flyer, in the order of its velocity vector.

    Raises:
        ConfigurationError: the first joint is no free flyer, or another one is not revolute.
    """
    if model.njoints < 2 or model.joints[1].shortname() != "JointModelFreeFlyer":
        raise ConfigurationError(
            f"robot '{model.name}' does not start with a free flyer: "
            "build it with pinocchio.JointModelFreeFlyer()"
        )
    return tuple(_joint(model, index) for index in range(2, model.njoints))


def _joint(model: pin.Model, index: int) -> Joint:
    joint, placement, body = model.joints[index], model.jointPlacements[index], model.inertias[index]
    kind = joint.shortname()
    if kind not in _REVOLUTE:
        raise ConfigurationError(
            f"joint '{model.names[index]}' of robot '{model.name}' is a {kind}: "
            "only revolute joints are modelled; lock it with pinocchio.buildReducedModel"
        )
    # A revolute joint's motion subspace is constant in its own frame: zero over its axis.
    axis = np.asarray(joint.createData().S).reshape(-1)[3:]
    return Joint(
        name=model.names[index], parent=int(model.parents[index]) - 2,
        rotation=cleaned(placement.rotation), position=cleaned(placement.translation),
        axis=cleaned(axis), mass=float(body.mass),
        com=np.array(body.lever), inertia=np.array(body.inertia),
    )  # fmt: skip
