"""Levels of a LIDAR sweep over the ground ahead, and the law by which the trunk pitches through them.

Thesis, chapter 6 (terrain). The LIDAR's plane is fixed to the trunk: with the nose down it meets the ground
ahead in a line across the robot's way, and pitching moves that line to and fro.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_positive, require_range
from bluefoot_mpc.types import FloatArray

MAX_LEVELS = 400
"""More would take the robot longer than a minute with one scan a level."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SweepConfig:
    """Range, levels and pace of a sweep."""

    pitch_min_deg: float = 11.0  # degrees nose down; the plane then meets level ground 1.27 m ahead
    pitch_max_deg: float = 31.0  # degrees nose down; 0.44 m ahead
    steepest_deg: float = 34.0  # degrees nose down, where the ground ahead drops
    drop: float = 0.045  # m by which it does, at least, within the range of level ground
    spacing: Literal["ground", "pitch"] = "ground"  # levels even along level ground, or even in pitch
    ground_step: float = 0.014  # m between the lines of neighbouring levels on level ground
    count: int = 40  # steps between levels that are even in pitch (N_s in the thesis)
    rate_gain: float = 4.0  # 1/s, alpha_theta of the law
    max_rate: float = 0.50  # rad/s, of the wanted pitch
    max_lead_deg: float = 3.0  # degrees that the wanted pitch may be off the level, for a trunk that sticks
    tolerance_deg: float = 0.25  # degrees off a level that a scan of it may be
    slack: float = 0.75  # of the way to the next level, that a scan may be off where that is more
    quiet_rate: float = 0.10  # rad/s of the trunk, at most, during a scan of a level
    dwell_scans: int = 1  # scans a level
    level_timeout: float = 0.6  # s after which a level is given up
    use_all_scans: bool = True  # scans on the way between levels count too
    forward: float = 0.0  # m, shift of the trunk over its feet while it sweeps, where the legs reach it
    raised: float = 0.0  # m, how much higher the trunk stands then
    approach_time: float = 2.5  # s in which the first level must be reached
    return_time: float = 2.5  # s in which the trunk must be level again
    level_deg: float = 2.0  # degrees of pitch that count as level, after the sweep
    scan_timeout: float = 0.5  # s without a usable scan that end a sweep

    def __post_init__(self) -> None:
        require_range(1.0, 45.0, pitch_min_deg=self.pitch_min_deg, pitch_max_deg=self.pitch_max_deg)
        if self.pitch_min_deg >= self.pitch_max_deg:
            raise ConfigurationError(
                f"pitch_min_deg = {self.pitch_min_deg:g} must be less than "
                f"pitch_max_deg = {self.pitch_max_deg:g}"
            )
        require_positive(
            rate_gain=self.rate_gain, max_rate=self.max_rate, tolerance_deg=self.tolerance_deg,
            quiet_rate=self.quiet_rate, level_timeout=self.level_timeout, approach_time=self.approach_time,
            return_time=self.return_time, level_deg=self.level_deg, scan_timeout=self.scan_timeout,
            max_lead_deg=self.max_lead_deg,
        )  # fmt: skip
        require_range(1.0, 45.0, steepest_deg=self.steepest_deg)
        require_positive(drop=self.drop)
        require_range(1, MAX_LEVELS, count=self.count)
        require_range(1, 50, dwell_scans=self.dwell_scans)
        require_range(0.002, 0.5, ground_step=self.ground_step)
        require_range(0.0, 1.0, slack=self.slack)
        require_range(-0.1, 0.1, forward=self.forward, raised=self.raised)

    @property
    def pitch_range(self) -> tuple[float, float]:
        """Least and greatest pitch, rad."""
        return math.radians(self.pitch_min_deg), math.radians(self.pitch_max_deg)


def line_ahead(pitch: FloatArray | float, height: float, lift: float) -> FloatArray:
    """Where the LIDAR's plane meets level ground.

    The plane passes the point `lift` above the trunk's origin along the trunk's z; the sensor's place ahead
    of it does not count, since it moves along the plane.

    Args:
        pitch: (...,) rad, nose down.
        height: m, trunk origin above the ground.
        lift: m, LIDAR above the trunk origin.

    Returns:
        (...,) m ahead of the trunk's origin.
    """
    sin = np.sin(pitch)
    return np.asarray((height * np.cos(pitch) + lift) / sin)


def pitch_for(distance: FloatArray | float, height: FloatArray | float, lift: float) -> FloatArray:
    """(...,) rad, pitch at which the plane meets level ground at `distance`; the inverse of `line_ahead`.

    Args:
        distance: (...,) m ahead of the trunk's origin, positive.
        height: (...,) m, trunk origin above the ground there.
        lift: m, LIDAR above the trunk origin.
    """
    away = np.asarray(distance, dtype=np.float64)
    return np.asarray(np.arctan2(height, away) + np.arcsin(np.minimum(lift / np.hypot(away, height), 1.0)))


def levels(config: SweepConfig, height: float, lift: float) -> FloatArray:
    """(n,) rad, wanted pitches of a sweep, rising.

    Even in pitch they are the thesis' ``theta_k = (theta_max - theta_min) k / N_s + theta_min`` with k from 0
    to N_s. Even in pitch means four times as dense near the robot as far from it, so by default they are
    even along the ground. Without a known height they are as many, even in pitch.

    Args:
        config: range and spacing.
        height: m, trunk origin above the ground.
        lift: m, LIDAR above the trunk origin.
    """
    low, high = config.pitch_range
    if config.spacing == "pitch":
        return np.asarray((high - low) * np.arange(config.count + 1) / config.count + low)
    known = math.isfinite(height) and height > 0.0 and math.isfinite(lift) and height + lift > 0.0
    near, far = line_ahead(np.array((high, low)), height if known else 0.11, lift if known else 0.13).tolist()
    count = min(max(math.ceil((far - near) / config.ground_step), 1), MAX_LEVELS)
    if not known:
        return np.asarray((high - low) * np.arange(count + 1) / count + low)
    return pitch_for(np.linspace(far, near, count + 1), height, lift)


def levels_along(
    config: SweepConfig, height: float, lift: float, distance: FloatArray, ground: FloatArray
) -> FloatArray:
    """(n,) rad, wanted pitches of a sweep over ground of which the heights are expected, rising.

    On ground that drops ahead, the lines of level ground would lie far apart: rays are nearly as steep as it.
    Here they are even along what is expected. Ground that does not drop is swept as level ground is.

    Args:
        config: range and spacing.
        height: m, trunk origin above the ground under the robot.
        lift: m, LIDAR above the trunk origin.
        distance: (k,) m ahead of the trunk's origin, rising.
        ground: (k,) m, expected heights there, over the ground under the robot.
    """
    as_level = levels(config, height, lift)
    low, high = config.pitch_range
    far = float(line_ahead(low, height, lift))
    drops = distance[(ground <= -config.drop) & (distance <= far)]
    if config.spacing == "pitch" or not len(drops) or not math.isfinite(height) or height <= 0.0:
        return as_level
    steepest = max(high, math.radians(config.steepest_deg))
    along = np.arange(config.ground_step, distance[-1], config.ground_step)
    pitch = pitch_for(along, height - np.interp(along, distance, ground), lift)
    nearest = np.minimum.accumulate(np.concatenate(([math.inf], pitch[:-1])))
    seen = (pitch < nearest) & (pitch >= low) & (pitch <= steepest)
    return np.sort(pitch[seen])[:MAX_LEVELS] if seen.any() else as_level


def advance(wanted: float, level: float, estimated: float, dt: float, config: SweepConfig) -> float:
    """Pitch that the trunk is told, one tick on: ``d/dt theta_r = alpha (theta* - theta_est)``.

    Args:
        wanted: rad, what it was told so far.
        level: rad, pitch of the level.
        estimated: rad, as the robot believes; where it is no number the trunk stays.
        dt: s.
        config: gain, rate, and how far from the level the result may be: a trunk that cannot follow is not
            told ever more.
    """
    rate = config.rate_gain * (level - estimated)
    if not math.isfinite(rate):
        return wanted
    rate = min(max(rate, -config.max_rate), config.max_rate)
    lead, most = math.radians(config.max_lead_deg), config.max_rate * dt
    led = min(max(wanted + rate * dt, level - lead), level + lead)
    return min(max(led, wanted - most), wanted + most)
