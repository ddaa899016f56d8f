"""The robot as a meshcat scene: a tree of joints with the URDF's visual shapes hanging from it.

Each joint is a node inside its parent's node, so that a pose of the whole robot
is one trunk matrix and sixteen rotations. The report's page and the live view
use the same commands, written as the plain dictionaries that meshcat's viewer
reads; nothing here starts a server.
"""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import pinocchio as pin

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.types import LEGS, FloatArray
from bluefoot_mpc.viz.style import LEG_COLOURS

_LOG = logging.getLogger(__name__)

ROOT = "/meshcat/robot"
Command = dict[str, Any]
"""One meshcat command as its viewer decodes it: type, path and contents."""

_Y_TO_Z = np.array([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]])


class RobotLike(Protocol):
    """What a scene needs of a robot model."""

    urdf: str
    pin_model: Any


@dataclass(frozen=True, kw_only=True, slots=True)
class Node:
    """One moving body.

    Attributes:
        name: name of the joint that moves it; ``trunk`` for the root.
        path: meshcat path.
        placement: (4, 4) of the joint in its parent's frame, at angle zero.
        axis: (3,) axis of the joint in its own frame; zeros for the trunk.
        q_index: index of its angle in q; 0 for the trunk, whose pose is ``q[0:7]``.
    """

    name: str
    path: str
    placement: FloatArray
    axis: FloatArray
    q_index: int


@dataclass(frozen=True, kw_only=True, slots=True)
class Visual:
    """One shape fixed to a node.

    Attributes:
        path: meshcat path.
        shape: ``"box"``, ``"cylinder"`` (along z) or ``"sphere"``.
        size: m: sides of a box; radius and length; radius.
        placement: (4, 4) in the node's frame.
        colour: 0xRRGGBB.
        opacity: 0..1.
    """

    path: str
    shape: str
    size: tuple[float, ...]
    placement: FloatArray
    colour: int
    opacity: float = 1.0


@dataclass(frozen=True, kw_only=True, slots=True)
class RobotScene:
    """Nodes, parents first, and the shapes that hang from them."""

    nodes: tuple[Node, ...]
    visuals: tuple[Visual, ...]


def build_scene(robot: RobotLike) -> RobotScene:
    """Read the moving bodies and visual shapes out of a robot model."""
    nodes = _nodes(robot.pin_model)
    geometry = pin.buildGeomFromUrdfString(robot.pin_model, robot.urdf, pin.GeometryType.VISUAL)
    visuals = []
    for item in geometry.geometryObjects:
        node = nodes[max(item.parentJoint - 1, 0)]
        shape, size = _primitive(item.geometry)
        if not shape:
            _LOG.warning("the view cannot draw %s, a %s", item.name, type(item.geometry).__name__)
            continue
        visual = Visual(
            path=f"{node.path}/visual/{item.name}", shape=shape, size=size,
            placement=np.array(item.placement.homogeneous),
            colour=_colour(item, node, shape), opacity=float(item.meshColor[3]),
        )  # fmt: skip
        visuals.append(visual)
    return RobotScene(nodes=nodes, visuals=tuple(visuals))


def scene_commands(scene: RobotScene) -> list[Command]:
    """Commands that put the robot into a viewer, standing as at q = 0."""
    commands: list[Command] = []
    for node in scene.nodes:
        commands.append(transform(node.path, node.placement))
        own = [visual for visual in scene.visuals if visual.path.startswith(f"{node.path}/visual/")]
        # One command per body: a browser that draws slowly takes few at a time.
        commands.append(group(f"{node.path}/visual", own))
    return commands


def node_matrices(scene: RobotScene, q: FloatArray) -> list[FloatArray]:
    """(4, 4) matrix of each node in its parent's frame for a configuration.

    Args:
        scene: the robot.
        q: (7 + n,) trunk position in world (m), quaternion xyzw, joint angles (rad).
    """
    trunk = np.eye(4)
    trunk[:3, :3] = rotation_from_quaternion(q[3:7])
    trunk[:3, 3] = q[:3]
    return [trunk, *(node.placement @ _turn(node.axis, float(q[node.q_index])) for node in scene.nodes[1:])]


def pose_commands(scene: RobotScene, q: FloatArray) -> list[Command]:
    """Commands that move the robot to a configuration (7 + n,)."""
    matrices = node_matrices(scene, q)
    return [transform(node.path, matrix) for node, matrix in zip(scene.nodes, matrices, strict=True)]


def group(path: str, visuals: Sequence[Visual]) -> Command:
    """Command that adds several shapes, each in its place, as one object."""
    parts = [_part(visual) for visual in visuals]
    body = {"uuid": f"{path}#o", "type": "Group", "children": [child for _, _, child in parts]}
    return _object(path, [geometry for geometry, _, _ in parts], [material for _, material, _ in parts], body)


def shape(visual: Visual) -> Command:
    """Command that adds one shape in its place."""
    geometry, material, body = _part(visual)
    return _object(visual.path, [geometry], [material], body)


def surface(
    path: str, points: FloatArray, triangles: list[int], colour: int, opacity: float = 1.0
) -> Command:
    """Command that adds a surface of (n, 3) corners (m, world) and triples of corner numbers."""
    geometry = {"uuid": f"{path}#g", **_buffer(points, triangles)}
    material = _matt(path, colour, opacity)
    return _object(path, [geometry], [material], _mesh(path))


def line(path: str, points: FloatArray, colour: int) -> Command:
    """Command that adds a poly-line through (n, 3) points (m, world)."""
    geometry = {"uuid": f"{path}#g", **_buffer(points)}
    material = {"uuid": f"{path}#m", "type": "LineBasicMaterial", "color": colour, "linewidth": 2}
    return _object(path, [geometry], [material], {**_mesh(path), "type": "Line"})


def transform(path: str, matrix: FloatArray) -> Command:
    """Command that places a node; `matrix` is (4, 4) in the parent's frame."""
    return {"type": "set_transform", "path": path, "matrix": [float(x) for x in matrix.T.ravel()]}


def setting(path: str, name: str, value: Any) -> Command:
    """Command that sets a property of a node."""
    return {"type": "set_property", "path": path, "property": name, "value": value}


def translation(x: float, y: float, z: float) -> FloatArray:
    """(4, 4) matrix of a pure shift (m)."""
    matrix = np.eye(4)
    matrix[:3, 3] = x, y, z
    return matrix


def hex_colour(colour: str) -> int:
    """0xRRGGBB of a ``#rrggbb`` string."""
    return int(colour.removeprefix("#"), 16)


def _object(
    path: str, geometries: list[dict[str, Any]], materials: list[dict[str, Any]], body: dict[str, Any]
) -> Command:
    content = {
        "metadata": {"version": 4.5, "type": "Object"},
        "geometries": geometries,
        "materials": materials,
        "object": body,
    }
    return {"type": "set_object", "path": path, "object": content}


def _part(visual: Visual) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Geometry, material and mesh of one shape."""
    # Three.js draws cylinders along y.
    placement = visual.placement @ _Y_TO_Z if visual.shape == "cylinder" else visual.placement
    geometry = {"uuid": f"{visual.path}#g", **_geometry(visual.shape, visual.size)}
    matrix = [round(float(x), 7) for x in placement.T.ravel()]
    body = {**_mesh(visual.path), "matrix": matrix, "castShadow": True, "receiveShadow": True}
    return geometry, _matt(visual.path, visual.colour, visual.opacity), body


def _mesh(path: str) -> dict[str, Any]:
    return {"uuid": f"{path}#o", "type": "Mesh", "geometry": f"{path}#g", "material": f"{path}#m"}


def _matt(path: str, colour: int, opacity: float) -> dict[str, Any]:
    return {
        "uuid": f"{path}#m",
        "type": "MeshPhongMaterial",
        "color": colour,
        "shininess": 40,
        "specular": 0x2A2A2A,
        "side": 2,
        "transparent": opacity < 1.0,
        "opacity": opacity,
    }


def _buffer(points: FloatArray, triangles: list[int] | None = None) -> dict[str, Any]:
    position = {"itemSize": 3, "type": "Float32Array", "array": [round(float(x), 5) for x in points.ravel()]}
    data: dict[str, Any] = {"attributes": {"position": position}}
    if triangles is not None:
        data["index"] = {"type": "Uint16Array", "array": triangles}
    return {"type": "BufferGeometry", "data": data}


def _nodes(model: Any) -> tuple[Node, ...]:
    trunk = Node(name="trunk", path=f"{ROOT}/trunk", placement=np.eye(4), axis=np.zeros(3), q_index=0)
    nodes = [trunk]
    for index in range(2, model.njoints):
        parent = nodes[model.parents[index] - 1]
        axis = np.array(model.joints[index].createData().S, dtype=np.float64).ravel()[3:6]
        node = Node(
            name=model.names[index], path=f"{parent.path}/{model.names[index]}",
            placement=np.array(model.jointPlacements[index].homogeneous),
            axis=axis, q_index=int(model.idx_qs[index]),
        )  # fmt: skip
        nodes.append(node)
    return tuple(nodes)


def _primitive(geometry: Any) -> tuple[str, tuple[float, ...]]:
    kind = type(geometry).__name__
    if kind == "Box":
        x, y, z = (2.0 * float(half) for half in geometry.halfSide)
        return "box", (x, y, z)
    if kind == "Cylinder":
        return "cylinder", (float(geometry.radius), 2.0 * float(geometry.halfLength))
    if kind == "Sphere":
        return "sphere", (float(geometry.radius),)
    return "", ()


def _geometry(shape: str, size: tuple[float, ...]) -> dict[str, Any]:
    if shape == "box":
        return {"type": "BoxGeometry", "width": size[0], "height": size[1], "depth": size[2]}
    if shape == "cylinder":
        return {
            "type": "CylinderGeometry", "radiusTop": size[0], "radiusBottom": size[0],
            "height": size[1], "radialSegments": 28,
        }  # fmt: skip
    return {"type": "SphereGeometry", "radius": size[0], "widthSegments": 24, "heightSegments": 16}


def _colour(item: Any, node: Node, shape: str) -> int:
    # The ball of a foot wears its leg's colour, so that the view and the plots speak of the same leg.
    leg = node.name.partition("_")[0]
    if shape == "sphere" and leg in LEGS and node.name.endswith("ankle"):
        return hex_colour(LEG_COLOURS[leg])
    red, green, blue = (round(255 * float(c)) for c in item.meshColor[:3])
    return (red << 16) + (green << 8) + blue


def _turn(axis: FloatArray, angle: float) -> FloatArray:
    matrix = np.eye(4)
    matrix[:3, :3] = pin.exp3(axis * angle)
    return matrix
