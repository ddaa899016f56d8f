"""The stage that lets navigation decide the motion of a guided task."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.navigator import Navigator
from bluefoot_mpc.terrain.ground import Ground
from bluefoot_mpc.types import BodyState, Guided, MotionCommand, NavigationReport, SensorFrame, TrunkPose

_NOTEWORTHY = {
    Guided.ARRIVED: "at the end of the way",
    Guided.ESCAPE: "boxed in",
    Guided.BLIND: "nothing to go by, the robot stands",
}


FORGET_AFTER = 10.0
"""s without a task after which the surroundings are forgotten: a gap in the radio is no reason to."""


class Guidance:
    """Velocity, yaw rate and trunk of a command with a guide; other commands pass as they are.

    The trunk is level but for the pitch that navigation wants: the LIDAR's plane
    must not look over things, and what is checked is what is walked.

    Attributes:
        ground: what to step on, where rough ground is crossed; else None.

    Args:
        config: of navigation.
        mounts: where LIDAR and camera are.
    """

    def __init__(self, config: NavigationConfig, mounts: SensorMounts) -> None:
        self._navigator = Navigator(config, mounts)
        self.ground: Ground | None = None
        self._guided_at = -math.inf
        self._has_task = False
        self._told: Guided | None = None

    def reset(self) -> None:
        """Forget everything."""
        self._navigator.reset()
        self.ground = None
        self._guided_at = -math.inf
        self._has_task = False
        self._told = None

    def step(
        self, motion: MotionCommand, frame: SensorFrame, estimate: BodyState, *, walks: bool, dt: float
    ) -> tuple[MotionCommand, NavigationReport | None, tuple[str, ...]]:
        """One tick.

        Args:
            motion: what the operator or script wants.
            frame: the newest sensor frame.
            estimate: where the robot is.
            walks: the robot may walk now; while it may not, navigation waits.
            dt: s.

        Returns:
            The command with the motion that was decided; how it was, None without a guide; and what a person
            should know of it.
        """
        if motion.guide is None:
            self._has_task, self._told = False, None
            return motion, None, ()
        if frame.time - self._guided_at > FORGET_AFTER:
            self.reset()
        elif not self._has_task:
            self._navigator.begin()
        self._has_task, self._guided_at = True, frame.time
        if not walks:
            return motion, None, ()
        decision = self._navigator.step(motion.guide, frame, estimate, dt)
        velocity, yaw_rate, pitch = decision.velocity, decision.yaw_rate, decision.pitch
        if not math.isfinite(velocity.sum() + yaw_rate + pitch):
            still = replace(motion, velocity=np.zeros(2), yaw_rate=0.0)
            return still, decision.report, ("navigation: its decision is no number, the robot stands",)
        trunk = TrunkPose(rpy=np.array([0.0, pitch, 0.0]))
        guided = replace(motion, velocity=velocity, yaw_rate=yaw_rate, trunk=trunk)
        return guided, decision.report, self._events(decision.report)

    def _events(self, report: NavigationReport) -> tuple[str, ...]:
        """That the goal is reached, or that the robot is in trouble, when that begins."""
        before, self._told = self._told, report.guided
        if report.guided is before or report.guided not in _NOTEWORTHY:
            return ()
        told = _NOTEWORTHY[report.guided]
        return (f"navigation: {told}: {report.reason}" if report.reason else f"navigation: {told}",)
