"""The robot's outline on the floor, and how near points come to it along a motion."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.navigation.limits import Motion
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class OutlineConfig:
    """A box with round corners about the trunk's origin that holds the swinging legs too.

    Measured in simulation, all geometries of the model, 15 to 20 s each of 0.15 m/s with 0.3 rad/s, 0.5 rad/s
    in place, backwards and sideways, 0.20 m/s with -0.3 rad/s: 0.228 m along, 0.234 m across, 0.286 m to
    the corners.
    """

    half_length: float = 0.16  # m, to the middle of the rounding
    half_width: float = 0.165  # m, to the middle of the rounding
    rounding: float = 0.067  # m

    def __post_init__(self) -> None:
        require_positive(half_length=self.half_length, half_width=self.half_width)
        require_nonnegative(rounding=self.rounding)


@dataclass(frozen=True, kw_only=True, slots=True)
class RampConfig:
    """How the gait follows a change of command, and how far ahead that is looked at."""

    acceleration: float = 0.1  # m/s², of the gait's own ramp
    yaw_acceleration: float = 1.0  # rad/s², of the gait's own ramp
    hold: float = 0.4  # s for which a motion is kept before the robot could be stopping
    step: float = 0.3  # s between places that are looked at
    steps: int = 6  # places

    def __post_init__(self) -> None:
        require_positive(
            acceleration=self.acceleration, yaw_acceleration=self.yaw_acceleration, step=self.step,
            steps=self.steps,
        )  # fmt: skip
        require_nonnegative(hold=self.hold)

    def followed(self, gait: Motion, motion: Motion, dt: float) -> Motion:
        """What the gait does after `dt` seconds of a command, from what it does now."""
        step, turn = self.acceleration * dt, self.yaw_acceleration * dt
        return Motion(
            gait.x + min(max(motion.x - gait.x, -step), step),
            gait.y + min(max(motion.y - gait.y, -step), step),
            gait.yaw_rate + min(max(motion.yaw_rate - gait.yaw_rate, -turn), turn),
        )


class Places(NamedTuple):
    """Where the robot will be: (k, s) for k motions and s moments, in the present robot frame (m, rad)."""

    x: FloatArray
    y: FloatArray
    yaw: FloatArray


def distances(points: FloatArray, config: OutlineConfig) -> FloatArray:
    """(n,) m from the outline to (n, 2) points in the robot frame; negative inside the rounding only."""
    x = np.maximum(np.abs(points[:, 0]) - config.half_length, 0.0)
    y = np.maximum(np.abs(points[:, 1]) - config.half_width, 0.0)
    return np.asarray(np.sqrt(x * x + y * y) - config.rounding)


class Foresight:
    """Where motions lead that are held for a while and then ended, by the gait's ramps.

    Args:
        config: ramps and times.
    """

    def __init__(self, config: RampConfig) -> None:
        self._config = config
        time = (np.arange(config.steps) + 0.5) * config.step
        ramp = np.array((config.acceleration, config.acceleration, config.yaw_acceleration))[:, None]
        self._reach = ramp * np.minimum(time, config.hold)
        self._fade = ramp * np.maximum(time - config.hold, 0.0)

    def places(self, now: Motion, motions: FloatArray) -> Places:
        """The places of (k, 3) motions, m/s forward and left and rad/s, from what the gait does now."""
        step = self._config.step
        start = np.array(now)[:, None]
        way = np.minimum(motions[:, :, None] - start, self._reach)
        np.maximum(way, -self._reach, out=way)
        way += start
        rate = np.copysign(np.maximum(np.abs(way) - self._fade, 0.0), way)
        rate *= step
        turned = rate[:, 2].cumsum(axis=1)
        middle = turned - 0.5 * rate[:, 2]
        cos, sin = np.cos(middle), np.sin(middle)
        x = (cos * rate[:, 0] - sin * rate[:, 1]).cumsum(axis=1)
        y = (sin * rate[:, 0] + cos * rate[:, 1]).cumsum(axis=1)
        return Places(x, y, turned)

    def reach(self, now: Motion, wanted: Motion) -> float:
        """m, more than the way of any part of the robot until it has stopped (its corners are 0.3 m out)."""
        config = self._config
        fast = max(math.hypot(now.x, now.y), math.hypot(wanted.x, wanted.y))
        turn = max(abs(now.yaw_rate), abs(wanted.yaw_rate))
        straight = fast * (config.hold + 0.5 * fast / config.acceleration)
        return straight + 0.3 * turn * (config.hold + 0.5 * turn / config.yaw_acceleration)


def closest(points: FloatArray, where: Places, outline: OutlineConfig) -> FloatArray:
    """(k, s) m from the outline at each place to the nearest of (n, 2) points; infinite without points."""
    if not len(points):
        return np.full(where.x.shape, np.inf)
    dx = points[:, 0] - where.x[:, :, None]
    dy = points[:, 1] - where.y[:, :, None]
    cos, sin = np.cos(where.yaw)[:, :, None], np.sin(where.yaw)[:, :, None]
    x = np.abs(cos * dx + sin * dy)
    y = np.abs(cos * dy - sin * dx)
    x -= outline.half_length
    y -= outline.half_width
    np.maximum(x, 0.0, out=x)
    np.maximum(y, 0.0, out=y)
    x *= x
    y *= y
    x += y
    return np.asarray(np.sqrt(x.min(axis=2)) - outline.rounding)
