"""Trunk levelling in the pipeline: what it is given there, and over which gait masses are averaged."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.gait.gait import Gait, GaitInputs
from bluefoot_mpc.geometry import wrap_angle
from bluefoot_mpc.leveling.compensator import Compensator, Leveled
from bluefoot_mpc.leveling.config import LevelingConfig
from bluefoot_mpc.leveling.contact_force import specific_force
from bluefoot_mpc.leveling.signals import LevelingInputs, newest_rate
from bluefoot_mpc.model.legs import IkResult
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import BodyState, FloatArray, PostureReference, SensorFrame

RECORDED_SPEED = 0.06
"""m/s of the trot whose joints the nominal mass matrix is averaged over."""
_SETTLE, _RECORD, _TICK = 2.0, 2.0, 0.02  # s: before recording, while recording, between samples


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelWish:
    """What the trunk should do, and whether the robot walks.

    Attributes:
        tilt: (2,) rad, commanded roll and pitch.
        heading: rad, commanded heading of the trunk in the odometry frame; NaN where there is none.
        walking: True while the gait steps.
        voltage: V at the servos.
    """

    tilt: FloatArray
    heading: float
    walking: bool
    voltage: float


class LevelStage:
    """The compensator behind the pipeline's other stages.

    Args:
        robot: the model.
        config: of the compensator.
        gait_joints: (n, 16) rad, joints over a gait; see `recorded_gait`.
    """

    def __init__(self, robot: RobotModel, config: LevelingConfig, gait_joints: FloatArray) -> None:
        self.compensator = Compensator(robot, config, gait_joints)
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.compensator.reset()
        self._stopped = ""

    def step(
        self, goals: FloatArray, frame: SensorFrame, estimate: BodyState, wish: LevelWish, dt: float
    ) -> tuple[Leveled, tuple[str, ...]]:
        """Goals with the levelling in them, and what a person should know of it.

        Args:
            goals: (16,) rad, goals of the stages before.
            frame: newest sensor frame.
            estimate: state estimate.
            wish: what the trunk should do.
            dt: s.
        """
        known = not math.isnan(wish.heading)
        inputs = LevelingInputs(
            estimate=estimate, turn_rate=newest_rate(frame.imu, estimate.angular_velocity),
            tilt_reference=wish.tilt,
            heading_error=wrap_angle(float(estimate.rpy[2]) - wish.heading) if known else 0.0,
            goals=goals, joint_load=np.where(frame.joint_valid, frame.joint_load, np.nan),
            specific_force=specific_force(frame.imu), voltage=wish.voltage, walking=wish.walking,
        )  # fmt: skip
        leveled = self.compensator.step(inputs, dt)
        before, self._stopped = self._stopped, leveled.report.stopped
        if self._stopped == before:
            return leveled, ()
        return leveled, (f"levelling off: {self._stopped}" if self._stopped else "levelling on again",)


def recorded_gait(
    gait: Gait, stance: PostureReference, reach: Callable[[PostureReference], IkResult]
) -> FloatArray:
    """(n, 16) rad, joints of a slow trot under a level trunk, by the gait and inverse kinematics alone.

    Args:
        gait: a gait of its own; it is stepped.
        stance: trunk over the nominal stance.
        reach: inverse kinematics.
    """
    inputs = GaitInputs(velocity=np.array([RECORDED_SPEED, 0.0]))
    for _ in range(round(_SETTLE / _TICK)):
        gait.step(inputs, _TICK)
    rows = []
    for _ in range(round(_RECORD / _TICK)):
        output = gait.step(inputs, _TICK)
        posture = replace(stance, foot_position=output.foot_position, swing=output.phase.swing)
        rows.append(reach(posture).joints)
    return np.array(rows)
