"""Any robot with torque motors, from its URDF, on MuJoCo's floor: point feet, ideal sensors.

Beside the simulated BlueFoot, for robots that are not: no servo, no bus, no delay, no
noise. Only the feet touch the ground.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mujoco
import numpy as np
import pinocchio as pin

from bluefoot_mpc.exceptions import ConfigurationError, SimulationError
from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.sim.world import FOOT_SOLREF, FRICTION_STIFFNESS
from bluefoot_mpc.types import FloatArray

_ROOT = "torque_robot_root"
_NET_FORCE = 3  # MuJoCo's code: all contacts of a geom as one force, world axes
_SENSED = 4  # numbers per foot: contacts found, force
_KEPT = ("link", "joint")  # of a URDF; the rest is looks, transmissions, other simulators
_LOOKS = ("visual", "collision")
_TENSOR = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(frozen=True, kw_only=True, slots=True)
class TorqueWorldConfig:
    """What may be chosen about the world and the feet."""

    physics_period: float = 0.001  # s
    friction: float = 0.8  # Coulomb, feet on the ground
    foot_radius: float = 0.02  # m, ball around the foot's frame

    def __post_init__(self) -> None:
        require_positive(physics_period=self.physics_period, foot_radius=self.foot_radius)
        require_nonnegative(friction=self.friction)


class TorqueRobot:
    """A floating robot whose joints get exactly the torques asked for, up to their limits.

    State and torques are in Pinocchio's coordinates and order of joints, whatever the
    order in the URDF. It starts in the given posture, at rest.

    Attributes:
        config: of world and feet.
        model: MuJoCo's model, for viewers and tests.
        data: MuJoCo's state. Do not write to it.
    """

    def __init__(
        self,
        pin_model: pin.Model,
        urdf: Path,
        feet: Sequence[str],
        posture: FloatArray,
        config: TorqueWorldConfig | None = None,
    ) -> None:
        """Compile the world.

        Args:
            pin_model: the robot as Pinocchio reads `urdf`: order of joints, limits, gravity.
            urdf: its file; meshes are not needed.
            feet: links that carry a ball and touch the ground.
            posture: (nq,) configuration to start from.
            config: world and feet.

        Raises:
            ConfigurationError: the file cannot be read, or lacks a foot's link or a joint.
        """
        self.config = config or TorqueWorldConfig()
        self._posture = np.array(posture, dtype=np.float64)
        if self._posture.shape != (pin_model.nq,):
            raise ConfigurationError(f"a posture of {pin_model.name} has {pin_model.nq} numbers")
        if not feet:
            raise ConfigurationError(f"name at least one foot of {pin_model.name}: nothing else can stand")
        spec = _robot_spec(urdf, feet, self.config)
        self._joints = _add_motors(spec, pin_model)
        _set_world(spec, np.array(pin_model.gravity.linear), self.config)
        try:
            self.model = spec.compile()
        except ValueError as error:
            raise ConfigurationError(f"{urdf}: {error}") from error
        self.data = mujoco.MjData(self.model)
        self._qpos = np.array([self.model.joint(name).qposadr[0] for name in self._joints])
        self._qvel = np.array([self.model.joint(name).dofadr[0] for name in self._joints])
        self._root = int(self.model.jnt_bodyid[self.model.joint(_ROOT).id])
        self._forces = self.data.sensordata.reshape(len(feet), _SENSED)[:, 1:]
        self.reset()

    def reset(self) -> None:
        """Standing in the posture, at rest."""
        mujoco.mj_resetData(self.model, self.data)
        q, qpos = self._posture, self.data.qpos
        qpos[:3], qpos[3:7] = q[:3], q[[6, 3, 4, 5]]
        qpos[self._qpos] = q[7:]
        mujoco.mj_forward(self.model, self.data)

    def step(self, torque: FloatArray, dt: float, push: FloatArray | None = None) -> None:
        """Hold joint torques for a while.

        Args:
            torque: (nj,) N·m, cut to the motors' limits.
            dt: s, a whole number of physics periods.
            push: (3,) N on the centre of mass of the root's link, world axes; None: none.

        Raises:
            SimulationError: the torque or the state is not finite any more.
            ConfigurationError: dt is no whole number of physics periods.
        """
        steps = round(dt / self.config.physics_period)
        if steps < 1 or not math.isclose(steps * self.config.physics_period, dt, rel_tol=1e-6):
            raise ConfigurationError(
                f"dt = {dt:g} s must be a whole number of physics periods of {self.config.physics_period:g} s"
            )
        if not np.isfinite(torque).all():
            raise SimulationError(f"torque that is not finite at t = {self.data.time:.3f} s")
        self.data.ctrl[:] = torque
        self.data.xfrc_applied[self._root, :3] = 0.0 if push is None else push
        mujoco.mj_step(self.model, self.data, nstep=steps)
        if not (np.isfinite(self.data.qpos).all() and np.isfinite(self.data.qvel).all()):
            raise SimulationError(f"the physics blew up at t = {self.data.time:.3f} s")

    @property
    def time(self) -> float:
        """Time since the reset, s."""
        return float(self.data.time)

    @property
    def q(self) -> FloatArray:
        """(nq,) true configuration: base position, quaternion x, y, z, w, joints; a new array."""
        qpos = self.data.qpos
        return np.concatenate([qpos[:3], qpos[[4, 5, 6, 3]], qpos[self._qpos]])

    @property
    def v(self) -> FloatArray:
        """(nv,) true velocity: base twist in the base frame, joints; a new array."""
        qvel = self.data.qvel
        linear = qvel[:3] @ rotation_from_quaternion(self.data.qpos[[4, 5, 6, 3]])
        return np.concatenate([linear, qvel[3:6], qvel[self._qvel]])

    @property
    def foot_force(self) -> FloatArray:
        """(k, 3) N, ground on foot in the last physics step, world axes; a new array."""
        force: FloatArray = 0.0 - self._forces  # the sensor gives foot on ground
        return force


def _robot_spec(urdf: Path, feet: Sequence[str], config: TorqueWorldConfig) -> mujoco.MjSpec:
    text, root = _bare_urdf(urdf)
    try:
        spec = mujoco.MjSpec.from_string(text)
    except ValueError as error:
        raise ConfigurationError(f"{urdf}: {error}") from error
    spec.body(root).add_freejoint(name=_ROOT)
    for foot in feet:
        body = spec.body(foot)
        if body is None:
            names = ", ".join(sorted(b.name for b in spec.bodies if b.name != "world"))
            raise ConfigurationError(f"{urdf.name} has no link '{foot}' for a foot; its links: {names}")
        _add_ball(spec, body, config)
    return spec


def _bare_urdf(urdf: Path) -> tuple[str, str]:
    """The URDF without looks and shapes, with what MuJoCo must know; and the name of its root link."""
    try:
        robot = ET.parse(urdf).getroot()
    except (OSError, ET.ParseError) as error:
        raise ConfigurationError(f"cannot read the URDF {urdf}: {error}") from error
    for element in list(robot):
        if element.tag not in _KEPT:
            robot.remove(element)
            continue
        for part in [part for part in element if part.tag in _LOOKS]:
            element.remove(part)
        for inertia in element.iter("inertia"):
            _make_possible(inertia)
    children = {joint.find("child").get("link") for joint in robot.iter("joint")}  # type: ignore[union-attr]
    roots = [str(link.get("name")) for link in robot.iter("link") if link.get("name") not in children]
    if len(roots) != 1:
        raise ConfigurationError(f"{urdf} must have one root link, not {roots}")
    # Without this the root is fused into the world, and the feet into the legs.
    ET.SubElement(ET.SubElement(robot, "mujoco"), "compiler", fusestatic="false", discardvisual="false")
    return ET.tostring(robot, encoding="unicode"), roots[0]


def _make_possible(inertia: ET.Element) -> None:
    """Replace a tensor that no body can have (ANYmal's dummy link has one) by a ball's of like size."""
    xx, xy, xz, yy, yz, zz = (float(inertia.get(key, 0.0)) for key in _TENSOR)
    low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if low + middle < high:
        mean = str((xx + yy + zz) / 3.0)
        inertia.attrib.update(dict.fromkeys(_TENSOR, "0"), ixx=mean, iyy=mean, izz=mean)


def _add_ball(spec: mujoco.MjSpec, body: mujoco.MjsBody, config: TorqueWorldConfig) -> None:
    name = f"{body.name}_ball"
    ball = body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[config.foot_radius, 0.0, 0.0])
    ball.mass = 0.0  # the link's inertia has it
    ball.contype, ball.conaffinity, ball.condim, ball.priority = 2, 1, 3, 1
    ball.friction = [config.friction, 0.005, 0.0001]
    ball.solref = list(FOOT_SOLREF)
    fields = mujoco.mjtConDataField
    spec.add_sensor(
        name=f"{body.name}_force",
        type=mujoco.mjtSensor.mjSENS_CONTACT,
        objtype=mujoco.mjtObj.mjOBJ_GEOM,
        objname=name,
        intprm=[1 << int(fields.mjCONDATA_FOUND) | 1 << int(fields.mjCONDATA_FORCE), _NET_FORCE, 1],
    )


def _add_motors(spec: mujoco.MjSpec, pin_model: pin.Model) -> list[str]:
    """A torque motor on every joint, in Pinocchio's order; the joints' names."""
    names = [str(name) for name in list(pin_model.names)[2:]]
    for index, name in enumerate(names):
        joint = spec.joint(name)
        if joint is None:
            raise ConfigurationError(f"the URDF of {pin_model.name} has no joint '{name}'")
        joint.damping, joint.frictionloss = [0.0, 0.0, 0.0], 0.0
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
        limit = float(pin_model.effortLimit[6 + index])
        if math.isfinite(limit) and limit > 0.0:
            motor.ctrllimited = mujoco.mjtLimited.mjLIMITED_TRUE
            motor.ctrlrange = [-limit, limit]
    return names


def _set_world(spec: mujoco.MjSpec, gravity: FloatArray, config: TorqueWorldConfig) -> None:
    option = spec.option
    option.timestep, option.gravity = config.physics_period, gravity
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, FRICTION_STIFFNESS
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    # MuJoCo 4.0.0's Newton solver is wrong with sparse constraint Jacobians.
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    bits = mujoco.mjtDisableBit
    option.disableflags |= int(bits.mjDSBL_ISLAND) | int(bits.mjDSBL_AUTORESET)
    spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[0.0, 0.0, 1.0])
