"""The stages in their order: the only place that knows it.

sensors -> estimation -> modes -> tracking -> gait and footholds -> trunk
placement -> inverse kinematics -> joint goals.
"""

from __future__ import annotations

import math
import time as clock
from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.control import modes, posture, tracking
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.targets import JointTargets
from bluefoot_mpc.control.trunk import TrunkPlanner
from bluefoot_mpc.estimation.estimator import Estimator
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.gait import Gait, GaitInputs
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.types import (
    N_JOINTS,
    BodyState,
    FloatArray,
    JointCommand,
    Mode,
    MotionCommand,
    PostureReference,
    SafetyRequest,
    SensorFrame,
    Telemetry,
)


@dataclass(frozen=True, kw_only=True, slots=True)
class ControlOutput:
    """What one tick gives: the command, and the controller's account of it."""

    command: JointCommand
    telemetry: Telemetry


class Pipeline:
    """The paper's laws, from a sensor frame to joint goals.

    Args:
        robot: the robot's model.
        config: the controller's configuration.
        period: s, command period.
    """

    def __init__(self, robot: RobotModel, config: ControlConfig, period: float) -> None:
        self.config = config
        self.period = period
        geometry = robot.geometry
        stance = posture.stance(robot.parameters.stance, config.posture)
        imu = replace(config.estimator.imu, mount=robot.parameters.sensors.imu)
        self._estimator = Estimator(geometry, replace(config.estimator, imu=imu))
        self._gait = Gait(config.gait, stance.feet)
        self._targets = JointTargets(geometry, config.ankle)
        self._trunk = TrunkPlanner(
            robot.parameters, stance.trunk_height, config.posture, config.zmp, self._targets.reach
        )
        self._require_reachable(stance)
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._estimator.reset()
        self._gait.reset()
        self._trunk.reset()
        self._targets.reset()
        self._modes = modes.ModeState()
        self._tracking = tracking.TrackingState()
        self._walking = False

    def step(
        self, frame: SensorFrame, motion: MotionCommand, safety: SafetyRequest | None = None
    ) -> ControlOutput:
        """One tick.

        Args:
            frame: the newest sensor frame.
            motion: what the operator or script wants.
            safety: what the supervisor asked for on the previous tick.
        """
        start = clock.perf_counter_ns()
        dt = self.period
        estimate = self._estimator.step(frame)
        roll, pitch, _ = estimate.rpy.tolist()
        tilt = rotation_from_rpy(np.array([roll, pitch, 0.0]))
        before = self._modes
        self._modes = modes.advance(
            before, motion.mode, safety or SafetyRequest(), self._walking,
            math.degrees(math.acos(min(1.0, float(tilt[2, 2])))), dt, self.config.modes,
        )  # fmt: skip
        motion = self._in_force(motion, estimate)
        twist = self._corrected(motion, estimate, tilt)
        gait = self._gait.step(self._gait_inputs(twist, motion, estimate, tilt), dt)
        self._walking = gait.phase.walking
        reference, zmp, held = self._trunk.step(gait, motion, estimate, self._modes.sit_level, dt)
        joints, cut = self._targets.step(reference, frame.joint_position, dt)
        events = held + cut
        command = JointCommand(
            position=joints, speed=np.zeros(N_JOINTS), torque_limit=np.full(N_JOINTS, self._modes.torque)
        )
        if self._modes.mode is not before.mode:
            events = (*events, f"mode {before.mode} -> {self._modes.mode} {self._modes.reason}".rstrip())
        telemetry = Telemetry(
            time=frame.time, mode=self._modes.mode, estimate=estimate, phase=gait.phase, reference=reference,
            motion=motion,
            zmp=zmp, events=events,
            tick_us=(clock.perf_counter_ns() - start) * 1e-3,
        )  # fmt: skip
        return ControlOutput(command=command, telemetry=telemetry)

    def _require_reachable(self, stance: posture.Stance) -> None:
        level = PostureReference(
            trunk_position=np.array([self.config.posture.trunk_forward, 0.0, stance.trunk_height]),
            trunk_rpy=np.zeros(3), foot_position=stance.feet, swing=np.zeros(4, dtype=np.bool_),
        )  # fmt: skip
        result = self._targets.reach(level)
        if not result.feasible:
            raise ConfigurationError(f"the stance is out of reach: {'; '.join(result.describe())}")

    def _in_force(self, motion: MotionCommand, estimate: BodyState) -> MotionCommand:
        """The command, without its motion where the robot must not walk: other modes, or a blind estimate."""
        walks = motion.mode is Mode.WALK and self._modes.mode is Mode.WALK and self._modes.ending == 0.0
        if walks and estimate.healthy:
            return motion
        return MotionCommand(mode=motion.mode, gait=motion.gait, trunk=motion.trunk)

    def _corrected(self, motion: MotionCommand, estimate: BodyState, tilt: FloatArray) -> tracking.Twist:
        """The commanded twist, corrected by odometry while walking."""
        wanted = tracking.Twist(velocity=motion.velocity, yaw_rate=motion.yaw_rate)
        if motion.yaw_rate == 0.0 and not any(motion.velocity.tolist()):
            self._tracking = tracking.rest(self._tracking)
            return wanted
        horizontal = tilt @ estimate.linear_velocity
        measured = tracking.Twist(velocity=horizontal[:2], yaw_rate=float(estimate.angular_velocity[2]))
        self._tracking, twist = tracking.advance(
            self._tracking, wanted, measured, float(estimate.rpy[2]), self.period, self.config.tracking
        )
        return twist

    def _gait_inputs(
        self, twist: tracking.Twist, motion: MotionCommand, estimate: BodyState, tilt: FloatArray
    ) -> GaitInputs:
        feet = estimate.foot_position_in_base @ tilt.T + self._trunk.position
        rates = tilt @ estimate.angular_velocity
        return GaitInputs(
            velocity=twist.velocity, yaw_rate=twist.yaw_rate, gait=motion.gait, contact=estimate.contact,
            foot_position=feet, tilt_rate_error=rates[:2], halt=self._modes.mode is Mode.SAFE,
        )  # fmt: skip
