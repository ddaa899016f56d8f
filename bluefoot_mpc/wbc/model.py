"""The robot as the whole-body controller sees it: any Pinocchio model with named feet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.model.symbolic import tree_joints
from bluefoot_mpc.types import LEGS, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class Actuators:
    """What the joints' motors and stops allow; every array is (nj,).

    Attributes:
        torque: N·m, largest torque at standstill, at the nominal voltage.
        back_emf: N·m·s/rad, torque lost per joint speed; 0 for a torque-controlled motor.
        speed: rad/s, highest joint speed.
        lower: rad, lower position limits.
        upper: rad, upper position limits.
        armature: kg·m², rotor inertia seen at the joint.
        nominal_voltage: V at which `torque` holds.
    """

    torque: FloatArray
    back_emf: FloatArray
    speed: FloatArray
    lower: FloatArray
    upper: FloatArray
    armature: FloatArray
    nominal_voltage: float = 1.0

    def __post_init__(self) -> None:
        count = len(self.torque)
        for name in ("torque", "back_emf", "speed", "lower", "upper", "armature"):
            values = getattr(self, name)
            if np.shape(values) != (count,) or np.isnan(values).any():
                raise ConfigurationError(f"actuators: {name} must be {count} numbers, not {values!r}")
        if not (np.all(self.torque > 0.0) and np.all(self.speed > 0.0) and self.nominal_voltage > 0.0):
            raise ConfigurationError("actuators: torque, speed and nominal voltage must be positive")
        if not (np.all(self.back_emf >= 0.0) and np.all(self.armature >= 0.0)):
            raise ConfigurationError("actuators: back_emf and armature must not be negative")
        if not np.all(self.lower < self.upper):
            raise ConfigurationError("actuators: every lower joint limit must lie below its upper one")

    @classmethod
    def from_pinocchio(cls, model: pin.Model, armature: FloatArray | None = None) -> Actuators:
        """Limits that the model's file gives; 0 or nothing there means unlimited."""
        count = model.nv - 6
        torque, speed = np.array(model.effortLimit[6:]), np.array(model.velocityLimit[6:])
        torque[torque <= 0.0] = np.inf
        speed[speed <= 0.0] = np.inf
        return cls(
            torque=torque, back_emf=np.zeros(count), speed=speed,
            lower=np.array(model.lowerPositionLimit[7:]), upper=np.array(model.upperPositionLimit[7:]),
            armature=np.zeros(count) if armature is None else armature,
        )  # fmt: skip


class WholeBodyModel:
    """A floating-base robot with point feet, as constants of the whole-body problem.

    Attributes:
        pin_model: Pinocchio model: free flyer, then revolute joints.
        feet: names of the feet's frames, in the order of every array of feet.
        frames: their indices in the model.
        actuators: limits of motors and joints.
        joints: number of joints nj.
        mass: kg.
        weight: N.
        size: m, radius of gyration of the robot in `posture`: turns moments into forces of like size.
        posture: (nq,) configuration to fall back to when the state is unknown.
    """

    def __init__(
        self, pin_model: pin.Model, feet: Sequence[str], actuators: Actuators, posture: FloatArray
    ) -> None:
        """Check and keep; use `from_robot` or `from_pinocchio`.

        Raises:
            ConfigurationError: a foot's name is no frame of the model, a foot hangs on no
                joint, or a joint is neither the free flyer nor revolute.
        """
        self.joints = len(tree_joints(pin_model))
        self.pin_model = pin_model
        self.feet = tuple(feet)
        self.frames = tuple(_frame(pin_model, name) for name in self.feet)
        if not self.feet or len(set(self.feet)) != len(self.feet):
            raise ConfigurationError(f"the feet must be different frames, at least one, not {self.feet}")
        self.actuators = actuators
        if len(actuators.torque) != self.joints or np.shape(posture) != (pin_model.nq,):
            raise ConfigurationError(
                f"robot '{pin_model.name}' has {self.joints} joints and nq = {pin_model.nq}: limits of "
                f"{len(actuators.torque)} joints and a posture of {np.size(posture)} values do not fit"
            )
        self.posture = np.array(posture, dtype=np.float64)
        data = pin_model.createData()
        pin.ccrba(pin_model, data, self.posture, np.zeros(pin_model.nv))
        self.mass = float(data.Ig.mass)
        self.weight = self.mass * float(np.linalg.norm(pin_model.gravity.linear))
        self.size = float(np.sqrt(np.trace(data.Ig.inertia) / 3.0 / self.mass))

    @classmethod
    def from_robot(cls, robot: RobotModel, *, rotor_inertia: bool = True) -> WholeBodyModel:
        """The model of a BlueFoot: its servos' torque falls with speed and follows the voltage.

        Args:
            robot: the robot.
            rotor_inertia: count the servos' rotors, seen through their gears.
        """
        servo, count = robot.parameters.servo, len(robot.joint_names)
        actuators = Actuators(
            torque=np.full(count, servo.stall_torque), back_emf=np.full(count, servo.back_emf),
            speed=np.full(count, servo.no_load_speed), lower=robot.lower, upper=robot.upper,
            armature=np.full(count, servo.armature if rotor_inertia else 0.0),
            nominal_voltage=servo.nominal_voltage,
        )  # fmt: skip
        return cls(robot.pin_model, [f"{leg}_foot" for leg in LEGS], actuators, robot.default_stance())

    @classmethod
    def from_pinocchio(
        cls,
        pin_model: pin.Model,
        feet: Sequence[str],
        actuators: Actuators | None = None,
        posture: FloatArray | None = None,
    ) -> WholeBodyModel:
        """The model of any robot with a free flyer, revolute joints and named point feet.

        Args:
            pin_model: the robot.
            feet: names of the frames of its feet.
            actuators: limits; by default what the model's file says, with torque motors.
            posture: (nq,) configuration to fall back to; by default Pinocchio's neutral one.

        Raises:
            ConfigurationError: a foot's name is unknown, or a joint is not revolute.
        """
        if posture is None:
            posture = np.array(pin.neutral(pin_model))
        return cls(pin_model, feet, actuators or Actuators.from_pinocchio(pin_model), posture)


def _frame(model: pin.Model, name: str) -> int:
    if not model.existFrame(name):
        bodies: Any = [f.name for f in model.frames if f.type == pin.FrameType.BODY and f.parentJoint > 1]
        raise ConfigurationError(
            f"robot '{model.name}' has no frame '{name}' for a foot. Frames of bodies on its legs: "
            f"{', '.join(sorted(bodies)) or 'none'}"
        )
    index = int(model.getFrameId(name))
    if model.frames[index].parentJoint < 2:
        raise ConfigurationError(
            f"frame '{name}' of robot '{model.name}' sits on the trunk: no joint moves it"
        )
    return index
