"""The robot's mass lumped into points: trunk, joints, link midpoints and feet.

The placement law of the paper (thesis, section on ZMP body placement) sees a leg as point masses
at its four joints, its four link midpoints and its foot. Each part of the mass
budget goes to the nearest of the three points of its link.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class MassPoints:
    """Lumped masses of the trunk and of one leg.

    Attributes:
        trunk: kg.
        trunk_com: (3,) m, the trunk's centre of mass in the base frame.
        joint: (4,) kg at hip_yaw, hip_pitch, knee, ankle.
        link: (4,) kg at the link midpoints.
        foot: kg.
        leg_weights: (5,) kg, the leg's masses spread over its joints and foot. A
            link midpoint weighs half on either end, so that ``leg_weights @ points``
            with the five points of a leg is the leg's first moment.
        leg: kg, mass of one leg.
        total: kg, trunk and all four legs.
    """

    trunk: float
    trunk_com: FloatArray
    joint: FloatArray
    link: FloatArray
    foot: float
    leg_weights: FloatArray = field(init=False)
    leg: float = field(init=False)
    total: float = field(init=False)

    def __post_init__(self) -> None:
        weights = np.zeros(5)
        weights[:4] += self.joint + 0.5 * self.link
        weights[1:] += 0.5 * self.link
        weights[4] += self.foot
        object.__setattr__(self, "leg_weights", weights)
        object.__setattr__(self, "leg", float(weights.sum()))
        object.__setattr__(self, "total", self.trunk + 4.0 * self.leg)


def lump(parameters: RobotParameters) -> MassPoints:
    """Lump a robot's mass budget."""
    joint, link, foot = np.zeros(4), np.zeros(4), 0.0
    trunk_parts = [part for part in parameters.parts if part.body == "trunk"]
    trunk = sum(part.mass for part in trunk_parts)
    trunk_com = np.array([part.mass * np.array(part.position) for part in trunk_parts]).sum(axis=0) / trunk
    for part in parameters.parts:
        if part.body == "trunk":
            continue
        index = int(part.body[-1]) - 1
        share = part.position[0] / parameters.legs.link_lengths[index]
        if share < 0.25:
            joint[index] += part.mass
        elif share <= 0.75:
            link[index] += part.mass
        elif index < 3:
            joint[index + 1] += part.mass
        else:
            foot += part.mass
    return MassPoints(trunk=trunk, trunk_com=trunk_com, joint=joint, link=link, foot=foot)
