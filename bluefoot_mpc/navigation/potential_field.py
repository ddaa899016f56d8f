"""The potential field (thesis, chapter 6).

Every ray pulls or pushes: what is farther than the wanted distance pulls, the
stronger the farther, what is nearer pushes. Rays ahead count more than rays to
the side. The sum's direction steers, the sum of the pulls sets the speed.
Against print the bearing counts by its size and steers as it is, without the
world's yaw, and the least speed is 10 mm/s.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class FieldConfig:
    """The thesis' parameters; it does not print the speed's gain."""

    exponent: float = 0.25  # of the weight over bearing
    view_deg: float = 90.0  # degrees to either side of forward that count
    wanted_distance: float = 0.5  # m
    push: float = 0.1  # per metre, of what is nearer
    pull: float = 10.0  # 1/m², how soon the pull is full beyond the wanted distance
    speed_gain: float = 1.5e-4  # m/s for each metre of pull
    least_speed: float = 0.010  # m/s
    greatest_yaw_rate: float = 0.4  # rad/s at a bearing of half a turn
    speed_share: float = 0.1  # of the way to the new speed, once per sweep
    yaw_share: float = 0.1  # of the way to the new yaw rate, once per sweep

    def __post_init__(self) -> None:
        require_positive(
            exponent=self.exponent, wanted_distance=self.wanted_distance, push=self.push, pull=self.pull,
            speed_gain=self.speed_gain, least_speed=self.least_speed,
            greatest_yaw_rate=self.greatest_yaw_rate,
        )  # fmt: skip
        require_range(1.0, 180.0, view_deg=self.view_deg)
        require_range(1e-3, 1.0, speed_share=self.speed_share, yaw_share=self.yaw_share)


class Field(NamedTuple):
    """What the rays of a sweep add up to.

    Attributes:
        force: (2,) sum of the weighted forces, forward and left.
        potential: m/s, the speed potential: the weighted pulls alone.
    """

    force: FloatArray
    potential: float


class Pace(NamedTuple):
    """Speed (m/s) and yaw rate (rad/s, left positive) that the field leads to."""

    speed: float
    yaw_rate: float


def weights(bearing: FloatArray, config: FieldConfig) -> FloatArray:
    """(n,) weight of rays at these bearings (rad from forward): 1 ahead, 0 at the edge of the view."""
    inside = 1.0 - np.abs(bearing) / math.radians(config.view_deg)
    return np.asarray(np.maximum(inside, 0.0) ** config.exponent)


def forces(distance: FloatArray, config: FieldConfig) -> FloatArray:
    """(n,) force of rays of these lengths (m): pull positive, push negative."""
    excess = distance - config.wanted_distance
    square = excess * excess
    return np.where(excess < 0.0, -config.push * square, excess * (1.0 - np.exp(-config.pull * square)))


def field(bearing: FloatArray, distance: FloatArray, config: FieldConfig) -> Field:
    """The field of a sweep.

    Args:
        bearing: (n,) rad from forward, left positive.
        distance: (n,) m; where nothing came back the greatest range.
        config: the law's parameters.
    """
    directions = np.column_stack((np.cos(bearing), np.sin(bearing)))
    return summed(weights(bearing, config), directions, distance, config)


class PotentialField:
    """The same law, with what depends on the bearings alone kept from sweep to sweep.

    Args:
        config: the law's parameters.
    """

    def __init__(self, config: FieldConfig) -> None:
        self._config = config
        self._bearing = np.zeros(0)
        self._weight = np.zeros(0)
        self._directions = np.zeros((0, 2))

    def step(self, bearing: FloatArray, distance: FloatArray) -> Field:
        """The field of a sweep.

        Args:
            bearing: (n,) rad from forward; the same array as before is taken to hold the same values.
            distance: (n,) m.
        """
        if bearing is not self._bearing:
            self._bearing = bearing
            self._weight = weights(bearing, self._config)
            self._directions = np.column_stack((np.cos(bearing), np.sin(bearing)))
        return summed(self._weight, self._directions, distance, self._config)


def summed(weight: FloatArray, directions: FloatArray, distance: FloatArray, config: FieldConfig) -> Field:
    """The field, where the (n,) weights and (n, 2) unit vectors of the rays are known already."""
    force = weight * forces(distance, config)
    return Field(force=force @ directions, potential=config.speed_gain * float(np.maximum(force, 0.0).sum()))


def advance(pace: Pace, now: Field, config: FieldConfig) -> Pace:
    """The pace after one more sweep; limits of the gait are the caller's."""
    x, y = now.force.tolist()
    bearing = math.atan2(y, x) if x or y else 0.0
    wanted = config.greatest_yaw_rate / math.pi * bearing
    return Pace(
        speed=pace.speed + config.speed_share * (now.potential + config.least_speed - pace.speed),
        yaw_rate=pace.yaw_rate + config.yaw_share * (wanted - pace.yaw_rate),
    )
