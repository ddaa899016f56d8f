"""Data that flows between the stages: small frozen records, arrays in SI units.

House order of legs is ``FL, FR, RL, RR``; joint vectors are leg-major, sixteen
long: ``hip_yaw, hip_pitch, knee, ankle`` of FL, then FR, RL, RR. Frames follow
REP-103 (x forward, y left, z up). Quaternions are ``x, y, z, w``.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

LEGS: tuple[str, ...] = ("FL", "FR", "RL", "RR")
LEG_JOINTS: tuple[str, ...] = ("hip_yaw", "hip_pitch", "knee", "ankle")
JOINTS: tuple[str, ...] = tuple(f"{leg}_{joint}" for leg in LEGS for joint in LEG_JOINTS)
N_LEGS = 4
N_JOINTS = 16


class Mode(enum.StrEnum):
    """What the robot is asked to do, or does."""

    OFF = "off"
    STAND = "stand"
    WALK = "walk"
    SIT = "sit"
    SAFE = "safe"


@dataclass(frozen=True, kw_only=True, slots=True)
class ImuBatch:
    """All inertial samples since the previous frame, oldest first (n may be 0).

    Attributes:
        time: (n,) s, clock of the robot.
        gyro: (n, 3) rad/s, angular velocity in the base frame.
        accel: (n, 3) m/s², specific force in the base frame (+g up at rest).
        magnetometer: (n, 3) field over its nominal strength, base frame; NaN
            rows where no new sample came (it is slower than the gyro).
        valid: (n,) False where a sample must not be used.
    """

    time: FloatArray
    gyro: FloatArray
    accel: FloatArray
    magnetometer: FloatArray
    valid: BoolArray


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarScan:
    """One sweep of the planar LIDAR.

    Attributes:
        time: s, end of the sweep.
        bearing: (n,) rad from forward, left positive.
        distance: (n,) m; NaN where no echo came back.
        valid: False where the scan must not be used.
    """

    time: float
    bearing: FloatArray
    distance: FloatArray
    valid: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class CameraImage:
    """One picture of the forward camera.

    Attributes:
        time: s, time of exposure.
        pixels: (height, width, 3) uint8, RGB.
        valid: False where the picture must not be used.
    """

    time: float
    pixels: NDArray[np.uint8]
    valid: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class SensorFrame:
    """Everything the real robot can measure, once per command period.

    Attributes:
        time: s, time of the frame; the only clock controllers know.
        joint_position: (16,) rad, quantised.
        joint_speed: (16,) rad/s as the servo reports it (noisy, delayed).
        joint_load: (16,) fraction of stall torque as the servo reports it.
        joint_temperature: (16,) °C.
        joint_time: (16,) s, when each position was read.
        joint_valid: (16,) False where no reply came.
        voltage: V at the servos, under load.
        voltage_valid: False where the voltage is unknown.
        imu: inertial samples since the previous frame.
        contact: (4,) foot switches, True = touches.
        contact_time: (4,) s, time of the switch samples.
        contact_valid: (4,) False where a switch is known to be broken.
        lidar: newest scan, when new.
        camera: newest picture, when new.
    """

    time: float
    joint_position: FloatArray
    joint_speed: FloatArray
    joint_load: FloatArray
    joint_temperature: FloatArray
    joint_time: FloatArray
    joint_valid: BoolArray
    voltage: float
    voltage_valid: bool
    imu: ImuBatch
    contact: BoolArray
    contact_time: FloatArray
    contact_valid: BoolArray
    lidar: LidarScan | None = None
    camera: CameraImage | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class JointCommand:
    """What the servos are told, once per command period.

    Attributes:
        position: (16,) rad, goal positions.
        speed: (16,) rad/s, moving speed limit; 0 = unlimited.
        torque_limit: (16,) fraction of stall torque, 0..1; 0 = limp.
    """

    position: FloatArray
    speed: FloatArray
    torque_limit: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class TrunkPose:
    """Offset of the trunk from its nominal pose over the feet.

    Attributes:
        position: (3,) m in the heading frame (x forward, y left, z up).
        rpy: (3,) rad: roll (right side down +), pitch (nose down +), yaw (left +).
    """

    position: FloatArray = field(default_factory=lambda: np.zeros(3))
    rpy: FloatArray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, kw_only=True, slots=True)
class MotionCommand:
    """What an operator, script or navigator wants from the controller.

    Attributes:
        mode: requested mode (``SAFE`` cannot be requested, only entered).
        velocity: (2,) m/s, forward and left, in the heading frame.
        yaw_rate: rad/s, left positive.
        gait: name of the gait, ``"trot"`` or ``"walk"``.
        trunk: wanted offset of the trunk.
    """

    mode: Mode = Mode.STAND
    velocity: FloatArray = field(default_factory=lambda: np.zeros(2))
    yaw_rate: float = 0.0
    gait: str = "trot"
    trunk: TrunkPose = field(default_factory=TrunkPose)


@dataclass(frozen=True, kw_only=True, slots=True)
class BodyState:
    """Estimated state of the robot (never the simulator's truth).

    Attributes:
        time: s.
        position: (3,) m, trunk origin in the odometry frame (starts at the
            robot's first stance: origin under the trunk, x along its heading).
        quaternion: (4,) x, y, z, w: rotation_base_to_world.
        rpy: (3,) rad, the same orientation as roll, pitch, yaw.
        linear_velocity: (3,) m/s of the trunk origin, in the base frame.
        angular_velocity: (3,) rad/s in the base frame, bias removed.
        joint_position: (16,) rad.
        joint_velocity: (16,) rad/s, estimated from positions.
        contact: (4,) True where the foot touches (switches, debounced).
        foot_position_in_base: (4, 3) m, by forward kinematics.
        height: m, trunk origin above the mean of the stance feet.
        healthy: False when the estimate must not be trusted (sensors lost).
    """

    time: float
    position: FloatArray
    quaternion: FloatArray
    rpy: FloatArray
    linear_velocity: FloatArray
    angular_velocity: FloatArray
    joint_position: FloatArray
    joint_velocity: FloatArray
    contact: BoolArray
    foot_position_in_base: FloatArray
    height: float
    healthy: bool = True


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitPhase:
    """Where the gait stands: which legs swing and how far.

    Attributes:
        swing: (4,) True where the leg is in swing (y2 > 0).
        y1: (4,) first oscillator states.
        y2: (4,) second oscillator states.
        phase: (4,) fraction of the cycle since lift-off, in [0, 1).
        walking: False when the network rests.
    """

    swing: BoolArray
    y1: FloatArray
    y2: FloatArray
    phase: FloatArray
    walking: bool


@dataclass(frozen=True, kw_only=True, slots=True)
class ContactSchedule:
    """Contacts ahead, as the gait will produce them.

    Attributes:
        time: (n,) s from now.
        stance: (n, 4) True where the foot is scheduled to stand.
        footholds: (n, 4, 3) m, planned foot positions in the b' frame.
    """

    time: FloatArray
    stance: BoolArray
    footholds: FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class PostureReference:
    """Wanted trunk pose and feet, both in the robot-relative frame b'.

    b' translates and turns with the commanded motion (the virtual robot) and
    never tilts with the trunk. Its origin lies on the ground.

    Attributes:
        trunk_position: (3,) m, trunk origin.
        trunk_rpy: (3,) rad, roll, pitch and yaw of the trunk.
        foot_position: (4, 3) m.
        swing: (4,) True where the leg swings.
    """

    trunk_position: FloatArray
    trunk_rpy: FloatArray
    foot_position: FloatArray
    swing: BoolArray


class SafetyLevel(enum.IntEnum):
    """How far the supervisor wants the robot to step back; higher is more urgent."""

    NONE = 0
    HOLD = 1
    SIT = 2
    STOP = 3


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyRequest:
    """What the supervisor asks of the controller on the next tick.

    Attributes:
        level: how far to step back.
        reasons: one sentence each, naming cause and evidence.
    """

    level: SafetyLevel = SafetyLevel.NONE
    reasons: tuple[str, ...] = ()


class Fallback(enum.IntEnum):
    """Which rung of the ladder a plan comes from; higher is further from the optimum."""

    SOLVED = 0
    NEAREST = 1
    SHIFTED = 2
    STANCE = 3
    SIT = 4


@dataclass(frozen=True, kw_only=True, slots=True)
class PlanReport:
    """What the model-based stages planned on one tick.

    Attributes:
        com: (3, 2) centre of mass in b': position (m), velocity (m/s),
            acceleration (m/s²), horizontal; NaN without a preview.
        margin: m, least distance of the planned ZMP to the edge of its support
            over the horizon, + inside; NaN without a preview.
        foot_force: (4, 3) N, planned ground forces, axes of b'; NaN without a
            whole-body plan.
        torque: (16,) N·m, planned joint torques; NaN without a whole-body plan.
        preview: where the centre-of-mass plan comes from.
        whole_body: where forces and torques come from.
        qp_failures: problems of this tick whose solver gave no usable answer.
        residual: N and N·m, largest error of the dynamics in the whole-body plan.
    """

    com: FloatArray
    margin: float
    foot_force: FloatArray
    torque: FloatArray
    preview: Fallback = Fallback.SOLVED
    whole_body: Fallback = Fallback.SOLVED
    qp_failures: int = 0
    residual: float = 0.0


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelReport:
    """What the trunk-levelling compensator did on one tick.

    Angular accelerations are those of the trunk that everything but the motors
    gives it: what the levelling torque has to make up for.

    Attributes:
        share: how far the compensator acts on the goals: 0 off, 1 fully on, between them it fades.
        training: True when the network learnt on this tick.
        stopped: why it has disengaged itself; empty while it has not.
        disturbance: (3,) rad/s², predicted for the coming period, base frame.
        measured: (3,) rad/s², the same from the period that just ended; NaN before the second tick.
        torque: (16,) N·m, levelling torque before mixing and limits.
        contact_force: (4, 3) N, estimated force of the ground on each foot, world axes.
        mse: low-passed squared error of the network, scaled units; NaN without a network.
        rate: learning rate of the network; NaN without one.
    """

    share: float
    training: bool
    stopped: str
    disturbance: FloatArray
    measured: FloatArray
    torque: FloatArray
    contact_force: FloatArray
    mse: float
    rate: float


@dataclass(frozen=True, kw_only=True, slots=True)
class Telemetry:
    """What the controller thought on one tick: for the log, the report and the live view.

    Attributes:
        time: s, time of the frame that the tick used.
        mode: mode the controller is in.
        motion: command in force after limits and ramps.
        estimate: state estimate.
        phase: gait phase.
        reference: wanted trunk and feet.
        zmp: (2,) m, ZMP that the placement law assumes, in b'; NaN without one.
        events: what a person should know of this tick (limits met, reflexes, faults).
        tick_us: µs from the frame's arrival to the command's departure.
        deadline_misses: ticks so far, this one included, that took longer than the command period.
        plan: what preview and whole-body stage planned; None without them.
        level: what the trunk-levelling compensator did; None without one.
    """

    time: float
    mode: Mode
    motion: MotionCommand
    estimate: BodyState
    phase: GaitPhase
    reference: PostureReference
    zmp: FloatArray
    events: tuple[str, ...] = ()
    tick_us: float = 0.0
    deadline_misses: int = 0
    plan: PlanReport | None = None
    level: LevelReport | None = None


@dataclass(frozen=True, kw_only=True, slots=True)
class TruthSample:
    """The simulator's truth at a frame: for reports only, never for a controller.

    Attributes:
        time: s.
        q: (23,) trunk position in world, quaternion xyzw, joints.
        v: (22,) trunk twist in the base frame (linear, angular), joints.
        com: (3,) m, centre of mass in world.
        momentum: (6,) linear kg·m/s and angular (about the centre of mass) kg·m²/s, world axes.
        foot_position: (4, 3) m, centres of the feet in world.
        foot_height: (4,) m, lowest point of each foot above the ground under it.
        foot_force: (4, 3) N, ground on foot, world axes.
        motor_torque: (16,) N·m at the output shaft (after back-EMF and friction).
        duty: (16,) fraction of supply voltage on the motor, -1..1.
        motor_temperature: (16,) °C.
        electrical_power: W drawn by the servos.
        voltage: V at the servos.
        touching: names of bodies other than feet that touch the world.
        external_force: (3,) N, push on the trunk's origin, world axes.
    """

    time: float
    q: FloatArray
    v: FloatArray
    com: FloatArray
    momentum: FloatArray
    foot_position: FloatArray
    foot_height: FloatArray
    foot_force: FloatArray
    motor_torque: FloatArray
    duty: FloatArray
    motor_temperature: FloatArray
    electrical_power: float
    voltage: float
    touching: tuple[str, ...]
    external_force: FloatArray
