"""The MuJoCo model of a robot in a world."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import mujoco

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.parameters import GRAVITY, RobotParameters
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.sim.config import OPEN_WORLDS, SensorConfig, SimConfig, WorldConfig
from bluefoot_mpc.sim.leader_body import add_leader
from bluefoot_mpc.sim.randomization import Draw
from bluefoot_mpc.sim.scenery import add_scenery
from bluefoot_mpc.sim.terrain import add_ground
from bluefoot_mpc.sim.worlds.build import FLOOR_GROUP, THING_GROUP, add_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import JOINTS, LEGS

FOOT_SOLREF = (0.004, 1.0)
"""s and damping ratio of the rubber ball on hard ground: 0.07 mm of give under 5 N."""

FRICTION_STIFFNESS = 20.0
"""Stiffness of sticking over that of the normal contact. At 1 the robot creeps down a
15 degree slope by 1.5 mm/s, at 20 by 0.1 mm/s, for the same computing time."""

_VISUAL_GROUP, _COLLISION_GROUP = 2, 3
_ROBOT_BIT = 2


@dataclass(frozen=True, slots=True)
class World:
    """A compiled model and where the robot is in its arrays.

    Attributes:
        model: MuJoCo model.
        data: its state.
        trunk: body of the trunk.
        q: first entry of the robot in qpos.
        v: first entry of the robot in qvel.
        ctrl: first servo in ctrl.
        foot_geoms: (4,) geoms of the foot balls.
        body_of_part: for every geom, the name of its body where it is a part of
            the robot other than a foot, else "".
        sensor: first entry of the robot's sensors: magnetometer (3), then of each
            foot how many contacts it has and the force of the ground on it (4 x 4).
    """

    model: mujoco.MjModel
    data: mujoco.MjData
    trunk: int
    q: int
    v: int
    ctrl: int
    foot_geoms: tuple[int, ...]
    body_of_part: tuple[str, ...]
    sensor: int


def build_world(robot: RobotModel, config: SimConfig, draw: Draw, plan: WorldPlan | None = None) -> World:
    """Compile robot and world, with what was drawn for this run.

    Args:
        robot: its model.
        config: the simulation.
        draw: what is different in this run.
        plan: what stands in the world, where the configuration names a planned one.

    Raises:
        ConfigurationError: the world's file is not an MJCF model that the robot can stand in.
    """
    spec = _robot_spec(robot, config, draw)
    _set_options(spec, config)
    try:
        _add_world(spec, config.world, plan)
        add_leader(spec, config.leader, config.visuals)
        if config.camera.enabled:
            add_scenery(spec, config.world.name in OPEN_WORLDS or plan is not None)
        model = spec.compile()
    except ValueError as error:
        raise ConfigurationError(f"world '{config.world.name}': {error}") from error
    data = mujoco.MjData(model)
    _randomize_bodies(model, data, draw)
    return _locate(model, data)


def _add_world(spec: mujoco.MjSpec, config: WorldConfig, plan: WorldPlan | None) -> None:
    if config.name in OPEN_WORLDS or plan is not None:
        spec.worldbody.add_light(
            pos=[0.0, 0.0, 4.0], dir=[0.2, 0.1, -1.0], type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        )
        add_ground(spec, config, plan.floor if plan is not None else 0.0)
        if plan is not None:
            add_plan(spec, plan)
        return
    half = -0.5 * config.slope
    frame = spec.worldbody.add_frame(quat=[math.cos(half), 0.0, math.sin(half), 0.0])
    world = mujoco.MjSpec.from_file(str(Path(config.name).resolve()))
    ground = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    for geom in world.geoms:
        geom.group = FLOOR_GROUP if geom.type in ground else THING_GROUP
    spec.attach(world, frame=frame, prefix="world_")


def _set_options(spec: mujoco.MjSpec, config: SimConfig) -> None:
    option = spec.option
    option.timestep = config.physics_period
    option.gravity = [0.0, 0.0, -GRAVITY]
    option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    option.impratio = FRICTION_STIFFNESS
    option.solver = mujoco.mjtSolver.mjSOL_NEWTON
    # MuJoCo 4.0.0's Newton solver is wrong with sparse constraint Jacobians.
    option.jacobian = mujoco.mjtJacobian.mjJAC_DENSE
    # One robot is one island: looking for more costs 6 % of a step and changes nothing.
    # A blown-up state must be seen (`SimRobot` checks), not silently replaced by the start.
    bits = mujoco.mjtDisableBit
    option.disableflags |= int(bits.mjDSBL_ISLAND) | int(bits.mjDSBL_AUTORESET)
    dip = math.radians(config.sensors.magnetic_inclination_deg)
    option.magnetic = [math.cos(dip), 0.0, -math.sin(dip)]


def _robot_spec(robot: RobotModel, config: SimConfig, draw: Draw) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_string(robot.urdf)
    spec.body("trunk").add_freejoint(name="root")
    _set_contacts(spec, draw.friction)
    _set_visuals(spec, config.visuals)
    _add_servos(spec, robot.parameters)
    _add_sensors(spec, robot.parameters, config.sensors)
    mass, *position = config.world.payload
    if mass > 0.0:
        payload = spec.body("trunk").add_body(name="payload", pos=position)
        side = 0.5 * min(0.10, max(0.02, (mass / 2000.0) ** (1.0 / 3.0)))
        geom = payload.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[side] * 3, mass=mass)
        geom.contype, geom.conaffinity, geom.group = 0, 0, _VISUAL_GROUP
        geom.rgba = [0.75, 0.25, 0.15, 1.0]
    return spec


def _set_contacts(spec: mujoco.MjSpec, friction: float) -> None:
    """The robot touches the world, not itself; a foot's rubber decides friction and stiffness."""
    for geom in spec.geoms:
        if geom.contype == 0 and geom.conaffinity == 0:
            continue
        geom.group = _COLLISION_GROUP
        geom.contype, geom.conaffinity = _ROBOT_BIT, 1
        if geom.name.endswith("_foot_ball"):
            geom.priority = 1
            geom.condim = 3
            geom.friction = [friction, 0.005, 0.0001]
            geom.solref = list(FOOT_SOLREF)


def _set_visuals(spec: mujoco.MjSpec, keep: bool) -> None:
    """Mark the shapes that are only to look at; they cost 10 % of a step, so runs drop them."""
    for geom in list(spec.geoms):
        if geom.contype == 0 and geom.conaffinity == 0:
            geom.group = _VISUAL_GROUP
            if not keep:
                spec.delete(geom)


def _add_servos(spec: mujoco.MjSpec, parameters: RobotParameters) -> None:
    lower, upper = parameters.legs.physical_limits_deg.radians()
    for index, name in enumerate(JOINTS):
        joint = spec.joint(name)
        joint.armature = parameters.servo.armature
        # Both are written at run time; they must not be zero here, or MuJoCo drops the rows.
        joint.frictionloss = max(parameters.servo.coulomb_friction, 1e-6)
        joint.damping = [parameters.servo.back_emf + parameters.servo.viscous_friction, 0.0, 0.0]
        joint.limited = mujoco.mjtLimited.mjLIMITED_TRUE
        joint.range = [float(lower[index % 4]), float(upper[index % 4])]
        servo = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        servo.set_to_motor()


def _add_sensors(spec: mujoco.MjSpec, parameters: RobotParameters, config: SensorConfig) -> None:
    spec.body("trunk").add_site(name="imu", pos=list(parameters.sensors.imu))
    kinds, fields = mujoco.mjtSensor, mujoco.mjtConDataField
    data = 1 << int(fields.mjCONDATA_FOUND) | 1 << int(fields.mjCONDATA_FORCE)
    spec.add_sensor(
        name="magnetometer", type=kinds.mjSENS_MAGNETOMETER, objtype=mujoco.mjtObj.mjOBJ_SITE, objname="imu"
    )
    for leg in LEGS:
        spec.add_sensor(
            name=f"{leg}_force",
            type=kinds.mjSENS_CONTACT,
            objtype=mujoco.mjtObj.mjOBJ_GEOM,
            objname=f"{leg}_foot_ball",
            intprm=[data, 3, 1],
        )


def _randomize_bodies(model: mujoco.MjModel, data: mujoco.MjData, draw: Draw) -> None:
    trunk = model.body("trunk").id
    robot = model.body_rootid == trunk
    model.body_mass[robot] *= draw.mass_factor
    model.body_inertia[robot] *= draw.mass_factor
    model.body_ipos[trunk] += draw.com_offset
    mujoco.mj_setConst(model, data)


def _locate(model: mujoco.MjModel, data: mujoco.MjData) -> World:
    trunk = model.body("trunk").id
    feet = tuple(int(model.geom(f"{leg}_foot_ball").id) for leg in LEGS)
    parts = [""] * model.ngeom
    for geom in range(model.ngeom):
        body = model.geom_bodyid[geom]
        if model.body_rootid[body] == trunk and geom not in feet:
            parts[geom] = model.body(body).name
    first = model.joint(JOINTS[0])
    return World(
        model=model,
        data=data,
        trunk=trunk,
        q=int(first.qposadr[0]) - 7,
        v=int(first.dofadr[0]) - 6,
        ctrl=int(model.actuator(JOINTS[0]).id),
        foot_geoms=feet,
        body_of_part=tuple(parts),
        sensor=int(model.sensor("magnetometer").adr[0]),
    )
