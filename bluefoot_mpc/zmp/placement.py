"""Static ZMP trunk placement: the trunk leans away from the legs that it carries.

Paper, section on ZMP body placement, with the corrections of its errata: the
moment of the swinging legs is divided by the trunk's weight, feet have levers
from the centre of mass, and the boundary force is a vector.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import BoolArray, FloatArray
from bluefoot_mpc.zmp.mass_points import MassPoints

FURTHEST = 5.0
"""Cap of the boundary force's exponents: far outside, the direction matters and not the size."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PlacementConfig:
    """Gains of the placement law."""

    enabled: bool = True
    gain: float = 4.0  # 1/s, K_Z
    lead: float = 0.2  # s, how far ahead legs in swing are looked for: makes up for the law's own lag
    boundary_gain: float = 0.002  # K_F, (m/s)·kg per unit of boundary force
    boundary_sharpness: float = 120.0  # 1/m, k_l
    reach_min: float = 0.17  # m, trunk origin to foot
    reach_max: float = 0.32  # m
    max_offset: float = 0.025  # m, from the neutral place
    max_rate: float = 0.25  # m/s

    def __post_init__(self) -> None:
        require_nonnegative(
            gain=self.gain, lead=self.lead, boundary_gain=self.boundary_gain, max_offset=self.max_offset
        )
        require_positive(boundary_sharpness=self.boundary_sharpness, max_rate=self.max_rate)
        if not 0.0 <= self.reach_min < self.reach_max:
            raise ConfigurationError(
                f"reach_min = {self.reach_min} must be below reach_max = {self.reach_max} and not negative"
            )


def centre_of_mass(masses: MassPoints, trunk_com: FloatArray, leg_points: FloatArray) -> FloatArray:
    """(3,) m, centre of mass of the lumped robot.

    Args:
        masses: the lumped masses.
        trunk_com: (3,) m, the trunk's centre of mass.
        leg_points: (4, 5, 3) m, four joints and the foot of each leg, same frame.
    """
    legs = masses.leg_weights @ leg_points.sum(axis=0)
    return np.asarray((masses.trunk * trunk_com + legs) / masses.total)


def static_zmp(
    masses: MassPoints, com: FloatArray, leg_points: FloatArray, swing: BoolArray | FloatArray
) -> FloatArray:
    """(2,) m, the ZMP that the swinging legs leave for the trunk (paper's p_zmp).

    Args:
        masses: the lumped masses.
        com: (3,) m, centre of mass.
        leg_points: (4, 5, 3) m, points of each leg in the same frame.
        swing: (4,) 1 where the trunk carries the leg; fractions blend.
    """
    com_x, com_y, _ = com.tolist()
    moments = (masses.leg_weights @ leg_points).tolist()
    # tau = lever x m g points sideways of the lever; Rz(pi/2) turns it back
    # against the lever, and |g| cancels.
    x, y = com_x, com_y
    for share, (moment_x, moment_y, _) in zip(swing.tolist(), moments, strict=True):
        x -= share * (moment_x - masses.leg * com_x) / masses.trunk
        y -= share * (moment_y - masses.leg * com_y) / masses.trunk
    return np.array([x, y])


def boundary_force(trunk: FloatArray, feet: FloatArray, config: PlacementConfig) -> FloatArray:
    """(2,) boundary force that keeps every foot between the two reaches (paper's F_r).

    Args:
        trunk: (3,) m, trunk origin.
        feet: (4, 3) m, in the same frame.
        config: reaches and sharpness.
    """
    sharpness = config.boundary_sharpness
    force_x = force_y = 0.0
    for x, y, z in (feet - trunk).tolist():
        distance = math.sqrt(x * x + y * y + z * z)
        pull = math.exp(min(sharpness * (distance - config.reach_max), FURTHEST))
        push = math.exp(min(sharpness * (config.reach_min - distance), FURTHEST))
        share = (pull - push) / distance
        force_x += share * x
        force_y += share * y
    return np.array([force_x, force_y])


def advance(
    offset: FloatArray,
    target: FloatArray,
    force: FloatArray,
    masses: MassPoints,
    dt: float,
    config: PlacementConfig,
) -> FloatArray:
    """(2,) m, trunk offset after `dt` of the placement law, bounded in size and rate.

    Args:
        offset: (2,) m, the trunk reference.
        target: (2,) m, the ZMP that it follows.
        force: (2,) boundary force.
        masses: the lumped masses.
        dt: s.
        config: gains and bounds.
    """
    # Complex numbers: plain planar vectors, without the cost of small arrays.
    place = complex(*offset.tolist())
    pushed = config.boundary_gain / masses.trunk * complex(*force.tolist())
    rate = config.gain * (complex(*target.tolist()) - place) + pushed
    speed = abs(rate)
    if speed > config.max_rate:
        rate *= config.max_rate / speed
    place += rate * dt
    size = abs(place)
    if size > config.max_offset:
        place *= config.max_offset / size
    return np.array([place.real, place.imag])
