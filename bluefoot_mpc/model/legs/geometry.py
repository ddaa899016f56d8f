"""What the legs' kinematics must know of a robot: lengths, hips and limits."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.types import N_LEGS, FloatArray

ALL_LEGS: tuple[int, ...] = tuple(range(N_LEGS))
"""Indices of the legs in house order, the default of every function that takes `legs`."""


class HipConstants(NamedTuple):
    """One hip as plain floats, which are several times faster than array entries."""

    x: float  # m, hip_yaw axis in the base frame
    y: float  # m
    z: float  # m
    azimuth: float  # rad, direction of the leg's x axis
    cos: float
    sin: float


@dataclass(frozen=True, kw_only=True, slots=True, eq=False)
class LegGeometry:
    """Geometry and joint limits of four equal legs; arrays are read-only.

    A leg frame has its origin on the hip_yaw axis, x outward along the hip's
    azimuth, z up, so that an all-zero leg lies stretched along x.

    Attributes:
        link_lengths: (4,) m, hip_yaw axis to hip_pitch, to knee, to ankle, to foot point.
        hip_position: (4, 3) m, origins of the leg frames in the base frame.
        hip_azimuth: (4,) rad, directions of the legs' x axes about the base's z.
        lower: (16,) rad, limits imposed by software.
        upper: (16,) rad, limits imposed by software.
        physical_lower: (16,) rad, where the mechanism stops.
        physical_upper: (16,) rad, where the mechanism stops.
        foot_radius: m, of the ball around the foot point.
    """

    link_lengths: FloatArray
    hip_position: FloatArray
    hip_azimuth: FloatArray
    lower: FloatArray
    upper: FloatArray
    physical_lower: FloatArray
    physical_upper: FloatArray
    foot_radius: float
    links: tuple[float, float, float, float] = field(init=False, repr=False)
    hips: tuple[HipConstants, ...] = field(init=False, repr=False)
    bounds: tuple[tuple[float, float], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        names = ("link_lengths", "hip_position", "hip_azimuth", "lower", "upper")
        for name in (*names, "physical_lower", "physical_upper"):
            values = np.array(getattr(self, name), dtype=np.float64)
            values.flags.writeable = False
            object.__setattr__(self, name, values)
        hips = tuple(
            HipConstants(x, y, z, azimuth, math.cos(azimuth), math.sin(azimuth))
            for (x, y, z), azimuth in zip(self.hip_position.tolist(), self.hip_azimuth.tolist(), strict=True)
        )
        object.__setattr__(self, "links", tuple(self.link_lengths.tolist()))
        object.__setattr__(self, "hips", hips)
        bounds = zip(self.lower.tolist(), self.upper.tolist(), strict=True)
        object.__setattr__(self, "bounds", tuple(bounds))

    @classmethod
    def from_parameters(cls, parameters: RobotParameters) -> LegGeometry:
        """The geometry of a robot's parameter file (hips at the height of the trunk's origin)."""
        legs = parameters.legs
        azimuth = np.radians(legs.hip_azimuth_deg)
        outward = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(N_LEGS)])
        lower, upper = legs.limits_deg.radians()
        physical_lower, physical_upper = legs.physical_limits_deg.radians()
        return cls(
            link_lengths=np.array(legs.link_lengths),
            hip_position=legs.hip_offset * outward,
            hip_azimuth=azimuth,
            lower=np.tile(lower, N_LEGS),
            upper=np.tile(upper, N_LEGS),
            physical_lower=np.tile(physical_lower, N_LEGS),
            physical_upper=np.tile(physical_upper, N_LEGS),
            foot_radius=legs.foot_radius,
        )
