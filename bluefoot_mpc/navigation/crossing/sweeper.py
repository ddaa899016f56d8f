"""Sweeping the ground ahead: the trunk pitches through levels, feet planted, and the LIDAR looks at each."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.crossing.pose_track import PoseTrack
from bluefoot_mpc.navigation.crossing.sweep_stance import best_shift
from bluefoot_mpc.terrain.cloud import CloudConfig, lidar_place, scan_points
from bluefoot_mpc.terrain.outlook import Outlook
from bluefoot_mpc.terrain.sweep import SweepConfig, advance, levels, levels_along
from bluefoot_mpc.types import BodyState, FloatArray, LidarScan, SensorFrame, TrunkPose

AHEAD = 0.05
"""s that a scan's time stamp may lie ahead of the frame's."""
OLD = 0.3
"""s; an older scan is of a pose that is no longer known."""
MOST_SLACK = math.radians(0.7)
"""Rad off a level, at most, where the next one is far."""
_SOME_PITCH = 0.05
"""Rad; a pitch that needs no shift of the trunk."""
OUT_OF_REACH = 3
"""Levels in a row that were not reached, after which the rest is taken to be out of reach."""


@dataclass(frozen=True, kw_only=True, slots=True)
class SweepStep:
    """What a sweep wants and gives on one tick.

    Attributes:
        pitch: rad, wanted pitch of the trunk, nose down positive.
        points: (k, 3) m, what this tick's scan met, odometry frame; empty where none counts.
        level: index of the level that is being looked at; -1 on the way to the first, and back.
        done: True when the sweep has ended and the trunk is level again.
        reason: what went wrong, in few words; empty where nothing did.
        position: (3,) m, wanted shift of the trunk over its feet.
        reached: levels that were reached so far.
        count: levels in all.
        time: s, end of the scan whose points these are; NaN where there are none.
        origin: (3,) m, where the LIDAR then was, odometry frame; NaN where there are no points.
    """

    pitch: float
    points: FloatArray = field(default_factory=lambda: np.zeros((0, 3)))
    level: int = -1
    done: bool = False
    reason: str = ""
    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    reached: int = 0
    count: int = 0
    time: float = math.nan
    origin: FloatArray = field(default_factory=lambda: np.full(3, np.nan))

    @property
    def trunk(self) -> TrunkPose:
        """The wanted offset of the trunk."""
        return TrunkPose(position=self.position, rpy=np.array([0.0, self.pitch, 0.0]))


class _Seen(NamedTuple):
    """Points of a scan (k, 3), its time, and where the LIDAR was (3,)."""

    points: FloatArray
    time: float
    origin: FloatArray


_NOTHING = _Seen(np.zeros((0, 3)), math.nan, np.full(3, np.nan))


class _Stage(enum.Enum):
    IDLE = enum.auto()
    APPROACH = enum.auto()
    LEVELS = enum.auto()
    RETURN = enum.auto()


class Sweeper:
    """Carries one sweep out after the other.

    It never waits for ever: a level, the way to the first one and the way back have their time, scans that
    do not come end the sweep, and so does an estimate that is not to be trusted.

    Args:
        config: range, levels and pace.
        mounts: where the LIDAR is.
        cloud: which points of a scan count.
        legs: of the robot, to shift the trunk where they reach furthest; None: as configured.
    """

    def __init__(
        self,
        config: SweepConfig,
        mounts: SensorMounts,
        cloud: CloudConfig | None = None,
        legs: LegGeometry | None = None,
    ) -> None:
        self._config, self._mounts, self._cloud = config, mounts, cloud or CloudConfig()
        self._legs = legs
        self._tolerance = math.radians(config.tolerance_deg)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._track = PoseTrack()
        self._levels: FloatArray = np.zeros(0)
        self._ahead: Outlook | None = None
        self._shift: FloatArray = np.zeros(3)
        self._furthest = _SOME_PITCH
        self._heard, self._scan_time, self._fault = -math.inf, -math.inf, ""
        self._enter(_Stage.IDLE, -math.inf)
        self._wanted, self._level, self._scans = 0.0, 0, 0
        self._reached, self._missed_in_a_row, self._reason = 0, 0, "no sweep was begun"

    def begin(self, time: float, ahead: Outlook | None = None) -> None:
        """Start a sweep.

        Args:
            time: s, of the frame.
            ahead: ground that is expected; None is level ground.
        """
        self.reset()
        self._ahead = ahead
        self._heard, self._reason = time, ""
        self._enter(_Stage.APPROACH, time)

    def step(self, frame: SensorFrame, estimate: BodyState, dt: float) -> SweepStep:
        """One tick.

        Args:
            frame: the newest sensor frame.
            estimate: where the robot believes to be.
            dt: s.
        """
        if self._stage is _Stage.IDLE:
            return self._step(_NOTHING)
        time = frame.time
        trusted = estimate.healthy and bool(
            np.isfinite(estimate.position).all() and np.isfinite(estimate.rpy).all()
        )
        if trusted:
            self._track.add(estimate)
        scan = self._usable(frame.lidar, time)
        if self._stage is not _Stage.RETURN:
            self._watch(time, trusted)
        seen = _NOTHING
        if self._stage is _Stage.APPROACH:
            self._approach(estimate, time, dt)
        elif self._stage is _Stage.LEVELS:
            seen = self._look(scan, estimate, time, dt)
        if self._stage is _Stage.RETURN:
            self._go_back(estimate, trusted, time, dt)
        return self._step(seen)

    def _step(self, seen: _Seen) -> SweepStep:
        # On the way back the shift goes with the pitch: with the nose down the legs may need it.
        share = min(self._wanted / self._furthest, 1.0) if self._stage is _Stage.RETURN else 1.0
        return SweepStep(
            pitch=self._wanted, done=self._stage is _Stage.IDLE, reason=self._reason,
            points=seen.points, time=seen.time, origin=seen.origin,
            level=self._level if self._stage is _Stage.LEVELS else -1,
            position=share * self._shift,
            reached=self._reached, count=len(self._levels),
        )  # fmt: skip

    def _enter(self, stage: _Stage, time: float) -> None:
        self._stage, self._since = stage, time

    def _watch(self, time: float, trusted: bool) -> None:
        """End the sweep where there is nothing to go by."""
        if not trusted:
            self._end(time, "the estimate of the robot's pose is not to be trusted")
        elif time - self._heard > self._config.scan_timeout:
            self._end(time, f"no usable scan: {self._fault or 'none came'}")

    def _end(self, time: float, reason: str = "") -> None:
        self._reason = "; ".join(part for part in (self._reason, reason) if part)
        self._furthest = max(self._wanted, _SOME_PITCH)
        self._enter(_Stage.RETURN, time)

    def _usable(self, scan: LidarScan | None, time: float) -> LidarScan | None:
        """The scan, where it is of use; else why not is kept."""
        if scan is None:
            return None
        self._fault = _unusable(scan, time, self._scan_time)
        if not self._fault and self._stage is _Stage.LEVELS and not np.isfinite(scan.distance).any():
            # With the trunk level there may be nothing in view; with the nose down there is the ground.
            self._fault = "no echo in the whole scan"
        if self._fault:
            return None
        self._scan_time, self._heard = scan.time, time
        return scan

    def _approach(self, estimate: BodyState, time: float, dt: float) -> None:
        """To the first level."""
        config = self._config
        if not len(self._levels):
            self._levels = self._planned(estimate)
            self._shift = np.array((config.forward, 0.0, config.raised))
            if self._legs is not None:
                self._shift = best_shift(estimate, self._legs, float(self._levels[-1]), self._shift)
            self._wanted = min(max(float(estimate.rpy[1]), 0.0), float(self._levels[-1]))
        first, pitch = float(self._levels[0]), float(estimate.rpy[1])
        self._wanted += min(max(first - self._wanted, -config.max_rate * dt), config.max_rate * dt)
        if abs(first - pitch) <= self._tolerance or time - self._since > config.approach_time:
            self._enter(_Stage.LEVELS, time)

    def _planned(self, estimate: BodyState) -> FloatArray:
        """(n,) rad, levels over level ground, or over what is expected ahead."""
        config = self._config
        height, lift = estimate.height + config.raised, self._mounts.lidar[2]
        if self._ahead is None:
            return levels(config, height, lift)
        ahead = self._ahead
        return levels_along(config, height, lift, ahead.distance, ahead.height - ahead.height[0])

    def _look(self, scan: LidarScan | None, estimate: BodyState, time: float, dt: float) -> _Seen:
        """At the present level; then on to the next."""
        config, seen = self._config, _NOTHING
        level = float(self._levels[self._level])
        if scan is not None:
            pose = self._track.at(scan.time)
            quiet = pose.rate <= config.quiet_rate
            counts = quiet and abs(pose.pitch - level) <= self._allowed()
            self._scans += counts
            if counts or (quiet and config.use_all_scans):
                points = scan_points(scan, pose.position, pose.quaternion, self._mounts, self._cloud)
                seen = _Seen(points, scan.time, lidar_place(pose.position, pose.quaternion, self._mounts))
        self._wanted = advance(self._wanted, level, float(estimate.rpy[1]), dt, config)
        if self._scans >= config.dwell_scans:
            self._reached, self._missed_in_a_row = self._reached + 1, 0
            self._next(time)
        elif time - self._since > config.level_timeout:
            self._missed_in_a_row += 1
            self._next(time)
        return seen

    def _allowed(self) -> float:
        """How far (rad) a scan may be off the level: those far apart need not be met as well."""
        gaps = np.diff(self._levels[max(self._level - 1, 0) : self._level + 2])
        return max(self._tolerance, min(self._config.slack * float(gaps.min()), MOST_SLACK))

    def _next(self, time: float) -> None:
        """On to the next level, or back."""
        count, before = len(self._levels), float(self._levels[self._level])
        self._level, self._scans = self._level + 1, 0
        given_up = self._missed_in_a_row >= OUT_OF_REACH
        if self._level < count and not given_up:
            # The law corrects what is left: without the step ahead each level would wait for it.
            self._wanted += float(self._levels[self._level]) - before
            self._enter(_Stage.LEVELS, time)
            return
        first = self._level - self._missed_in_a_row
        missed = count - self._reached
        if given_up and missed:
            pitch = math.degrees(self._levels[first])
            self._end(
                time, f"{missed} of {count} levels not reached, from {pitch:.1f} degrees on out of reach"
            )
        else:
            self._end(time, f"{missed} of {count} levels not reached in time" if missed else "")

    def _go_back(self, estimate: BodyState, trusted: bool, time: float, dt: float) -> None:
        """Until the trunk is level."""
        config = self._config
        self._wanted = max(self._wanted - config.max_rate * dt, 0.0)
        late = time - self._since > config.return_time
        level = trusted and abs(float(estimate.rpy[1])) <= math.radians(config.level_deg)
        if self._wanted == 0.0 and (level or late):
            if late and not level:
                self._reason = "; ".join(part for part in (self._reason, "the trunk is not level") if part)
            self._shift = np.zeros(3)
            self._enter(_Stage.IDLE, time)


def _unusable(scan: LidarScan, time: float, before: float) -> str:
    """Why a scan is of no use; empty where it is."""
    if not scan.valid:
        return "scan marked as invalid"
    if not time - OLD <= scan.time <= time + AHEAD:
        return "its time stamp is not of now"
    if scan.time <= before:
        return "its time stamp is not newer than the last one's"
    return _unusable_rays(scan.bearing, scan.distance)


def _unusable_rays(bearing: FloatArray, distance: FloatArray) -> str:
    if bearing.shape != distance.shape or bearing.ndim != 1:
        return "bearings and distances do not match"
    return "" if np.isfinite(bearing).all() else "bearings are not numbers"
