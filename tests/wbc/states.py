"""Robots, states and figures that the tests of the whole-body controller share."""

from __future__ import annotations

import dataclasses
import functools
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.wbc import Actuators, WholeBodyInputs, WholeBodyModel, WholeBodyPlan

DATA = Path(pin.__file__).parents[4] / "share/example-robot-data/robots"
ALIGNED = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
DT = 0.02

OTHERS: dict[str, tuple[str, tuple[str, ...], tuple[float, ...]]] = {
    "solo12": (
        "solo_description/robots/solo12.urdf",
        ("FL_FOOT", "FR_FOOT", "HL_FOOT", "HR_FOOT"),
        (0.0, 0.8, -1.6) * 2 + (0.0, -0.8, 1.6) * 2,
    ),
    "go2": (
        "go2_description/urdf/go2.urdf",
        ("FL_foot", "FR_foot", "RL_foot", "RR_foot"),
        (0.0, 0.9, -1.8) * 4,
    ),
    "anymal": (
        "anymal_b_simple_description/robots/anymal.urdf",
        ("LF_FOOT", "RF_FOOT", "LH_FOOT", "RH_FOOT"),
        (0.0, 0.7, -1.4, 0.0, -0.7, 1.4) * 2,
    ),
}


@functools.cache
def bluefoot() -> WholeBodyModel:
    return WholeBodyModel.from_robot(load_robot())


@functools.cache
def other(name: str) -> WholeBodyModel:
    path, feet, joints = OTHERS[name]
    if not (DATA / path).exists():
        pytest.skip("example-robot-data is not installed")
    pin_model = pin.buildModelFromUrdf(str(DATA / path), pin.JointModelFreeFlyer())
    posture = np.concatenate([[0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0], by_name(pin_model, feet, joints)])
    return WholeBodyModel.from_pinocchio(pin_model, feet, Actuators.from_pinocchio(pin_model), posture)


def by_name(pin_model: pin.Model, feet: tuple[str, ...], joints: tuple[float, ...]) -> np.ndarray:
    """Joint angles of a stance, given for the legs in the order of the feet, in the model's order."""
    angles = np.zeros(pin_model.nq - 7)
    for k, foot in enumerate(feet):
        chain, index = [], pin_model.frames[pin_model.getFrameId(foot)].parentJoint
        while index > 1:
            chain.append(index - 2)
            index = pin_model.parents[index]
        angles[chain[::-1]] = joints[3 * k : 3 * k + 3]
    return angles


def foot_points(model: WholeBodyModel, q: np.ndarray) -> np.ndarray:
    data = model.pin_model.createData()
    pin.framesForwardKinematics(model.pin_model, data, q)
    return np.array([data.oMf[frame].translation for frame in model.frames])


def com_of(model: WholeBodyModel, q: np.ndarray) -> np.ndarray:
    return np.array(pin.centerOfMass(model.pin_model, model.pin_model.createData(), q))


def standing(model: WholeBodyModel, contact: Any = None, **changes: Any) -> WholeBodyInputs:
    """At rest in the model's posture, wanting to stay there."""
    q = model.posture
    feet = len(model.feet)
    inputs = WholeBodyInputs(
        q=q, v=np.zeros(model.pin_model.nv),
        contact=np.ones(feet, dtype=bool) if contact is None else np.array(contact, dtype=bool),
        com=com_of(model, q), trunk=q[3:7].copy(), foot=foot_points(model, q),
    )  # fmt: skip
    return dataclasses.replace(inputs, **changes)


def dynamics_error(model: WholeBodyModel, inputs: WholeBodyInputs, plan: WholeBodyPlan) -> float:
    """Largest error of the equations of motion by Pinocchio's own inverse dynamics."""
    pin_model = model.pin_model
    data = pin_model.createData()
    needed = np.array(pin.rnea(pin_model, data, inputs.q, inputs.v, plan.acceleration))
    needed[6:] += model.actuators.armature * plan.acceleration[6:]
    pin.computeJointJacobians(pin_model, data, inputs.q)
    pin.updateFramePlacements(pin_model, data)
    for frame, force in zip(model.frames, plan.foot_force, strict=True):
        needed -= pin.getFrameJacobian(pin_model, data, frame, ALIGNED)[:3].T @ force
    needed[6:] -= plan.torque
    return float(np.abs(needed).max())
