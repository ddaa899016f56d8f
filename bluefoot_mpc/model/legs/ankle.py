"""Ways to choose the direction of a leg's last link, the leg's one redundancy.

The direction gamma is the angle of the last link in the leg's vertical plane,
0 outward and -pi/2 straight down, measured in the trunk's axes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bluefoot_mpc.model.legs.ankle_table import AnkleTable
from bluefoot_mpc.model.legs.forward import to_leg_frame
from bluefoot_mpc.model.legs.geometry import ALL_LEGS, LegGeometry
from bluefoot_mpc.model.legs.widest import widest_directions
from bluefoot_mpc.settings import require_range
from bluefoot_mpc.types import FloatArray

AnklePolicy = Literal["fixed", "ground", "margin"]


@dataclass(frozen=True, kw_only=True, slots=True)
class AnkleConfig:
    """How the direction of the last links is chosen.

    ``fixed`` keeps `direction_deg` in the trunk's axes. ``ground`` turns it
    with the trunk's tilt, so that the foot keeps its attitude to the ground.
    ``margin`` takes the direction that keeps the leg farthest from its limits,
    which leaves the longest strides and walks best.
    """

    policy: AnklePolicy = "margin"
    direction_deg: float = -99.0  # degrees, for a level trunk; unused by "margin"

    def __post_init__(self) -> None:
        require_range(-180.0, 180.0, direction_deg=self.direction_deg)


def ankle_directions(
    geometry: LegGeometry,
    config: AnkleConfig,
    feet_in_base: FloatArray,
    up_in_base: FloatArray | None = None,
    legs: Sequence[int] = ALL_LEGS,
    *,
    table: AnkleTable | None = None,
) -> FloatArray:
    """Directions of the last links under the configured policy.

    Args:
        geometry: lengths, hips and limits.
        config: the policy.
        feet_in_base: (n, 3) m, wanted foot points in the base frame.
        up_in_base: (3,) normal of the ground in the base frame; on level ground
            the last row of rotation_base_to_world. Needed by ``ground`` only;
            without it the trunk counts as level.
        legs: indices of the n legs.
        table: where ``margin`` looks directions up instead of searching for them.

    Returns:
        (n,) rad.
    """
    direction = math.radians(config.direction_deg)
    if config.policy == "margin":
        if table is not None:
            return table.directions(feet_in_base, legs)
        return widest_directions(geometry, to_leg_frame(geometry, feet_in_base, legs), legs)
    if config.policy == "ground" and up_in_base is not None:
        return ground_directions(geometry, direction, feet_in_base, up_in_base, legs)
    return np.full(len(legs), direction)


def ground_directions(
    geometry: LegGeometry,
    direction: float,
    feet_in_base: FloatArray,
    up_in_base: FloatArray,
    legs: Sequence[int] = ALL_LEGS,
) -> FloatArray:
    """Directions that keep the last links' angle to the ground inside the legs' planes.

    A tilt across a leg's plane cannot be made good by its joints and stays.

    Args:
        geometry: hips.
        direction: rad, the direction on level ground under a level trunk.
        feet_in_base: (n, 3) m, foot points in the base frame.
        up_in_base: (3,) normal of the ground in the base frame.
        legs: indices of the n legs.

    Returns:
        (n,) rad.
    """
    up_x, up_y, up_z = up_in_base.tolist()
    values = []
    for leg, (x, y, _) in zip(legs, feet_in_base.tolist(), strict=True):
        hip = geometry.hips[leg]
        azimuth = math.atan2(y - hip.y, x - hip.x)
        outward = up_x * math.cos(azimuth) + up_y * math.sin(azimuth)
        values.append(direction - math.atan2(outward, up_z))
    return np.array(values)
