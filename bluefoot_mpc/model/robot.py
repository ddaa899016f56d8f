"""The robot's model: parameters, URDF, Pinocchio model and kinematics in one place."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pinocchio as pin

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.legs import IkResult, LegGeometry, inverse
from bluefoot_mpc.model.parameters import GRAVITY, RobotParameters, load_parameters
from bluefoot_mpc.model.resources import model_file
from bluefoot_mpc.model.urdf import make_urdf
from bluefoot_mpc.types import JOINTS, LEGS, FloatArray


class RobotModel:
    """A robot as every stage sees it, built once from its parameters.

    Attributes:
        parameters: the parameter file's content.
        urdf: URDF text, the same for every engine.
        geometry: leg geometry for the closed-form kinematics.
        pin_model: Pinocchio model with a free flyer; q (23,) and v (22,) in house order.
        pin_data: its workspace; not for several threads at once.
        joint_names: the sixteen joints, leg-major.
        foot_frame_ids: Pinocchio frames of the feet, FL, FR, RL, RR.
        lower: (16,) rad, lower joint limits imposed by software.
        upper: (16,) rad, upper joint limits imposed by software.
        stance_joints: (16,) rad, joints of the default stance, read-only.
    """

    def __init__(self, parameters: RobotParameters) -> None:
        """Build the model.

        Raises:
            ConfigurationError: the default stance is out of reach or breaks an imposed limit.
        """
        self.parameters = parameters
        self.geometry = LegGeometry.from_parameters(parameters)
        self.stance_joints = _stance_joints(parameters, self.geometry)
        self.urdf = make_urdf(parameters)
        self.pin_model = pin.buildModelFromXML(self.urdf, pin.JointModelFreeFlyer())
        self.pin_model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
        self.pin_data = self.pin_model.createData()
        # Names 0 and 1 are Pinocchio's universe and the free flyer.
        self.joint_names = tuple(self.pin_model.names[2:])
        if self.joint_names != JOINTS:
            raise RuntimeError(f"Pinocchio put the joints in the order {self.joint_names}")
        self.foot_frame_ids = tuple(int(self.pin_model.getFrameId(f"{leg}_foot")) for leg in LEGS)
        self.lower = self.geometry.lower
        self.upper = self.geometry.upper

    def default_stance(self) -> FloatArray:
        """(23,) q of the default stance: level trunk above the world's origin, feet resting on z = 0."""
        height = self.parameters.stance.trunk_height + self.parameters.legs.foot_radius
        return np.concatenate([[0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0], self.stance_joints])


def load_robot(path: str | Path | None = None) -> RobotModel:
    """Load a robot from its parameter file.

    Args:
        path: a TOML file, or the name of one that ships (``"bluefoot"``);
            ``None`` is BlueFoot itself.

    Raises:
        ConfigurationError: the file is missing, or describes an impossible robot.
    """
    file = model_file("bluefoot" if path is None else path)
    parameters = load_parameters(file)
    try:
        return RobotModel(parameters)
    except ConfigurationError as error:
        raise ConfigurationError(f"{file.name}: {error}") from error


def _stance_joints(parameters: RobotParameters, geometry: LegGeometry) -> FloatArray:
    stance = parameters.stance
    feet = stance.foot_position - np.array([0.0, 0.0, stance.trunk_height])
    result = inverse(geometry, feet, math.radians(stance.ankle_direction_deg))
    if not result.feasible:
        raise ConfigurationError(
            f"[stance] foot_x = {stance.foot_x:g}, foot_y = {stance.foot_y:g}, "
            f"trunk_height = {stance.trunk_height:g}, ankle_direction_deg = {stance.ankle_direction_deg:g} "
            f"is no stance of this robot: {_shortened(result)}"
        )
    joints = result.joints.copy()
    joints.flags.writeable = False
    return joints


def _shortened(result: IkResult, most: int = 4) -> str:
    """What is wrong, reach before limits: a leg out of reach breaks limits for that reason alone."""
    lost = int(np.count_nonzero(~result.reachable))
    reasons = result.describe()[: lost or None]
    rest = len(reasons) - most
    return "; ".join(reasons[:most]) + (f"; and {rest} more" if rest > 0 else "")
