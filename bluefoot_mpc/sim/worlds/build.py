"""What MuJoCo makes of a world plan."""

from __future__ import annotations

import math

import mujoco

from bluefoot_mpc.sim.worlds.plan import Marker, Solid, WorldPlan

FLOOR_GROUP, THING_GROUP = 0, 1
"""MuJoCo geom groups of the ground, and of what stands on it."""

MARKER_GEOM = "marker"
"""Name of the marker's ball, wherever it is: on a post or on a leader."""

_POST_RADIUS = 0.008
_POST_RGBA = (0.35, 0.35, 0.36, 1.0)


def add_plan(spec: mujoco.MjSpec, plan: WorldPlan) -> None:
    """Add solids and marker to the world body; the floor is the caller's."""
    kinds = {"box": mujoco.mjtGeom.mjGEOM_BOX, "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER}
    for solid in plan.solids:
        length, width, height = (0.5 * size for size in solid.size)
        geom = spec.worldbody.add_geom(
            name=solid.name,
            type=kinds[solid.shape],
            size=[length, width, height] if solid.shape == "box" else [length, height, 0.0],
            pos=[solid.x, solid.y, solid.z],
            quat=_quaternion(solid),
        )
        geom.group = FLOOR_GROUP if solid.is_ground else THING_GROUP
        geom.rgba = [*solid.colour, 1.0]
    if plan.marker is not None:
        _add_marker(spec, plan.marker)


def _quaternion(solid: Solid) -> list[float]:
    """Attitude of a solid, wxyz: pitched, then turned."""
    yaw, pitch = 0.5 * solid.yaw, 0.5 * solid.pitch
    c, s = math.cos(yaw), math.sin(yaw)
    return [c * math.cos(pitch), -s * math.sin(pitch), c * math.sin(pitch), s * math.cos(pitch)]


def _add_marker(spec: mujoco.MjSpec, marker: Marker) -> None:
    """The ball on a post that ends inside it."""
    half = 0.5 * marker.z
    post = spec.worldbody.add_geom(
        name="marker_post",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        size=[_POST_RADIUS, half, 0.0],
        pos=[marker.x, marker.y, half],
    )
    post.group, post.rgba = THING_GROUP, _POST_RGBA
    ball = spec.worldbody.add_geom(
        name=MARKER_GEOM,
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        size=[marker.radius, 0.0, 0.0],
        pos=[marker.x, marker.y, marker.z],
    )
    ball.group = THING_GROUP
    ball.rgba = [*marker.colour, 1.0]
