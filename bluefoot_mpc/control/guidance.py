"""The stage that lets navigation decide the motion of a guided task."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.navigation.config import NavigationConfig
from bluefoot_mpc.navigation.crossing.config import CrossingConfig
from bluefoot_mpc.navigation.crossing.crosser import Crosser, FeetState
from bluefoot_mpc.navigation.navigator import Navigator
from bluefoot_mpc.terrain.ground import Ground
from bluefoot_mpc.types import (
    BodyState,
    CrossingPhase,
    CrossingReport,
    FloatArray,
    Guide,
    Guided,
    GuideTask,
    MotionCommand,
    NavigationReport,
    SensorFrame,
    TrunkPose,
)

_NOTEWORTHY = {
    Guided.ARRIVED: "at the end of the way",
    Guided.ESCAPE: "boxed in",
    Guided.BLIND: "nothing to go by, the robot stands",
}


FORGET_AFTER = 10.0
"""s without a task after which the surroundings are forgotten: a gap in the radio is no reason to."""


CROSSINGS = (GuideTask.SWEEP, GuideTask.CROSS)
"""Tasks of rough ground; the others are of navigation."""
_ENDS = (CrossingPhase.ARRIVED, CrossingPhase.BLOCKED)


class Guidance:
    """Velocity, yaw rate and trunk of a command with a guide; other commands pass as they are.

    The trunk is level but for what navigation or the crossing of rough ground want of it: the LIDAR's plane
    must not look over things, and what is checked is what is walked.

    Attributes:
        ground: what to step on, where rough ground is crossed; else None.
        crossing: what was seen of rough ground on this tick, and decided; None but for such tasks.

    Args:
        config: of navigation.
        crossing: of the crossing of rough ground.
        robot: where LIDAR and camera are.
    """

    def __init__(self, config: NavigationConfig, crossing: CrossingConfig, robot: RobotParameters) -> None:
        self._navigator = Navigator(config, robot.sensors)
        self._crosser = Crosser(crossing, robot)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self._navigator.reset()
        self._crosser.reset()
        self.ground: Ground | None = None
        self.crossing: CrossingReport | None = None
        self._guided_at = -math.inf
        self._task: GuideTask | None = None
        self._told: Guided | CrossingPhase | None = None

    def step(
        self,
        motion: MotionCommand,
        frame: SensorFrame,
        estimate: BodyState,
        *,
        walks: bool,
        dt: float,
        feet: FeetState | None = None,
    ) -> tuple[MotionCommand, NavigationReport | None, tuple[str, ...]]:
        """One tick.

        Args:
            motion: what the operator or script wants.
            frame: the newest sensor frame.
            estimate: where the robot is.
            walks: the robot may walk now; while it may not, navigation waits.
            dt: s.
            feet: how the feet fared on the last tick; for the tasks of rough ground.

        Returns:
            The command with the motion that was decided; how it was, None but for a task of navigation; and
            what a person should know of it.
        """
        self.crossing = None
        guide = motion.guide
        if guide is None:
            if self._task is not None:
                self._task, self._told, self.ground = None, None, None
            return motion, None, ()
        self._begin(guide, frame.time)
        if not walks:
            return motion, None, ()
        if guide.task in CROSSINGS:
            return self._cross(motion, guide, frame, estimate, feet or FeetState(resting=True), dt)
        return self._navigate(motion, guide, frame, estimate, dt)

    def _begin(self, guide: Guide, time: float) -> None:
        """Begin a task where it is a new one; forget the surroundings after a while without any."""
        if time - self._guided_at > FORGET_AFTER:
            self.reset()
        elif self._task is None:
            self._navigator.begin()
            self._crosser.begin()
        elif self._task is not guide.task and guide.task in CROSSINGS:
            self._crosser.begin()
        if guide.task not in CROSSINGS:
            self.ground = None
        self._task, self._guided_at = guide.task, time

    def _navigate(
        self, motion: MotionCommand, guide: Guide, frame: SensorFrame, estimate: BodyState, dt: float
    ) -> tuple[MotionCommand, NavigationReport | None, tuple[str, ...]]:
        decision = self._navigator.step(guide, frame, estimate, dt)
        trunk = TrunkPose(rpy=np.array([0.0, decision.pitch, 0.0]))
        guided = _guided(motion, decision.velocity, decision.yaw_rate, trunk)
        if guided is None:
            return _still(motion), decision.report, (f"navigation: {NO_NUMBER}",)
        return guided, decision.report, self._events(decision.report)

    def _cross(
        self,
        motion: MotionCommand,
        guide: Guide,
        frame: SensorFrame,
        estimate: BodyState,
        feet: FeetState,
        dt: float,
    ) -> tuple[MotionCommand, NavigationReport | None, tuple[str, ...]]:
        decision = self._crosser.step(guide, frame, estimate, feet, dt)
        self.ground, self.crossing = self._crosser.ground, decision.report
        guided = _guided(motion, decision.velocity, decision.yaw_rate, decision.trunk)
        if guided is None:
            return _still(motion), None, (f"crossing: {NO_NUMBER}",)
        before, self._told = self._told, decision.report.phase
        if self._told is before or self._told not in _ENDS:
            return guided, None, ()
        return guided, None, (f"crossing: {self._told}: {decision.report.reason}".rstrip(": "),)

    def _events(self, report: NavigationReport) -> tuple[str, ...]:
        """That the goal is reached, or that the robot is in trouble, when that begins."""
        before, self._told = self._told, report.guided
        if report.guided is before or report.guided not in _NOTEWORTHY:
            return ()
        told = _NOTEWORTHY[report.guided]
        return (f"navigation: {told}: {report.reason}" if report.reason else f"navigation: {told}",)


NO_NUMBER = "its decision is no number, the robot stands"


def _still(motion: MotionCommand) -> MotionCommand:
    return replace(motion, velocity=np.zeros(2), yaw_rate=0.0)


def _guided(
    motion: MotionCommand, velocity: FloatArray, yaw_rate: float, trunk: TrunkPose
) -> MotionCommand | None:
    """The command with a motion that was decided; None where that is no number."""
    if not math.isfinite(velocity.sum() + yaw_rate + trunk.rpy.sum() + trunk.position.sum()):
        return None
    return replace(motion, velocity=velocity, yaw_rate=yaw_rate, trunk=trunk)
