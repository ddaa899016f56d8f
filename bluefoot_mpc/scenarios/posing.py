"""Scenarios with all feet planted: standing, and posing the trunk."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.targets import JointTargets
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios.base import (
    NOT_MEASURED,
    Criterion,
    Scenario,
    ScenarioConfig,
    at_most,
    not_fallen,
)
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import FloatArray, MotionCommand, PostureReference, TrunkPose


@dataclass(frozen=True, kw_only=True, slots=True)
class StandConfig(ScenarioConfig):
    """Standing still."""

    duration: float = 10.0  # s


class Stand(Scenario):
    """Stand still on all feet."""

    name = "stand"
    Config = StandConfig

    def command(self, time: float) -> MotionCommand:
        """Stand."""
        return MotionCommand()

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet and level."""
        return [
            not_fallen(summary),
            at_most(summary, "roll_peak_deg", 2.0, "roll", "deg"),
            at_most(summary, "pitch_peak_deg", 2.0, "pitch", "deg"),
        ]


@dataclass(frozen=True, kw_only=True, slots=True)
class PoseConfig(ScenarioConfig):
    """How far the trunk moves along and about each axis, one after the other."""

    duration: float = 42.0  # s
    stand_time: float = 2.0  # s before the first pose
    forward: float = 0.05  # m, ±
    sideways: float = 0.05  # m, ±
    height: float = 0.025  # m, ±
    roll_deg: float = 15.0  # ±
    pitch_deg: float = 15.0  # ±
    yaw_deg: float = 15.0  # ±

    def __post_init__(self) -> None:
        ScenarioConfig.__post_init__(self)
        require_positive(duration=self.duration)
        require_nonnegative(
            stand_time=self.stand_time, forward=self.forward, sideways=self.sideways, height=self.height,
            roll_deg=self.roll_deg, pitch_deg=self.pitch_deg, yaw_deg=self.yaw_deg,
        )  # fmt: skip

    def amplitudes(self) -> FloatArray:
        """(6,) m and rad: x, y, z, roll, pitch, yaw."""
        angles = np.radians([self.roll_deg, self.pitch_deg, self.yaw_deg])
        return np.array([self.forward, self.sideways, self.height, *angles])


AXES = ("forward", "sideways", "height", "roll_deg", "pitch_deg", "yaw_deg")
"""Fields of `PoseConfig` in the order of the axes."""


class Pose(Scenario):
    """Move the trunk through its range of motion over planted feet."""

    name = "pose"
    Config = PoseConfig

    def command(self, time: float) -> MotionCommand:
        """One sine per axis, one axis after the other."""
        config = self.config
        share = (time - config.stand_time) / max(1e-9, config.duration - config.stand_time)
        if share < 0.0:
            return MotionCommand()
        axis, within = divmod(share * 6.0, 1.0)
        offset = np.zeros(6)
        offset[min(5, int(axis))] = math.sin(2.0 * math.pi * within)
        offset *= config.amplitudes()
        return MotionCommand(trunk=TrunkPose(position=offset[:3], rpy=offset[3:]))

    def check(self, robot: RobotModel, control: ControlConfig) -> None:
        """Refuse amplitudes that the planted feet do not allow.

        Raises:
            ConfigurationError: an extreme pose is out of reach; says which and why.
        """
        stance = posture.stance(robot.parameters.stance, control.posture)
        targets = JointTargets(robot.geometry, control.ankle)
        for axis, amplitude in enumerate(self.config.amplitudes()):
            for sign in (1.0, -1.0):
                pose = np.zeros(6)
                pose[axis] = sign * amplitude
                reference = PostureReference(
                    trunk_position=pose[:3] + np.array([0.0, 0.0, stance.trunk_height]), trunk_rpy=pose[3:],
                    foot_position=stance.feet, swing=np.zeros(4, dtype=np.bool_),
                )  # fmt: skip
                result = targets.reach(reference)
                if not result.feasible:
                    value = getattr(self.config, AXES[axis])
                    raise ConfigurationError(
                        f"{AXES[axis]} = {value:g} is out of reach: {'; '.join(result.describe())}"
                    )

    def window(self) -> tuple[float, float]:
        """The whole motion: the command never rests."""
        return self.config.stand_time, self.config.duration

    def criteria(self, summary: Mapping[str, Any]) -> list[Criterion]:
        """On its feet, the trunk where it was commanded."""
        return [
            not_fallen(summary),
            at_most(summary, "roll_rms_deg", TRACKING_DEG, "roll error RMS", "deg"),
            at_most(summary, "pitch_rms_deg", TRACKING_DEG, "pitch error RMS", "deg"),
            self._in_place(summary),
        ]

    def figures(self, run: RunData) -> Mapping[str, Any]:
        """RMS distance of the trunk from where it was commanded, from its place before the first pose."""
        time = np.array([sample.time for sample in run.truth])
        before = (time >= 0.5 * self.config.stand_time) & (time < self.config.stand_time)
        after = time >= self.config.stand_time
        if not before.any() or not after.any():
            return {}
        position = run.stack("truth", "q")[:, :3]
        wanted = np.array([record.motion.trunk.position for record in run.commands[: len(time)]])
        error = (position - position[before].mean(axis=0) - wanted)[after]
        return {POSITION_ERROR: float(np.sqrt((error**2).sum(axis=1).mean()))}

    def _in_place(self, summary: Mapping[str, Any]) -> Criterion:
        seen = (summary.get("figures") or {}).get(POSITION_ERROR)
        return Criterion(
            name=f"trunk position error RMS at most {1e3 * TRACKING:g} mm",
            holds=seen is not None and seen <= TRACKING,
            detail=NOT_MEASURED if seen is None else f"{1e3 * seen:.1f} mm",
        )


POSITION_ERROR = "trunk_position_error_rms_m"
TRACKING = 0.010
"""m, RMS error of the trunk's place while it follows a slow sine."""
TRACKING_DEG = 1.0
"""RMS error of the trunk's angles while it follows a slow sine through soft servos."""
