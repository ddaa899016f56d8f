"""What the robot looks like and what it bumps into, as primitive shapes of each link.

Visual shapes follow the parts of the mass budget, with details that a person
recognises the robot by. Collision shapes are few and plain, so that contacts
stay cheap: one box per body, and a ball as each foot.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.model.parameters import Part, RobotParameters

MATERIALS: dict[str, tuple[float, float, float]] = {
    "shell": (0.16, 0.36, 0.66),
    "panel": (0.27, 0.30, 0.34),
    "battery": (0.86, 0.55, 0.13),
    "electronics": (0.10, 0.42, 0.25),
    "servo": (0.09, 0.09, 0.10),
    "horn": (0.62, 0.63, 0.65),
    "bracket": (0.78, 0.80, 0.82),
    "sensor": (0.88, 0.88, 0.85),
    "glass": (0.03, 0.04, 0.07),
    "rubber": (0.17, 0.17, 0.17),
}
"""Named colours, red, green, blue in 0..1."""

HEAD_PARTS = ("head", "lidar", "camera")
"""Parts of the trunk that collide by themselves, above the trunk's box."""

Triple = tuple[float, float, float]

_LYING = (0.0, 0.5 * math.pi, 0.0)  # z of the shape along x of the link
_ACROSS = (0.5 * math.pi, 0.0, 0.0)  # along y


@dataclass(frozen=True, kw_only=True, slots=True)
class Shape:
    """A primitive fixed to a link.

    Attributes:
        name: unique in the robot.
        kind: ``"box"``, ``"cylinder"`` (along z) or ``"sphere"``.
        size: m, as in `Part.size`.
        position: (3) m, centre in the link's frame.
        rpy: (3) rad, roll, pitch, yaw of the shape in the link's frame.
        material: key of `MATERIALS`; empty for a collision shape.
    """

    name: str
    kind: str
    size: tuple[float, ...]
    position: Triple
    rpy: Triple = (0.0, 0.0, 0.0)
    material: str = ""


def visual_shapes(prefix: str, parts: Sequence[Part], reach: float | None = None) -> list[Shape]:
    """Shapes to draw for the parts of one link.

    Args:
        prefix: what the names start with.
        parts: of that link.
        reach: m, where along x the next joint is; ``None`` in the trunk.
    """
    return [shape for part in parts for shape in _draw(f"{prefix}_{part.name}", part, reach)]


def trunk_collisions(parameters: RobotParameters) -> list[Shape]:
    """Collision shapes of the trunk: one box, and the parts of the head."""
    parts = [part for part in parameters.parts if part.body == "trunk"]
    lower = [part for part in parts if part.name not in HEAD_PARTS]
    shapes = [_bounding_box("trunk_box", lower)] if lower else []
    return shapes + [_solid(f"{part.name}_hull", part) for part in parts if part.name in HEAD_PARTS]


def link_collisions(parameters: RobotParameters, leg: str, body: str) -> list[Shape]:
    """Collision shapes of one leg link; the last link has the foot's ball at its end."""
    prefix = f"{leg}_{body}"
    parts = [part for part in parameters.parts if part.body == body]
    if body != "link4":
        return [_bounding_box(f"{prefix}_hull", parts)]
    length, radius = parameters.legs.link_lengths[3], parameters.legs.foot_radius
    # Thinner and shorter than the ball, so that on flat ground the ball alone touches.
    shank = Shape(
        name=f"{prefix}_hull", kind="cylinder", size=(0.75 * radius, length - radius),
        position=(0.5 * (length - radius), 0.0, 0.0), rpy=_LYING,
    )  # fmt: skip
    ball = Shape(name=f"{leg}_foot_ball", kind="sphere", size=(radius,), position=(length, 0.0, 0.0))
    return [shank, ball]


def _solid(name: str, part: Part, material: str = "") -> Shape:
    lying = part.shape == "cylinder_x"
    return Shape(
        name=name, kind="cylinder" if lying else part.shape, size=part.size,
        position=part.position, rpy=_LYING if lying else (0.0, 0.0, 0.0), material=material,
    )  # fmt: skip


def _bounding_box(name: str, parts: Sequence[Part]) -> Shape:
    halves = np.array([_half_extent(part) for part in parts])
    centres = np.array([part.position for part in parts])
    low, high = (centres - halves).min(axis=0), (centres + halves).max(axis=0)
    x, y, z = (float(value) for value in 0.5 * (low + high))
    dx, dy, dz = (float(value) for value in high - low)
    return Shape(name=name, kind="box", size=(dx, dy, dz), position=(x, y, z))


def _half_extent(part: Part) -> tuple[float, float, float]:
    if part.shape == "box":
        return (0.5 * part.size[0], 0.5 * part.size[1], 0.5 * part.size[2])
    radius = part.size[0]
    if part.shape == "sphere":
        return (radius, radius, radius)
    half = 0.5 * part.size[1]
    return (half, radius, radius) if part.shape == "cylinder_x" else (radius, radius, half)


def _draw(name: str, part: Part, reach: float | None) -> list[Shape]:
    """One part as it looks: its solid in the material of its kind, with details."""
    kind = part.name.split("_")[0]
    if kind == "chassis" and part.shape == "box":
        return _cross(name, part)
    if kind == "lidar" and part.shape == "cylinder":
        return _scanner(name, part)
    if kind == "camera" and part.shape == "box":
        return _camera(name, part)
    if kind == "servo" and part.shape == "box":
        return _servo(name, part, reach)
    material = {
        "chassis": "shell", "head": "shell", "battery": "battery", "electronics": "electronics",
        "servo": "servo", "foot": "rubber", "shank": "panel", "lidar": "sensor", "camera": "panel",
    }.get(kind, "bracket")  # fmt: skip
    return [_solid(name, part, material)]


def _cross(name: str, part: Part) -> list[Shape]:
    """The trunk's modules: two crossed bars, which leave room for the hips in the corners, and a deck."""
    (x, y, z), (cx, cy, cz) = part.size, part.position
    thickness = 0.06 * z
    plate = (0.78 * x, 0.78 * y, thickness)
    rise = 0.5 * (z + thickness)
    return [
        _box(f"{name}_long", (x, 0.44 * y, z), part.position, "shell"),
        _box(f"{name}_wide", (0.44 * x, y, z), part.position, "shell"),
        _box(f"{name}_deck", plate, (cx, cy, cz + rise), "panel"),
        _box(f"{name}_keel", plate, (cx, cy, cz - rise), "panel"),
    ]


def _scanner(name: str, part: Part) -> list[Shape]:
    """A LIDAR: a square foot, a dark window all around, and a cap."""
    (radius, length), (x, y, z) = part.size, part.position
    low = z - 0.5 * length
    foot = (2.0 * radius, 2.0 * radius, 0.55 * length)
    return [
        _box(f"{name}_base", foot, (x, y, low + 0.275 * length), "panel"),
        _rod(f"{name}_band", (0.92 * radius, 0.25 * length), (x, y, low + 0.675 * length), "glass"),
        _rod(f"{name}_cap", (radius, 0.2 * length), (x, y, low + 0.9 * length), "sensor"),
    ]


def _camera(name: str, part: Part) -> list[Shape]:
    """A camera with its lens towards x."""
    (depth, _, height), (x, y, z) = part.size, part.position
    radius = 0.32 * height
    front = x + 0.5 * depth
    return [
        _solid(name, part, "panel"),
        _rod(f"{name}_barrel", (1.25 * radius, 0.3 * depth), (front + 0.15 * depth, y, z), "sensor", _LYING),
        _rod(f"{name}_lens", (radius, 0.1 * depth), (front + 0.32 * depth, y, z), "glass", _LYING),
    ]


def _servo(name: str, part: Part, reach: float | None) -> list[Shape]:
    """A servo block with a horn on both sides of its shaft: upright in the trunk, across at a link."""
    x, y, z = part.position
    if reach is None:
        size, position, rpy = (0.3 * min(part.size), part.size[2] + 0.006), (x, y, z), (0.0, 0.0, 0.0)
    else:
        size, position, rpy = (0.3 * min(part.size), part.size[1] + 0.006), (reach, y, z), _ACROSS
    return [_solid(name, part, "servo"), _rod(f"{name}_horn", size, position, "horn", rpy)]


def _box(name: str, size: Triple, position: Triple, material: str) -> Shape:
    return Shape(name=name, kind="box", size=size, position=position, material=material)


def _rod(
    name: str, size: tuple[float, float], position: Triple, material: str, rpy: Triple = (0.0, 0.0, 0.0)
) -> Shape:
    return Shape(name=name, kind="cylinder", size=size, position=position, rpy=rpy, material=material)
