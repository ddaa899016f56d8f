"""The robot as URDF, generated from its parameters: the one model that every engine loads."""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Sequence
from pathlib import Path

from bluefoot_mpc.model.inertia import BodyInertia, compose
from bluefoot_mpc.model.parameters import GRAVITY, RobotParameters
from bluefoot_mpc.model.shapes import MATERIALS, Shape, link_collisions, trunk_collisions, visual_shapes
from bluefoot_mpc.types import LEG_JOINTS, LEGS

_AXES = {
    "hip_yaw": (0.0, 0.0, 1.0),
    "hip_pitch": (0.0, -1.0, 0.0),
    "knee": (0.0, -1.0, 0.0),
    "ankle": (0.0, -1.0, 0.0),
}
"""Joint axes in the link's frame; a positive angle of the last three raises the outer link."""


def make_urdf(parameters: RobotParameters) -> str:
    """URDF text of a robot.

    Links are ``trunk`` (its frame is the base frame), ``FL_link1`` to
    ``RR_link4`` with x along the link from the joint, and the massless
    ``FL_foot`` to ``RR_foot`` at the ends of the last links. Limits are those of
    the mechanism; rotor inertia is left to who adds the servos. The same
    parameters give the same text, byte for byte.
    """
    robot = ET.Element("robot", name=parameters.name)
    robot.append(ET.Comment(" Generated from the robot's parameter file; do not edit. "))
    robot.append(_mujoco_settings())
    for name, colour in MATERIALS.items():
        ET.SubElement(ET.SubElement(robot, "material", name=name), "color", rgba=_numbers((*colour, 1.0)))
    _add_link(robot, "trunk", *_trunk(parameters))
    for index, leg in enumerate(LEGS):
        _add_leg(robot, parameters, leg, math.radians(parameters.legs.hip_azimuth_deg[index]))
    ET.indent(robot)
    return '<?xml version="1.0"?>\n' + ET.tostring(robot, encoding="unicode") + "\n"


def write_urdf(parameters: RobotParameters, path: Path) -> None:
    """Write the robot's URDF file."""
    path.write_text(make_urdf(parameters), encoding="utf-8")


def _mujoco_settings() -> ET.Element:
    """What MuJoCo must know beside URDF: keep root and feet as bodies, and the gravity of the laws."""
    extension = ET.Element("mujoco")
    ET.SubElement(extension, "compiler", fusestatic="false", discardvisual="false", strippath="false")
    ET.SubElement(extension, "option", gravity=_numbers((0.0, 0.0, -GRAVITY)))
    return extension


def _trunk(parameters: RobotParameters) -> tuple[BodyInertia, list[Shape], list[Shape]]:
    parts = [part for part in parameters.parts if part.body == "trunk"]
    return compose(parts), visual_shapes("trunk", parts), trunk_collisions(parameters)


def _add_leg(robot: ET.Element, parameters: RobotParameters, leg: str, azimuth: float) -> None:
    legs, servo = parameters.legs, parameters.servo
    lower, upper = legs.physical_limits_deg.radians()
    hip = (legs.hip_offset * math.cos(azimuth), legs.hip_offset * math.sin(azimuth), 0.0)
    ends = [(length, 0.0, 0.0) for length in legs.link_lengths]
    parent = "trunk"
    for index, joint in enumerate(LEG_JOINTS):
        body = f"link{index + 1}"
        link = f"{leg}_{body}"
        element = ET.SubElement(robot, "joint", name=f"{leg}_{joint}", type="revolute")
        if index == 0:
            _add_origin(element, hip, (0.0, 0.0, azimuth))
        else:
            _add_origin(element, ends[index - 1])
        ET.SubElement(element, "parent", link=parent)
        ET.SubElement(element, "child", link=link)
        ET.SubElement(element, "axis", xyz=_numbers(_AXES[joint]))
        ET.SubElement(
            element, "limit", lower=_number(lower[index]), upper=_number(upper[index]),
            effort=_number(servo.stall_torque), velocity=_number(servo.no_load_speed),
        )  # fmt: skip
        parts = [part for part in parameters.parts if part.body == body]
        visuals = visual_shapes(link, parts, legs.link_lengths[index])
        _add_link(robot, link, compose(parts), visuals, link_collisions(parameters, leg, body))
        parent = link
    foot = ET.SubElement(robot, "joint", name=f"{leg}_foot_mount", type="fixed")
    _add_origin(foot, ends[-1])
    ET.SubElement(foot, "parent", link=parent)
    ET.SubElement(foot, "child", link=f"{leg}_foot")
    # No inertial and no shape: the foot's mass and ball belong to the last link.
    ET.SubElement(robot, "link", name=f"{leg}_foot")


def _add_link(
    robot: ET.Element, name: str, body: BodyInertia, visuals: Sequence[Shape], collisions: Sequence[Shape]
) -> None:
    link = ET.SubElement(robot, "link", name=name)
    inertial = ET.SubElement(link, "inertial")
    _add_origin(inertial, [float(x) for x in body.com])
    ET.SubElement(inertial, "mass", value=_number(body.mass))
    tensor = body.inertia
    # Rounding leaves products of inertia near 1e-20 where symmetry makes them zero.
    noise = 1e-14 * float(tensor.trace())
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    values = {key: float(tensor[index]) for key, index in entries.items()}
    ET.SubElement(inertial, "inertia", {k: _number(v if abs(v) > noise else 0.0) for k, v in values.items()})
    for shape in visuals:
        element = _add_shape(link, "visual", shape)
        ET.SubElement(element, "material", name=shape.material)
    for shape in collisions:
        _add_shape(link, "collision", shape)


def _add_shape(link: ET.Element, tag: str, shape: Shape) -> ET.Element:
    element = ET.SubElement(link, tag, name=shape.name)
    _add_origin(element, shape.position, shape.rpy)
    geometry = ET.SubElement(element, "geometry")
    if shape.kind == "box":
        ET.SubElement(geometry, "box", size=_numbers(shape.size))
    elif shape.kind == "cylinder":
        radius, length = shape.size
        ET.SubElement(geometry, "cylinder", radius=_number(radius), length=_number(length))
    else:
        ET.SubElement(geometry, "sphere", radius=_number(shape.size[0]))
    return element


def _add_origin(element: ET.Element, xyz: Sequence[float], rpy: Sequence[float] = (0.0, 0.0, 0.0)) -> None:
    ET.SubElement(element, "origin", xyz=_numbers(xyz), rpy=_numbers(rpy))


def _number(value: float) -> str:
    """14 digits: exact to 1e-14, and the same text where the last bit of a sine differs between machines."""
    text = f"{float(value):.14g}"
    return "0" if abs(float(text)) < 1e-17 else text


def _numbers(values: Iterable[float]) -> str:
    return " ".join(_number(value) for value in values)
