"""The trunk's reference: commanded offset, level trim, ZMP placement and sitting put together."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.gait_sway import GaitSway
from bluefoot_mpc.control.level import Centring
from bluefoot_mpc.control.posture import PostureConfig, Stance
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.model.legs import IkResult
from bluefoot_mpc.types import BodyState, BoolArray, FloatArray, MotionCommand, PostureReference
from bluefoot_mpc.zmp.preview import ComPlan

JointsInStance = Callable[[FloatArray], FloatArray]
_TELLING = 2e-4
"""m, shift of the load's centre from which the sway has to know."""
_PLANTED: BoolArray = np.zeros(4, dtype=np.bool_)


@dataclass(frozen=True, kw_only=True, slots=True)
class Footing:
    """How the robot stands on this tick.

    Attributes:
        sit_level: 0 stands, 1 sits.
        joints: (16,) rad, for the legs' masses.
        settled: False while the joints are still on their way from where they were found.
    """

    sit_level: float
    joints: FloatArray
    settled: bool = True


class TrunkPlanner:
    """Plans the trunk's pose over the feet, in the robot-relative frame b'.

    Attributes:
        position: (3,) m, the trunk origin that was last wanted, in b'.
        yaw: rad, the trunk's commanded yaw in b'.
        velocity: (2,) m/s, how the wanted trunk origin moves in b' (sway and commanded offset).
        tilt_rate: (2,) rad/s, commanded angular velocity about x and y of b'.

    Args:
        stance: nominal feet and height of the trunk.
        config: offsets, rates and trims.
        sway: makes the law by which the trunk moves for balance.
        reach: inverse kinematics, to refuse poses that the legs cannot hold.
    """

    def __init__(
        self,
        stance: Stance,
        config: PostureConfig,
        sway: Callable[[JointsInStance], GaitSway],
        reach: Callable[[PostureReference], IkResult],
    ) -> None:
        self._reach = reach
        self._stance = stance
        self._config = config
        self._sway = sway(self._joints_in_stance)
        self._centring = Centring(config.centring)
        self.reset()

    def reset(self) -> None:
        """Forget every offset."""
        self._pose = np.zeros(6)
        self._trim = np.zeros(2)
        self._centring.reset()
        self._told = np.zeros(6)
        self._sway.reset()
        self._held = False
        self.position = self.over_stance(self._pose).trunk_position
        self.yaw = 0.0
        self.velocity = np.zeros(2)
        self.tilt_rate = np.zeros(2)

    @property
    def tilt(self) -> FloatArray:
        """(2,) rad, commanded roll and pitch in force."""
        return self._pose[3:5]

    @property
    def plan(self) -> ComPlan | None:
        """The preview's plan of the last tick; None without a preview."""
        return self._sway.plan

    def step(
        self, gait: GaitOutput, motion: MotionCommand, estimate: BodyState, stand: Footing, dt: float
    ) -> tuple[PostureReference, FloatArray, tuple[str, ...]]:
        """The wanted trunk and feet, the (2,) ZMP that the placement law assumes, and events.

        A commanded offset that the legs cannot hold is not followed: the trunk
        stays at the last pose on the way that they can.

        Args:
            gait: feet in b' and the gait's phase.
            motion: the command, for the trunk offset.
            estimate: state estimate, for the level trim and the legs' masses.
            stand: how far the robot sits, and its joints.
            dt: s.
        """
        config, style = self._config, gait.style
        # A blind estimate goes on from its last attitude: integrating it would tilt the trunk for real.
        if stand.sit_level == 0.0 and stand.settled and estimate.healthy:
            tilt = estimate.rpy[:2] - self._pose[3:5]
            self._centring.step(tilt, gait, dt)
            self._trim = posture.trim_level(self._trim, tilt, style.level_gain, config.level_bound, dt)
        zmp = self._sway.step(gait, stand.joints, self.position, dt)
        height = self._height(style.trunk_height, stand.sit_level)
        before = self._pose
        events = self._follow(gait, motion, height, dt)
        self._tell_sway(moved=self._pose is not before)
        self.tilt_rate = _tilt_rate(before, self._pose, dt)
        reference = self._reference(gait, self._pose, height)
        self.velocity = (reference.trunk_position - self.position)[:2] / dt
        self.position, self.yaw = reference.trunk_position, float(self._pose[5])
        return reference, zmp, events

    def _tell_sway(self, moved: bool) -> None:
        """Let the sway know where the trunk is told to be, or it would lead the trunk back."""
        told = self._pose.copy()
        told[:2] += self._centring.offset
        # Small shifts wait until they add up: the sway solves the legs anew for each.
        if moved or float(np.abs(told - self._told).max()) > _TELLING:
            self._sway.follow(told)
            self._told = told

    def over_stance(self, pose: FloatArray, sit_level: float = 0.0) -> PostureReference:
        """The reference of a (6,) commanded offset over the nominal stance; `sit_level` 1 sits."""
        x, y, z = pose[:3].tolist()
        height = self._height(self._stance.trunk_height, sit_level)
        return PostureReference(
            trunk_position=np.array([x + self._config.trunk_forward, y, z + height]),
            trunk_rpy=pose[3:],
            foot_position=self._stance.feet,
            swing=_PLANTED,
        )

    def _height(self, standing: float, sit_level: float) -> float:
        return standing * (1.0 - sit_level * (1.0 - self._config.sit_height_share))

    def _joints_in_stance(self, pose: FloatArray) -> FloatArray:
        return self._reach(self.over_stance(pose)).joints

    def _follow(self, gait: GaitOutput, motion: MotionCommand, height: float, dt: float) -> tuple[str, ...]:
        """Move the offset towards the commanded one, as far as the legs can hold it."""
        wanted = posture.follow_pose(self._pose, motion.trunk, dt, self._config)
        if wanted is self._pose or np.array_equal(wanted, self._pose):
            self._held = False
            return ()
        result = self._reach(self._reference(gait, wanted, height))
        if result.feasible or self._is_closer_to_neutral(wanted) or self._leads_back(gait, motion, height):
            self._pose, self._held = wanted, False
            return ()
        if self._held:
            return ()
        self._held = True
        return (f"trunk pose held, the one commanded is out of reach: {'; '.join(result.describe())}",)

    def _is_closer_to_neutral(self, wanted: FloatArray) -> bool:
        # The way back must never be barred, whatever the feet do meanwhile.
        return float(np.abs(wanted).sum()) < float(np.abs(self._pose).sum())

    def _leads_back(self, gait: GaitOutput, motion: MotionCommand, height: float) -> bool:
        """True where the legs hold the commanded pose, but not the one in force."""
        commanded = np.array([*motion.trunk.position.tolist(), *motion.trunk.rpy.tolist()])
        pose, reach = self._pose, self._reach
        return (
            reach(self._reference(gait, commanded, height)).feasible
            and not reach(self._reference(gait, pose, height)).feasible
        )

    def _reference(self, gait: GaitOutput, pose: FloatArray, height: float) -> PostureReference:
        x, y, z, roll, pitch, yaw = pose.tolist()
        shift_x, shift_y = (self._sway.offset + self._centring.offset).tolist()
        trim_roll, trim_pitch = self._trim.tolist()
        return PostureReference(
            trunk_position=np.array([x + gait.style.trunk_forward + shift_x, y + shift_y, z + height]),
            trunk_rpy=np.array([roll + trim_roll, pitch + trim_pitch, yaw]),
            foot_position=gait.foot_position,
            swing=gait.phase.swing,
        )


def _tilt_rate(before: FloatArray, after: FloatArray, dt: float) -> FloatArray:
    """(2,) rad/s, horizontal angular velocity in b' of a trunk that goes from one (6,) pose to the next."""
    if before is after:
        return np.zeros(2)
    roll_rate, pitch_rate, _ = ((after[3:] - before[3:]) / dt).tolist()
    _, pitch, yaw = after[3:].tolist()
    along = math.cos(pitch) * roll_rate
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([c * along - s * pitch_rate, s * along + c * pitch_rate])
