"""The stages in their order: the only place that knows it.

sensors -> estimation -> modes -> guidance -> tracking -> gait and footholds -> ground plane
-> trunk placement (static law or preview) -> inverse kinematics -> whole-body
problem -> servo mapping -> trunk levelling -> joint goals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.control import modes, plans, posture, servo_map, tracking
from bluefoot_mpc.control.body_planner import BodyPlanner, Surroundings
from bluefoot_mpc.control.command import usable
from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.foot_placer import FootPlacer
from bluefoot_mpc.control.gait_sway import GaitSway
from bluefoot_mpc.control.ground import GroundAdapter
from bluefoot_mpc.control.guidance import Guidance
from bluefoot_mpc.control.leg_masses import LegMasses
from bluefoot_mpc.control.leveling import LevelStage, LevelWish, recorded_gait
from bluefoot_mpc.control.planned_body import PlannedBody
from bluefoot_mpc.control.preview_sway import PreviewSway
from bluefoot_mpc.control.push_recovery import PushRecovery
from bluefoot_mpc.control.sway import Sway
from bluefoot_mpc.control.targets import JointTargets
from bluefoot_mpc.control.trunk import Footing, JointsInStance, TrunkPlanner
from bluefoot_mpc.estimation.estimator import Estimator
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.gait import Gait, GaitInputs, GaitOutput, Style
from bluefoot_mpc.geometry import rotation_from_rpy
from bluefoot_mpc.leveling.narx import NarxWeights
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.navigation.crossing.crosser import FeetState
from bluefoot_mpc.types import (
    N_JOINTS,
    BodyState,
    CrossingReport,
    FloatArray,
    JointCommand,
    LevelReport,
    Mode,
    MotionCommand,
    PostureReference,
    SafetyLevel,
    SafetyRequest,
    SensorFrame,
    Telemetry,
)
from bluefoot_mpc.wbc import WholeBodyPlan

BLIND = "the estimate is not to be trusted: the robot does not walk on"


@dataclass(frozen=True, kw_only=True, slots=True)
class ControlOutput:
    """What one tick gives: the command, and the controller's account of it."""

    command: JointCommand
    telemetry: Telemetry


class Pipeline:
    """From a sensor frame to joint goals: the paper's laws, and model-based control beside them.

    Args:
        robot: the robot's model.
        config: the controller's configuration.
        period: s, command period.
    """

    def __init__(self, robot: RobotModel, config: ControlConfig, period: float) -> None:
        self.config = config
        self.period = period
        self._robot = robot
        geometry = robot.geometry
        stance = posture.stance(robot.parameters.stance, config.posture)
        imu = replace(config.estimator.imu, mount=robot.parameters.sensors.imu)
        self._estimator = Estimator(geometry, replace(config.estimator, imu=imu))
        style = posture.style(stance, config.posture, config.servo)
        self._gait = Gait(config.gait, stance.feet, style)
        self._targets = JointTargets(geometry, config.ankle)
        self._trunk = TrunkPlanner(stance, config.posture, self._sway, self._targets.reach)
        self._body = PlannedBody(robot.parameters.servo)
        self._planner = BodyPlanner(robot, config.whole_body) if config.whole_body.enabled else None
        self._ground = GroundAdapter(config.ground)
        self._guidance = Guidance(config.navigation, config.crossing, robot.parameters)
        self._placer = FootPlacer(geometry, config.placer)
        self._recovery = PushRecovery(config.push_recovery)
        self._step_back = plans.StepBack()
        self._require_reachable()
        self._level = self._level_stage(Gait(config.gait, stance.feet, style))
        self.reset()

    def reset(self) -> None:
        """Forget everything: the state after ``__init__``, bit for bit."""
        self._estimator.reset()
        self._gait.reset()
        self._trunk.reset()
        self._targets.reset()
        self._body.reset()
        if self._planner is not None:
            self._planner.reset()
        self._ground.reset()
        self._guidance.reset()
        self._placer.reset()
        self._recovery.reset()
        if self._level is not None:
            self._level.reset()
        self._told = np.zeros(2)
        self._modes = modes.ModeState()
        self._tracking = tracking.TrackingState()
        self._wanted = MotionCommand()
        self._notices: tuple[str, ...] = ()
        self._step_back.reset()
        self._walking = False

    @property
    def learnt(self) -> NarxWeights | None:
        """What the levelling network has learnt; None without one."""
        return None if self._level is None else self._level.compensator.source.weights

    @property
    def sitting(self) -> PostureReference:
        """Trunk and feet of the sitting posture, over the nominal stance."""
        return self._trunk.over_stance(np.zeros(6), sit_level=1.0)

    @property
    def sitting_joints(self) -> FloatArray:
        """(16,) rad, joints of the sitting posture."""
        return self._targets.reach(self.sitting).joints

    def step(
        self, frame: SensorFrame, motion: MotionCommand, safety: SafetyRequest | None = None
    ) -> ControlOutput:
        """One tick.

        Args:
            frame: the newest sensor frame.
            motion: what the operator or script wants.
            safety: what the supervisor asked for on the previous tick.
        """
        dt = self.period
        estimate = self._estimator.step(frame)
        upright = self._rotation_base_to_virtual(estimate)
        self._wanted, faults = usable(motion, self._wanted)
        own = self._step_back.request
        begun = self._begun((*faults, *own.reasons) if estimate.healthy else (*faults, *own.reasons, BLIND))
        urgent = plans.more_urgent(safety or SafetyRequest(), own)
        changed = self._advance_mode(urgent, float(upright[2, 2]))
        walks = self._walks(estimate)
        fared = FeetState(resting=not self._walking, waiting=self._placer.waiting)
        guided, navigation, found = self._guidance.step(
            self._wanted, frame, estimate, walks=walks, dt=dt, feet=fared
        )
        motion = self._in_force(guided, walks)
        if self._placer.pace < 1.0:  # feet wait for good ground
            pace = self._placer.pace
            motion = replace(motion, velocity=pace * motion.velocity, yaw_rate=pace * motion.yaw_rate)
        twist = self._corrected(motion, estimate, upright)
        self._placer.step(self._guidance.ground, estimate, self._gait, dt)
        gait = self._gait.step(self._gait_inputs(twist, motion, estimate, upright), dt)
        self._walking = gait.phase.walking
        self._tracking = tracking.followed(self._tracking, twist, gait.velocity)
        self._told = gait.velocity
        gait = self._on_the_ground(gait, estimate, upright, dt)
        footing = self._footing(estimate)
        reference, zmp, held = self._trunk.step(gait, self._leant(motion), estimate, footing, dt)
        self._targets.stand_up(self._guidance.ground is not None, dt)
        joints, cut = self._targets.step(reference, frame, dt, gait.style.ankle_shift)
        plan = self._planned(gait, reference, joints, frame)
        goals = self._goals(gait.style, joints, plan, frame)
        goals, level, leveling = self._leveled(goals, frame, estimate)
        planned = plans.report(self._trunk.plan, plan)
        self._step_back.step(planned, dt)
        command = JointCommand(
            position=goals, speed=np.zeros(N_JOINTS), torque_limit=np.full(N_JOINTS, self._modes.torque)
        )
        telemetry = Telemetry(
            time=frame.time, mode=self._modes.mode, motion=motion, estimate=estimate, phase=gait.phase,
            reference=reference, zmp=zmp, events=begun + found + held + cut + changed + leveling,
            plan=planned, level=level, navigation=navigation, crossing=self._crossing(),
        )  # fmt: skip
        return ControlOutput(command=command, telemetry=telemetry)

    def _sway(self, joints_in_stance: JointsInStance) -> GaitSway:
        masses, config = LegMasses(self._robot.parameters), self.config
        preview = None
        if "preview" in (config.sway.trot, config.sway.walk):
            rough = (config.sway.rough_margin, config.sway.rough_depth)
            preview = PreviewSway(masses, config.preview, joints_in_stance, self._gait.schedule, rough)
        return GaitSway(config.sway, Sway(masses, config.zmp, joints_in_stance), preview)

    def _level_stage(self, gait: Gait) -> LevelStage | None:
        if not self.config.leveling.enabled:
            return None
        stance = self._trunk.over_stance(np.zeros(6))
        joints = recorded_gait(gait, stance, self._targets.reach)
        return LevelStage(self._robot, self.config.leveling, joints)

    def _rotation_base_to_virtual(self, estimate: BodyState) -> FloatArray:
        """(3, 3) rotation from the base frame to b': estimated tilt, commanded yaw of the trunk."""
        roll, pitch, _ = estimate.rpy.tolist()
        return rotation_from_rpy(np.array([roll, pitch, self._trunk.yaw]))

    def _advance_mode(self, safety: SafetyRequest, upright: float) -> tuple[str, ...]:
        """Let the mode follow command, supervisor and tilt (`upright` is its cosine); says what changed."""
        before = self._modes
        tilt_deg = math.degrees(math.acos(min(1.0, upright)))
        # Nobody knows in which posture the robot was found: it stands up before it walks.
        found = self._wanted.mode is Mode.WALK and not self._targets.started
        self._modes = modes.advance(
            before,
            Mode.STAND if found else self._wanted.mode,
            safety,
            self._walking,
            tilt_deg,
            self.period,
            self.config.modes,
        )
        if self._modes.mode is before.mode:
            return ()
        return (f"mode {before.mode} -> {self._modes.mode} {self._modes.reason}".rstrip(),)

    def _require_reachable(self) -> None:
        result = self._targets.reach(self._trunk.over_stance(np.zeros(6)))
        if not result.feasible:
            raise ConfigurationError(f"the stance is out of reach: {'; '.join(result.describe())}")

    def _begun(self, notices: tuple[str, ...]) -> tuple[str, ...]:
        """Those notices that did not hold on the tick before."""
        new = tuple(notice for notice in notices if notice not in self._notices)
        self._notices = notices
        return new

    def _walks(self, estimate: BodyState) -> bool:
        """False where the robot must not walk: in other modes, or with a blind estimate."""
        wanted, state = self._wanted.mode, self._modes
        return wanted is Mode.WALK and state.mode is Mode.WALK and state.ending == 0.0 and estimate.healthy

    @staticmethod
    def _in_force(motion: MotionCommand, walks: bool) -> MotionCommand:
        """The command, without its motion where the robot must not walk."""
        if walks:
            return motion
        return MotionCommand(mode=motion.mode, gait=motion.gait, trunk=motion.trunk)

    def _corrected(self, motion: MotionCommand, estimate: BodyState, upright: FloatArray) -> tracking.Twist:
        """The commanded twist, corrected by odometry while walking."""
        wanted = tracking.Twist(velocity=motion.velocity, yaw_rate=motion.yaw_rate)
        if motion.yaw_rate == 0.0 and not any(motion.velocity.tolist()):
            self._tracking = tracking.rest(self._tracking)
            return wanted
        # The trunk sways over its feet: only what it was not told to do is an error.
        velocity = (upright @ estimate.linear_velocity)[:2] - self._trunk.velocity
        # The virtual robot's heading: the trunk's, less the yaw that it was told to have over the feet.
        heading = float(estimate.rpy[2]) - self._trunk.yaw
        self._tracking, twist = tracking.advance(
            self._tracking, wanted, velocity, heading, self.period, self.config.tracking
        )
        return twist

    def _footing(self, estimate: BodyState) -> Footing:
        """How the robot stands; the preview plans with the joints as they are planned themselves."""
        planned = self._trunk.plan is not None and self._targets.started
        return Footing(
            sit_level=self._modes.sit_level,
            joints=self._body.q[7:] if planned else estimate.joint_position,
            settled=self._targets.started,
        )

    def _on_the_ground(
        self, gait: GaitOutput, estimate: BodyState, upright: FloatArray, dt: float
    ) -> GaitOutput:
        """The gait with its feet on the ground's slope, or over the mean height of its footholds."""
        if self._guidance.ground is not None:
            return replace(gait, foot_position=gait.foot_position - (0.0, 0.0, self._placer.support.level))
        if not self.config.ground.enabled:
            return gait
        if estimate.healthy:
            standing = estimate.contact & ~gait.phase.swing
            feet = estimate.foot_position_in_base @ upright.T
            self._ground.step(feet, standing, dt, walking=gait.phase.walking)
        return replace(gait, foot_position=self._ground.place(gait.foot_position, gait.foot_height))

    def _leant(self, motion: MotionCommand) -> MotionCommand:
        """The command, with the trunk leant as the footholds ask for."""
        tilt = self._placer.support.tilt
        if not tilt.any():
            return motion
        return replace(motion, trunk=replace(motion.trunk, rpy=motion.trunk.rpy + np.append(tilt, 0.0)))

    def _planned(
        self, gait: GaitOutput, reference: PostureReference, joints: FloatArray, frame: SensorFrame
    ) -> WholeBodyPlan | None:
        """The whole-body plan behind the references; None where none is wanted."""
        self._body.step(gait, reference, joints, self.period)
        if self._planner is None or not self._targets.started:
            return None
        feet = self._gait.feet_ahead() if self.config.whole_body.swing_acceleration > 0.0 else None
        around = Surroundings(
            feet=feet, slope=self._ground.slope, voltage=self._voltage(frame),
            derating=servo_map.least_derating(frame.joint_temperature, self.config.servo),
            com=self._trunk.plan,
        )  # fmt: skip
        return self._planner.step(self._body, gait, around, self.period)

    def _goals(
        self, style: Style, joints: FloatArray, plan: WholeBodyPlan | None, frame: SensorFrame
    ) -> FloatArray:
        """(16,) rad, goals that run ahead of `joints` by what torque and speed take."""
        if plan is None or style.mixing == style.back_emf == 0.0:
            return joints
        servo = self._robot.parameters.servo
        feed = servo_map.Feed(
            torque=style.mixing * plan.torque, speed=style.back_emf * self._body.joint_speed
        )
        goals = servo_map.goals(servo, joints, feed, self._voltage(frame), self.config.servo)
        return self._within_limits(goals)

    def _leveled(
        self, goals: FloatArray, frame: SensorFrame, estimate: BodyState
    ) -> tuple[FloatArray, LevelReport | None, tuple[str, ...]]:
        """The goals with the levelling in them, its account, and its events."""
        if self._level is None:
            return goals, None, ()
        wish = LevelWish(
            tilt=self._trunk.tilt, heading=self._tracking.heading + self._trunk.yaw,
            walking=self._walking and self._targets.started, voltage=self._voltage(frame),
        )  # fmt: skip
        leveled, events = self._level.step(goals, frame, estimate, wish, self.period)
        return self._within_limits(leveled.goals), leveled.report, events

    def _within_limits(self, goals: FloatArray) -> FloatArray:
        geometry = self._robot.geometry
        return np.minimum(np.maximum(goals, geometry.physical_lower), geometry.physical_upper)

    def _crossing(self) -> CrossingReport | None:
        """What was decided on rough ground, footholds too."""
        report = self._guidance.crossing
        if report is None:
            return None
        return replace(report, footholds=self._placer.footholds.copy(), lift=self._placer.lift.copy())

    def _voltage(self, frame: SensorFrame) -> float:
        servo = self._robot.parameters.servo
        known = frame.voltage_valid and 0.5 * servo.nominal_voltage < frame.voltage < math.inf
        return frame.voltage if known else servo.nominal_voltage

    def _shift_after_push(self, estimate: BodyState, upright: FloatArray) -> FloatArray | None:
        """(2,) m in b', where footholds go after a hard push."""
        if not (self._walking and estimate.healthy):
            return None
        velocity = (upright @ estimate.linear_velocity)[:2]
        return self._recovery.step(velocity, self._told + self._trunk.velocity, estimate.height)

    def _gait_inputs(
        self, twist: tracking.Twist, motion: MotionCommand, estimate: BodyState, upright: FloatArray
    ) -> GaitInputs:
        error = (upright @ estimate.angular_velocity)[:2] - self._trunk.tilt_rate
        # Heights count from the feet that stand: soft servos let the trunk droop below its reference.
        trunk_x, trunk_y, _ = self._trunk.position.tolist()
        trunk = np.array([trunk_x, trunk_y, estimate.height])
        return GaitInputs(
            velocity=twist.velocity, yaw_rate=twist.yaw_rate, gait=motion.gait, contact=estimate.contact,
            foot_position=estimate.foot_position_in_base @ upright.T + trunk,
            trunk_position=trunk, foothold_shift=self._shift_after_push(estimate, upright),
            # No reflex on a rate that is no longer measured.
            tilt_rate_error=error if estimate.healthy else np.zeros(2),
            rough=self._guidance.ground is not None,
            # Steps without a plan, or blind over rough ground, are not taken: feet in the air land at once.
            halt=self._modes.mode is Mode.SAFE
            or self._step_back.request.level >= SafetyLevel.HOLD
            or (self._guidance.ground is not None and not estimate.healthy),
        )  # fmt: skip
