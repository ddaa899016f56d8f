"""The robot's model: parameters, URDF, Pinocchio model and kinematics in one place."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pinocchio as pin

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import GRAVITY, RobotParameters, load_parameters
from bluefoot_mpc.model.urdf import make_urdf
from bluefoot_mpc.types import JOINTS, LEGS, N_LEGS, FloatArray

if TYPE_CHECKING:
    from bluefoot_mpc.model.legs import LegGeometry


class RobotModel:
    """A robot as every stage sees it, built once from its parameters.

    Attributes:
        parameters: the parameter file's content.
        urdf: URDF text, the same for every engine.
        pin_model: Pinocchio model with a free flyer; q (23,) and v (22,) in house order.
        pin_data: its workspace. Not for use from several threads.
        geometry: leg geometry for the closed-form kinematics.
        joint_names: the sixteen joints, leg-major.
        foot_frame_ids: Pinocchio frames of the feet, FL, FR, RL, RR.
        lower: (16,) rad, lower joint limits imposed by software.
        upper: (16,) rad, upper joint limits imposed by software.
    """

    def __init__(self, parameters: RobotParameters) -> None:
        self.parameters = parameters
        self.urdf = make_urdf(parameters)
        self.pin_model = pin.buildModelFromXML(self.urdf, pin.JointModelFreeFlyer())
        self.pin_model.gravity.linear = np.array([0.0, 0.0, -GRAVITY])
        self.pin_data = self.pin_model.createData()
        self.joint_names = tuple(self.pin_model.names[2:])
        if self.joint_names != JOINTS:
            raise ConfigurationError(f"Pinocchio orders the joints {self.joint_names}, not {JOINTS}")
        self.foot_frame_ids = tuple(int(self.pin_model.getFrameId(f"{leg}_foot")) for leg in LEGS)
        lower, upper = parameters.legs.limits_deg.radians()
        self.lower = np.tile(lower, N_LEGS)
        self.upper = np.tile(upper, N_LEGS)

    @functools.cached_property
    def geometry(self) -> LegGeometry:
        """Leg geometry for the closed-form kinematics."""
        from bluefoot_mpc.model.legs import LegGeometry  # noqa: PLC0415

        return LegGeometry.from_parameters(self.parameters)

    @functools.cached_property
    def stance_joints(self) -> FloatArray:
        """(16,) rad, joints of the default stance.

        Raises:
            ConfigurationError: a leg cannot reach its foothold, or only beyond a limit.
        """
        from bluefoot_mpc.model.legs import inverse  # noqa: PLC0415

        stance = self.parameters.stance
        feet = stance.foot_position - np.array([0.0, 0.0, stance.trunk_height])
        ankle = np.full(N_LEGS, np.radians(stance.ankle_direction_deg))
        result = inverse(self.geometry, feet, ankle)
        for leg, reachable in zip(LEGS, result.reachable, strict=True):
            if not reachable:
                raise ConfigurationError(f"[stance] leg {leg} cannot reach its foot position")
        if result.violations:
            raise ConfigurationError(f"[stance] {'; '.join(map(str, result.violations))}")
        return result.joints

    def default_stance(self) -> FloatArray:
        """(23,) q of the default stance: level trunk at the world's origin, feet resting on z = 0."""
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
    return RobotModel(load_parameters(path))
