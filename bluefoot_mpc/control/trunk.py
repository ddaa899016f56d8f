"""The trunk's reference: commanded offset, level trim, ZMP placement and sitting put together."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bluefoot_mpc.control import posture
from bluefoot_mpc.control.posture import PostureConfig
from bluefoot_mpc.gait.gait import GaitOutput
from bluefoot_mpc.model.legs import IkResult, LegGeometry, joint_positions_in_base
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.types import BodyState, BoolArray, FloatArray, MotionCommand, PostureReference
from bluefoot_mpc.zmp import placement
from bluefoot_mpc.zmp.mass_points import lump
from bluefoot_mpc.zmp.placement import PlacementConfig


class TrunkPlanner:
    """Plans the trunk's pose over the feet, in the robot-relative frame b'.

    Args:
        parameters: the robot.
        trunk_height: m, nominal height of the trunk origin over the foot points.
        config: offsets, rates and trims.
        zmp: the placement law.
        reach: inverse kinematics, to refuse poses that the legs cannot hold.
    """

    def __init__(
        self,
        parameters: RobotParameters,
        trunk_height: float,
        config: PostureConfig,
        zmp: PlacementConfig,
        reach: Callable[[PostureReference], IkResult],
    ) -> None:
        self._reach = reach
        self._geometry = LegGeometry.from_parameters(parameters)
        self._masses = lump(parameters)
        self._height = trunk_height
        self._config = config
        self._zmp = zmp
        self.reset()

    def reset(self) -> None:
        """Forget every offset."""
        self._pose = np.zeros(6)
        self._trim = np.zeros(2)
        self._placement = np.zeros(2)
        self._held = False
        self.position = np.array([self._config.trunk_forward, 0.0, self._height])

    def step(
        self, gait: GaitOutput, motion: MotionCommand, estimate: BodyState, sit_level: float, dt: float
    ) -> tuple[PostureReference, FloatArray, tuple[str, ...]]:
        """The wanted trunk and feet, the (2,) ZMP that the placement law assumes, and events.

        A commanded offset that the legs cannot hold is not followed: the trunk
        stays at the last pose on the way that they can.

        Args:
            gait: feet in b' and the gait's phase.
            motion: the command, for the trunk offset.
            estimate: state estimate, for the level trim and the legs' masses.
            sit_level: 0 stands, 1 sits.
            dt: s.
        """
        config = self._config
        if sit_level == 0.0:
            self._trim = posture.trim_level(self._trim, estimate.rpy[:2] - self._pose[3:5], dt, config)
        zmp = self._place(gait, estimate, dt)
        height = self._height * (1.0 - sit_level * (1.0 - config.sit_height_share))
        events = self._follow(gait, motion, height, dt)
        reference = self._reference(gait, self._pose, height)
        self.position = reference.trunk_position
        return reference, zmp, events

    def _follow(self, gait: GaitOutput, motion: MotionCommand, height: float, dt: float) -> tuple[str, ...]:
        """Move the offset towards the commanded one, as far as the legs can hold it."""
        wanted = posture.follow_pose(self._pose, motion.trunk, dt, self._config)
        if wanted is self._pose or np.array_equal(wanted, self._pose):
            self._held = False
            return ()
        result = self._reach(self._reference(gait, wanted, height))
        if result.feasible or self._is_closer_to_neutral(wanted):
            self._pose, self._held = wanted, False
            return ()
        if self._held:
            return ()
        self._held = True
        return (f"trunk pose held, the one commanded is out of reach: {'; '.join(result.describe())}",)

    def _is_closer_to_neutral(self, wanted: FloatArray) -> bool:
        # The way back must never be barred, whatever the feet do meanwhile.
        return float(np.abs(wanted).sum()) < float(np.abs(self._pose).sum())

    def _reference(self, gait: GaitOutput, pose: FloatArray, height: float) -> PostureReference:
        x, y, z, roll, pitch, yaw = pose.tolist()
        shift_x, shift_y = self._placement.tolist()
        trim_roll, trim_pitch = self._trim.tolist()
        return PostureReference(
            trunk_position=np.array([x + self._config.trunk_forward + shift_x, y + shift_y, z + height]),
            trunk_rpy=np.array([roll + trim_roll, pitch + trim_pitch, yaw]),
            foot_position=gait.foot_position,
            swing=gait.phase.swing,
        )

    def _place(self, gait: GaitOutput, estimate: BodyState, dt: float) -> FloatArray:
        law = self._zmp
        if not law.enabled:
            return np.full(2, np.nan)
        # The law is quasi-static and its rotations are small: legs are taken in
        # the trunk's axes, relative to the trunk's neutral place.
        points = joint_positions_in_base(self._geometry, estimate.joint_position)
        com = placement.centre_of_mass(self._masses, self._masses.trunk_com, points)
        zmp = placement.static_zmp(self._masses, com, points, self._swing_ahead(gait)) + self._placement
        force = placement.boundary_force(self.position, gait.foot_position, law)
        self._placement = placement.advance(self._placement, zmp, force, self._masses, dt, law)
        return zmp

    def _swing_ahead(self, gait: GaitOutput) -> BoolArray:
        """(4,) True where a leg will swing after the law's lead time, at the present rhythm."""
        if not gait.phase.walking:
            return np.zeros(4, dtype=np.bool_)
        ahead = (gait.phase.phase + self._zmp.lead / gait.cycle_time) % 1.0
        return np.asarray(ahead < gait.swing_share)
