"""How the robot finds its way: the laws in their order, once per tick."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation import potential_field
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.guard import Guard
from bluefoot_mpc.navigation.limits import Motion, allowed, ramped
from bluefoot_mpc.navigation.potential_field import Field, Pace
from bluefoot_mpc.navigation.scan import LevelScan, ScanReader
from bluefoot_mpc.types import BodyState, FloatArray, Guide, Guided, NavigationReport, SensorFrame


@dataclass(frozen=True, kw_only=True, slots=True)
class Decision:
    """What navigation wants of the controller on this tick.

    Attributes:
        velocity: (2,) m/s, forward and left in the heading frame.
        yaw_rate: rad/s, left positive.
        pitch: rad, of the trunk, nose down positive.
        report: what it saw and why.
    """

    velocity: FloatArray
    yaw_rate: float
    pitch: float
    report: NavigationReport


class Navigator:
    """Finds the way from LIDAR, camera and the estimated state.

    Args:
        config: of each part.
        mounts: where the sensors are.
    """

    def __init__(self, config: NavigationConfig, mounts: SensorMounts) -> None:
        self._config = config
        self._reader = ScanReader(config.scan, mounts)
        self._guard = Guard(config.guard)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._scan: LevelScan | None = None
        self._fault = "no sweep of the LIDAR yet"
        self._field = Field(np.zeros(2), 0.0)
        self._pace = Pace(0.0, 0.0)
        self._wanted = Motion()
        self._motion = Motion()
        self._clearance = math.inf

    def step(self, guide: Guide, frame: SensorFrame, estimate: BodyState, dt: float) -> Decision:
        """One tick.

        Args:
            guide: the task.
            frame: newest sensor frame.
            estimate: estimated state of the robot.
            dt: s, command period.
        """
        if frame.lidar is not None:
            result = self._reader.read(frame.lidar, estimate)
            if isinstance(result, str):
                self._fault = result
            else:
                self._fault = ""
                self._scan = result
                self._decide(guide, result)
        blind = self._blind(frame.time)
        if blind:
            self._wanted = Motion()
            self._pace = Pace(0.0, 0.0)
        self._motion = ramped(self._motion, self._wanted, dt, self._config.limits)
        return self._decision(Guided.BLIND if blind else Guided.FIELD, blind)

    def _decide(self, guide: Guide, scan: LevelScan) -> None:
        config = self._config
        self._field = potential_field.field(scan.bearing, scan.distance, config.field)
        self._pace = potential_field.advance(self._pace, self._field, config.field)
        wanted = allowed(Motion(self._pace.speed, 0.0, self._pace.yaw_rate), guide.speed, config.limits)
        guarded = self._guard.step(scan.points[scan.hit], wanted, self._motion)
        self._wanted, self._clearance = guarded.motion, guarded.clearance

    def _blind(self, time: float) -> str:
        """Why the robot cannot see; empty while it can."""
        if self._scan is None:
            return self._fault
        age = time - self._scan.time
        if age <= self._config.scan.stale_after:
            return ""
        return f"no usable sweep of the LIDAR for {age:.1f} s" + (f": {self._fault}" if self._fault else "")

    def _decision(self, guided: Guided, reason: str) -> Decision:
        velocity = np.array(self._motion[:2])
        report = NavigationReport(
            guided=guided, velocity=velocity, yaw_rate=self._motion.yaw_rate, pitch=0.0,
            field=self._field.force, potential=self._field.potential, mixing=0.0,
            marker=np.full(3, np.nan), marker_position=np.full(3, np.nan), marker_age=math.inf,
            clearance=self._clearance, scan_time=math.nan if self._scan is None else self._scan.time,
            reason=reason,
        )  # fmt: skip
        return Decision(velocity=velocity, yaw_rate=self._motion.yaw_rate, pitch=0.0, report=report)
