"""The leader's body in MuJoCo: chassis, wheels at their places, and the marker on a mast.

The chassis moves on three joints, along x, along y and about z, and has a mass;
what moves it is a force. Wheels and the tilting upper part weigh nothing of their
own: they are welded to the chassis at angles that are shown, not simulated.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import mujoco

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.sim.leader_config import LeaderConfig
from bluefoot_mpc.sim.worlds.build import MARKER_GEOM, THING_GROUP
from bluefoot_mpc.sim.worlds.plan import Marker
from bluefoot_mpc.wheels.ready import READY
from bluefoot_mpc.wheels.wheel import Wheel

LEADER, FRAME = "leader", "leader_frame"
"""Names of the body that drives, and of the part of it that carries the marker and may tilt."""

JOINTS = ("leader_x", "leader_y", "leader_yaw")

MASS = 2.5
"""kg, about the robot's."""
YAW_INERTIA = 0.02
"""kg·m², about the vertical."""

Quaternion = tuple[float, float, float, float]
"""w, x, y, z."""


class Part(NamedTuple):
    """A piece of a chassis.

    Attributes:
        shape: an upright cylinder (disc) or a box.
        size: m, half length, half width, half height; of a disc radius twice.
        at: m, centre over the leader's point on the floor.
    """

    shape: Literal["box", "disc"]
    size: tuple[float, float, float]
    at: tuple[float, float, float]


CHASSIS: dict[str, tuple[Part, ...]] = {
    "differential": (
        Part("disc", (0.070, 0.070, 0.024), (0.0, 0.0, 0.049)),
        Part("box", (0.012, 0.072, 0.008), (0.0, 0.0, 0.035)),
        Part("disc", (0.010, 0.010, 0.011), (0.052, 0.0, 0.014)),
        Part("disc", (0.010, 0.010, 0.011), (-0.052, 0.0, 0.014)),
    ),
    "balancing": (
        Part("box", (0.026, 0.072, 0.045), (0.0, 0.0, 0.080)),
        Part("box", (0.014, 0.078, 0.012), (0.0, 0.0, 0.040)),
    ),
    "tricycle": (
        Part("box", (0.050, 0.056, 0.018), (0.005, 0.0, 0.048)),
        Part("box", (0.065, 0.018, 0.009), (0.110, 0.0, 0.075)),
        Part("disc", (0.010, 0.010, 0.016), (0.160, 0.0, 0.094)),
        Part("box", (0.006, 0.045, 0.005), (0.155, 0.0, 0.112)),
    ),
    "ackermann": (
        Part("box", (0.140, 0.056, 0.020), (0.090, 0.0, 0.044)),
        Part("box", (0.062, 0.050, 0.018), (0.050, 0.0, 0.082)),
    ),
    "bicycle": (
        Part("box", (0.090, 0.010, 0.009), (0.090, 0.0, 0.112)),
        Part("box", (0.030, 0.018, 0.008), (0.0, 0.0, 0.120)),
        Part("box", (0.005, 0.004, 0.034), (0.0, 0.013, 0.080)),
        Part("box", (0.005, 0.004, 0.034), (0.0, -0.013, 0.080)),
        Part("disc", (0.009, 0.009, 0.020), (0.180, 0.0, 0.123)),
        Part("box", (0.006, 0.060, 0.005), (0.172, 0.0, 0.144)),
    ),
    "omni": (
        Part("disc", (0.080, 0.080, 0.012), (0.0, 0.0, 0.078)),
        Part("disc", (0.045, 0.045, 0.024), (0.0, 0.0, 0.045)),
    ),
    "mecanum": (
        Part("box", (0.115, 0.064, 0.016), (0.0, 0.0, 0.040)),
        Part("box", (0.090, 0.085, 0.008), (0.0, 0.0, 0.074)),
        Part("box", (0.060, 0.050, 0.008), (0.0, 0.0, 0.060)),
    ),
    "omni_steer": (
        Part("disc", (0.062, 0.062, 0.020), (-0.025, 0.0, 0.046)),
        Part("box", (0.060, 0.026, 0.009), (0.040, 0.0, 0.076)),
        Part("disc", (0.016, 0.016, 0.014), (0.090, 0.0, 0.078)),
    ),
    "two_steer": (
        Part("box", (0.115, 0.034, 0.011), (0.0, 0.0, 0.076)),
        Part("box", (0.050, 0.030, 0.020), (0.0, 0.0, 0.045)),
        Part("box", (0.016, 0.085, 0.006), (0.0, 0.0, 0.070)),
        Part("disc", (0.016, 0.016, 0.012), (0.090, 0.0, 0.090)),
        Part("disc", (0.016, 0.016, 0.012), (-0.090, 0.0, 0.090)),
        Part("disc", (0.006, 0.006, 0.016), (0.0, 0.072, 0.048)),
        Part("disc", (0.006, 0.006, 0.016), (0.0, -0.072, 0.048)),
    ),
}
"""What stands on the wheels of each kind; none of it touches the floor."""

_CHASSIS_RGBA = (0.24, 0.36, 0.46, 1.0)
_TRIM_RGBA = (0.80, 0.80, 0.78, 1.0)
_TYRE_RGBA = (0.12, 0.12, 0.13, 1.0)
_MAST_RGBA = (0.35, 0.35, 0.36, 1.0)
_MAST_RADIUS = 0.008
_TYRE_HALF_WIDTH = 0.008
_CASTOR_HALF_WIDTH = 0.005
_ROLLERS = 9
# The robot collides with what accepts its bit 2, and walls with what accepts or has bit 1:
# wheels stand on the floor, so the floor must not feel them.
_WALLS_AND_ROBOT, _ROBOT = (1, 3), (0, 2)
_ALONG_X: Quaternion = (math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0)


def wheel_body(index: int) -> str:
    """Name of the body of a wheel."""
    return f"leader_wheel{index}"


def wheel_quaternion(wheel: Wheel, steering: float, angle: float) -> Quaternion:
    """How a wheel stands in the leader's frame: x along its axis, turned by what it has rolled.

    Args:
        wheel: any kind; of a castor its swing alone is shown.
        steering: rad, left positive.
        angle: rad that it has turned; positive rolls ahead.
    """
    half, spin = 0.5 * (wheel.alpha + wheel.beta + steering), 0.0 if wheel.kind == "castor" else 0.5 * angle
    c, s, cs, ss = math.cos(half), math.sin(half), math.cos(spin), math.sin(spin)
    return c * cs, c * ss, s * ss, s * cs


def add_leader(spec: mujoco.MjSpec, config: LeaderConfig, visuals: bool = False) -> None:
    """Add the leader at its start, where the configuration has one.

    Args:
        spec: robot and world.
        config: of the leader.
        visuals: also what is only to look at, rollers and hubs.

    Raises:
        ConfigurationError: the world has a marker already.
    """
    if not config.kind:
        return
    if spec.geom(MARKER_GEOM) is not None:
        raise ConfigurationError(
            "this world has a marker of its own, and the leader would carry another:"
            " take a world without one (flat, arena), or no leader"
        )
    robot = READY[config.kind]()
    leader = spec.worldbody.add_body(name=LEADER, pos=[config.distance, 0.0, 0.0])
    # Its own inertia stands for all of it, about the point that turns.
    leader.explicitinertial = True
    leader.mass, leader.ipos = MASS, [0.0, 0.0, 0.05]
    leader.inertia = [YAW_INERTIA, YAW_INERTIA, YAW_INERTIA]
    slide, hinge = mujoco.mjtJoint.mjJNT_SLIDE, mujoco.mjtJoint.mjJNT_HINGE
    axes = ((slide, [1.0, 0.0, 0.0]), (slide, [0.0, 1.0, 0.0]), (hinge, [0.0, 0.0, 1.0]))
    for name, (kind, axis) in zip(JOINTS, axes, strict=True):
        leader.add_joint(name=name, type=kind, axis=axis)
    _add_frame(leader, config.kind, tilts_at=robot.wheels[0].radius)
    for index, wheel in enumerate(robot.wheels):
        x, y = wheel.position.tolist()
        body = leader.add_body(
            name=wheel_body(index), pos=[x, y, wheel.radius], quat=wheel_quaternion(wheel, 0.0, 0.0)
        )
        _add_wheel(body, wheel, visuals)


def _add_frame(leader: mujoco.MjsBody, kind: str, tilts_at: float) -> None:
    """Chassis, mast and ball, in a frame at the height of the first wheel's axle."""
    frame = leader.add_body(name=FRAME, pos=[0.0, 0.0, tilts_at])
    shapes = {"box": mujoco.mjtGeom.mjGEOM_BOX, "disc": mujoco.mjtGeom.mjGEOM_CYLINDER}
    parts = CHASSIS[kind]
    for index, part in enumerate(parts):
        length, width, height = part.size
        x, y, z = part.at
        geom = frame.add_geom(
            name=f"leader_chassis{index}",
            type=shapes[part.shape],
            size=[length, width, height] if part.shape == "box" else [length, height, 0.0],
            pos=[x, y, z - tilts_at],
        )
        _dress(geom, _CHASSIS_RGBA if index == 0 else _TRIM_RGBA, _WALLS_AND_ROBOT)
    marker = Marker(x=0.0, y=0.0)
    foot = max(part.at[2] + part.size[2] for part in parts if abs(part.at[0]) <= part.size[0])
    half = 0.5 * (marker.z - foot)
    mast = frame.add_geom(
        name="leader_mast",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[_MAST_RADIUS, half, 0.0],
        pos=[0.0, 0.0, foot + half - tilts_at],
    )
    _dress(mast, _MAST_RGBA, _WALLS_AND_ROBOT)
    ball = frame.add_geom(
        name=MARKER_GEOM,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[marker.radius, 0.0, 0.0],
        pos=[0.0, 0.0, marker.z - tilts_at],
    )
    _dress(ball, (*marker.colour, 1.0), _WALLS_AND_ROBOT)


def _add_wheel(body: mujoco.MjsBody, wheel: Wheel, visuals: bool) -> None:
    is_castor, is_swedish = wheel.kind == "castor", wheel.kind == "swedish"
    # Along v from the pivot, which is -y of a frame whose x is the axis.
    centre = [0.0, -wheel.offset, 0.0]
    half = _CASTOR_HALF_WIDTH if is_castor else _TYRE_HALF_WIDTH
    radius = wheel.radius - (wheel.roller_radius if is_swedish and visuals else 0.0)
    tyre = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CYLINDER, size=[radius, half, 0.0], pos=centre, quat=_ALONG_X
    )
    _dress(tyre, _TRIM_RGBA if is_swedish and visuals else _TYRE_RGBA, _ROBOT)
    if not visuals:
        return
    spoke = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX, size=[half + 0.001, 0.004, 0.75 * radius], pos=centre
    )
    _dress(spoke, _TYRE_RGBA if is_swedish else _TRIM_RGBA, (0, 0))
    for index in range(_ROLLERS if is_swedish else 0):
        _add_roller(body, wheel, 2.0 * math.pi * index / _ROLLERS)


def _add_roller(body: mujoco.MjsBody, wheel: Wheel, turn: float) -> None:
    """A roller, `turn` (rad) around the wheel from its lowest point, where its axis is gamma from v."""
    sine, cosine = math.sin(turn), math.cos(turn)
    away = wheel.radius - wheel.roller_radius
    across, along = math.sin(wheel.gamma), -math.cos(wheel.gamma)
    middle = (0.0, away * sine, -away * cosine)
    reach = 0.008
    axis = (across, along * cosine, along * sine)
    ends = [m + sign * reach * a for sign in (-1.0, 1.0) for m, a in zip(middle, axis, strict=True)]
    roller = body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE, size=[wheel.roller_radius, 0.0, 0.0], fromto=ends
    )
    _dress(roller, _TYRE_RGBA, (0, 0))


def _dress(geom: mujoco.MjsGeom, rgba: tuple[float, float, float, float], collides: tuple[int, int]) -> None:
    """What is the same for all of a leader's shapes: seen, weightless, colliding with what it may."""
    geom.rgba, geom.group, geom.mass = rgba, THING_GROUP, 0.0
    geom.contype, geom.conaffinity = collides
