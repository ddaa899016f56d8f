"""All monitors of the supervisor together, in the order in which they are asked."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.io.safety.config import SafetyConfig
from bluefoot_mpc.io.safety.faults import Fault
from bluefoot_mpc.io.safety.health import Health
from bluefoot_mpc.io.safety.monitors import (
    FrameMonitor,
    HeatMonitor,
    InertialMonitor,
    ReplyMonitor,
    SupplyMonitor,
)
from bluefoot_mpc.io.safety.self_report import HealthMonitor
from bluefoot_mpc.types import FloatArray, SensorFrame

_LONGEST = 0.5
"""s that one frame may stand for: a stalled adapter must not empty a battery by filtering."""


class Monitors:
    """Everything that looks at frames.

    Args:
        config: thresholds.
        period: s, command period.
        powered: True for robots that must be armed: what is not known of them is a fault itself.
    """

    def __init__(self, config: SafetyConfig, period: float, powered: bool) -> None:
        self._period, self._powered = period, powered
        self._supply = SupplyMonitor(config, powered)
        self._heat = HeatMonitor(config, powered)
        self._replies = ReplyMonitor(config, period, powered)
        self._inertial = InertialMonitor(config, powered)
        self._frames = FrameMonitor(config)
        self._health = HealthMonitor()
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        for monitor in (self._supply, self._heat, self._replies, self._inertial, self._frames, self._health):
            monitor.reset()
        self._time: float | None = None

    @property
    def ceiling(self) -> FloatArray | None:
        """(16,) torque limits that heat and dead servos allow, 0..1; None where they allow everything."""
        dead = self._health.dead
        if not (self._heat.derated or dead.any()):
            return None
        return np.where(dead, 0.0, self._heat.ceiling)

    def step(self, frame: SensorFrame, health: Health | None) -> list[Fault]:
        """Every fault that the frame and the robot's own account show."""
        since = 0.0 if self._time is None else frame.time - self._time
        advanced = self._time is None or since > 0.0
        self._time = frame.time
        dt = min(max(since, self._period), _LONGEST)
        faults = self._supply.step(frame, dt)
        faults += self._heat.step(frame, dt)
        faults += self._replies.step(frame, dt, () if health is None else health.put_off)
        faults += self._inertial.step(frame, dt)
        if self._powered:
            faults += self._frames.step(advanced, dt)
        if health is not None:
            faults += self._health.step(health, dt)
        return faults
