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
    step: float = 0.45  # s between places that are looked at
    steps: int = 4  # places

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
        self._steps = np.vstack((self._reach[1:], self._fade[1:])).T.tolist()

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

    def place(self, now: Motion, wanted: Motion) -> Places:
        """The places of a single motion: the same sums without arrays, which takes a quarter of the time."""
        step = self._config.step
        x = y = yaw = 0.0
        xs, ys, yaws = [], [], []
        for reach, turn_reach, fade, turn_fade in self._steps:
            vx = _ramped(now.x, wanted.x, reach, fade) * step
            vy = _ramped(now.y, wanted.y, reach, fade) * step
            turn = _ramped(now.yaw_rate, wanted.yaw_rate, turn_reach, turn_fade) * step
            cos, sin = math.cos(yaw + 0.5 * turn), math.sin(yaw + 0.5 * turn)
            x, y, yaw = x + cos * vx - sin * vy, y + sin * vx + cos * vy, yaw + turn
            xs.append(x)
            ys.append(y)
            yaws.append(yaw)
        return Places(np.array([xs]), np.array([ys]), np.array([yaws]))

    def reach(self, now: Motion, wanted: Motion) -> float:
        """m, more than the way of any part of the robot until it has stopped (its corners are 0.3 m out)."""
        config = self._config
        fast = max(math.hypot(now.x, now.y), math.hypot(wanted.x, wanted.y))
        turn = max(abs(now.yaw_rate), abs(wanted.yaw_rate))
        straight = fast * (config.hold + 0.5 * fast / config.acceleration)
        return straight + 0.3 * turn * (config.hold + 0.5 * turn / config.yaw_acceleration)


def _ramped(now: float, wanted: float, reach: float, fade: float) -> float:
    """A rate that has gone towards the wanted one as far as `reach`, and back towards rest by `fade`."""
    rate = now + min(max(wanted - now, -reach), reach)
    return math.copysign(max(abs(rate) - fade, 0.0), rate)


def closest(points: FloatArray, where: Places, outline: OutlineConfig) -> FloatArray:
    """(k, s) m from the outline at each place to the nearest of (n, 2) points; infinite without points."""
    if not len(points):
        return np.full(where.x.shape, np.inf)
    # Single precision: half the memory, and a ten-thousandth of a millimetre is enough.
    px, py, yaw = where.x.ravel(), where.y.ravel(), where.yaw.ravel()
    cos, sin = np.cos(yaw), np.sin(yaw)
    turn = np.empty((yaw.size, 2, 2), dtype=np.float32)
    turn[:, 0, 0] = turn[:, 1, 1] = cos
    turn[:, 0, 1] = sin
    turn[:, 1, 0] = -sin
    offset = np.empty((yaw.size, 2, 1), dtype=np.float32)
    offset[:, 0, 0] = cos * px + sin * py
    offset[:, 1, 0] = cos * py - sin * px
    apart = (turn.reshape(-1, 2) @ points.T.astype(np.float32)).reshape(yaw.size, 2, -1)
    apart -= offset
    np.abs(apart, out=apart)
    apart -= np.array(((outline.half_length,), (outline.half_width,)), dtype=np.float32)
    np.maximum(apart, 0.0, out=apart)
    apart *= apart
    least = np.sqrt((apart[:, 0] + apart[:, 1]).min(axis=1).astype(np.float64))
    least -= outline.rounding
    return np.asarray(least.reshape(where.x.shape))
