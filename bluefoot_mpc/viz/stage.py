"""What stands and moves around the robot in the 3D views: solids, marker, and a leader on its wheels."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion, rotation_from_rpy
from bluefoot_mpc.sim.worlds.plan import Marker, Solid, WorldPlan
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.scene import Command, Visual, group, transform, translation
from bluefoot_mpc.viz.surroundings import plan_of
from bluefoot_mpc.wheels.ready import READY
from bluefoot_mpc.wheels.robot import WheeledRobot
from bluefoot_mpc.wheels.steering import steering_for
from bluefoot_mpc.wheels.wheel import Wheel

WORLD, LEADER = "/meshcat/world", "/meshcat/leader"
_POST_RADIUS = 0.008
_POST = (0.35, 0.35, 0.36)
_CHASSIS, _TRIM, _TYRE = (0.24, 0.36, 0.46), (0.80, 0.80, 0.78), (0.12, 0.12, 0.13)
_TYRE_WIDTH = 0.016
_SLOW = 0.005
"""m/s and rad/s: below, a leader's steering stays as it was."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Stage:
    """Surroundings to draw; without any, the robot stands alone.

    Attributes:
        plan: of the world; None draws open floor.
        leader: kind of the wheeled robot that goes ahead; empty without one.
        foot_radius: m, from the points drawn as feet down to the ground, where that is uneven.
    """

    plan: WorldPlan | None = None
    leader: str = ""
    foot_radius: float = 0.0


def stage_of(config: Mapping[str, Any]) -> Stage:
    """The surroundings of a run.

    Args:
        config: everything resolved, as a run records it.
    """
    leader = config.get("sim", {}).get("leader", {}).get("kind", "")
    return Stage(plan=plan_of(config), leader=str(leader))


def stage_data(stage: Stage) -> dict[str, Any]:
    """Shapes and moving parts, ready for JSON; to be added to the robot's own."""
    commands: list[Command] = []
    bounds, rough = None, {}
    if stage.plan is not None:
        commands.append(group(f"{WORLD}/things", [_solid(solid) for solid in stage.plan.solids]))
        if stage.plan.marker is not None:
            commands.append(group(f"{WORLD}/marker", _standing_marker(stage.plan.marker)))
        if stage.plan.is_even:
            bounds = list(stage.plan.bounds)
        else:
            # No room to look around in, but ground to look at from near by.
            rough = {"rough": {"floor": stage.plan.floor, "below": stage.foot_radius}}
    leader = None
    if stage.leader in READY:
        wheeled = READY[stage.leader]()
        commands += leader_commands(stage.leader, wheeled)
        leader = {
            "axle": wheeled.wheels[0].radius,
            "wheels": [_wheel_node(k, w) for k, w in enumerate(wheeled.wheels)],
        }
    return {"surroundings": commands, "bounds": bounds, "leader": leader, **rough}


def leader_commands(kind: str, wheeled: WheeledRobot) -> list[Command]:
    """A leader: what tilts (chassis, mast, marker) in one node, its wheels in one each."""
    # The chassis is described beside MuJoCo's, which pages without a leader do not need.
    from bluefoot_mpc.sim.leader_body import CHASSIS  # noqa: PLC0415

    axle = wheeled.wheels[0].radius
    parts = CHASSIS.get(kind, ())
    path = f"{LEADER}/frame"
    visuals = []
    for index, part in enumerate(parts):
        length, width, height = part.size
        x, y, z = part.at
        visuals.append(
            Visual(
                path=f"{path}/part{index}", shape="box" if part.shape == "box" else "cylinder",
                size=(2 * length, 2 * width, 2 * height) if part.shape == "box" else (length, 2 * height),
                placement=translation(x, y, z - axle), colour=_hex(_TRIM if index else _CHASSIS),
            )
        )  # fmt: skip
    visuals += _ball_and_post(path, Marker(x=0.0, y=0.0), foot=0.05, below=axle)
    commands = [group(f"{path}/shapes", visuals)]
    for index, wheel in enumerate(wheeled.wheels):
        x, y = wheel.position.tolist()
        node = f"{LEADER}/wheels/wheel{index}"
        commands += [
            transform(node, translation(x, y, wheel.radius)),
            group(f"{node}/shapes", _wheel(node, wheel)),
        ]
    return commands


def wheel_angles(speeds: FloatArray, time: FloatArray) -> FloatArray:
    """(n, k) rad that wheels have turned, of their speeds (n, k) rad/s at (n,) s."""
    steps = np.diff(time, prepend=time[:1])
    return np.cumsum(speeds * steps[:, None], axis=0)


def wheel_steering(wheeled: WheeledRobot, pose: FloatArray, time: FloatArray) -> FloatArray:
    """(n, k) rad, how the wheels must stand for the motion of a leader; kept where it rests.

    Args:
        wheeled: the leader.
        pose: (n, 7) position (m) and quaternion xyzw in world.
        time: (n,) s.
    """
    angles = np.zeros((len(time), len(wheeled.wheels)))
    if not any(wheel.turns for wheel in wheeled.wheels) or len(time) < 2:
        return angles
    yaw = np.unwrap([math.atan2(*rotation_from_quaternion(row[3:])[[1, 0], 0]) for row in pose])
    rate = np.gradient(np.column_stack([pose[:, :2], yaw]), time, axis=0)
    c, s = np.cos(yaw), np.sin(yaw)
    twist = np.column_stack([c * rate[:, 0] + s * rate[:, 1], c * rate[:, 1] - s * rate[:, 0], rate[:, 2]])
    for k, row in enumerate(twist):
        moves = math.hypot(row[0], row[1]) > _SLOW or abs(row[2]) > _SLOW
        angles[k] = steering_for(wheeled, row) if moves else angles[k - 1] if k else 0.0
    return angles


def _wheel_node(index: int, wheel: Wheel) -> dict[str, Any]:
    """How the page turns a wheel: about z by the axis' direction and steering, then about the axis."""
    return {"axis": wheel.alpha + wheel.beta, "rolls": wheel.kind != "castor", "index": index}


def _wheel(node: str, wheel: Wheel) -> list[Visual]:
    """A tyre whose axis is x, and a spoke that shows how it turns."""
    along_x = np.eye(4)
    along_x[:3, :3] = [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]
    along_x[1, 3] = -wheel.offset
    spoke = translation(0.0, -wheel.offset, 0.0)
    tyre = _TRIM if wheel.kind == "swedish" else _TYRE
    return [
        Visual(
            path=f"{node}/tyre", shape="cylinder", size=(wheel.radius, _TYRE_WIDTH), placement=along_x,
            colour=_hex(tyre),
        ),
        Visual(
            path=f"{node}/spoke", shape="box", size=(_TYRE_WIDTH + 0.002, 0.008, 1.5 * wheel.radius),
            placement=spoke, colour=_hex(_TYRE if wheel.kind == "swedish" else _TRIM),
        ),
    ]  # fmt: skip


def _solid(solid: Solid) -> Visual:
    placement = translation(solid.x, solid.y, solid.z)
    c, s = math.cos(solid.yaw), math.sin(solid.yaw)
    placement[:2, :2] = [[c, -s], [s, c]]
    if solid.pitch:
        placement[:3, :3] = rotation_from_rpy(np.array([0.0, solid.pitch, solid.yaw]))
    size = solid.size if solid.shape == "box" else (0.5 * solid.size[0], solid.size[2])
    return Visual(
        path=f"{WORLD}/things/{solid.name}", shape=solid.shape, size=size, placement=placement,
        colour=_hex(solid.colour),
    )  # fmt: skip


def _standing_marker(marker: Marker) -> list[Visual]:
    return [
        Visual(
            path=visual.path, shape=visual.shape, size=visual.size, colour=visual.colour,
            placement=translation(marker.x, marker.y, 0.0) @ visual.placement,
        )
        for visual in _ball_and_post(f"{WORLD}/marker", marker, foot=0.0, below=0.0)
    ]  # fmt: skip


def _ball_and_post(path: str, marker: Marker, *, foot: float, below: float) -> list[Visual]:
    """Ball and post over the origin; `foot` is where the post begins, `below` the origin's height (m)."""
    height = marker.z - foot
    return [
        Visual(
            path=f"{path}/post", shape="cylinder", size=(_POST_RADIUS, height),
            placement=translation(0.0, 0.0, foot + 0.5 * height - below), colour=_hex(_POST),
        ),
        Visual(
            path=f"{path}/ball", shape="sphere", size=(marker.radius,),
            placement=translation(0.0, 0.0, marker.z - below), colour=_hex(marker.colour),
        ),
    ]  # fmt: skip


def _hex(colour: tuple[float, float, float]) -> int:
    red, green, blue = (round(255 * part) for part in colour)
    return (red << 16) + (green << 8) + blue
