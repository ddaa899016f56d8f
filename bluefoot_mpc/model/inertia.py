"""Mass, centre and inertia of bodies made of homogeneous boxes, cylinders and spheres."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.model.parameters import Part
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class BodyInertia:
    """Inertial properties of one rigid body.

    Attributes:
        mass: kg.
        com: (3,) m, centre of mass in the body's frame.
        inertia: (3, 3) kg·m² about the centre of mass, axes of the body's frame.
    """

    mass: float
    com: FloatArray
    inertia: FloatArray


def part_inertia(part: Part) -> FloatArray:
    """(3, 3) kg·m², inertia of a homogeneous part about its own centre, axes of its body's frame."""
    if part.shape == "box":
        x, y, z = (length * length for length in part.size)
        return part.mass / 12.0 * np.diag([y + z, x + z, x + y])
    if part.shape == "sphere":
        return 0.4 * part.mass * part.size[0] ** 2 * np.eye(3)
    radius, length = part.size
    axial = 0.5 * part.mass * radius**2
    lateral = part.mass * (3.0 * radius**2 + length**2) / 12.0
    along_x = part.shape == "cylinder_x"
    return np.diag([axial, lateral, lateral] if along_x else [lateral, lateral, axial])


def compose(parts: Iterable[Part]) -> BodyInertia:
    """Inertia of parts that are rigidly joined (parallel-axis theorem).

    Args:
        parts: at least one part, all with positions in the same body's frame.
    """
    parts = tuple(parts)
    masses = np.array([part.mass for part in parts])
    centres = np.array([part.position for part in parts])
    com = masses @ centres / masses.sum()
    inertia = np.zeros((3, 3))
    for part, offset in zip(parts, centres - com, strict=True):
        inertia += part_inertia(part) + part.mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return BodyInertia(mass=float(masses.sum()), com=com, inertia=inertia)
