"""What the controller tells of its ticks."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from bluefoot_mpc.types.command import Mode, MotionCommand
from bluefoot_mpc.types.common import FloatArray
from bluefoot_mpc.types.state import BodyState, GaitPhase, PostureReference
from bluefoot_mpc.types.terrain import CrossingReport


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


class Guided(enum.StrEnum):
    """What leads the robot on its own way."""

    FIELD = "field"
    MARKER = "marker"
    WAYPOINT = "waypoint"
    SEARCH = "search"
    ESCAPE = "escape"
    ARRIVED = "arrived"
    BLIND = "blind"


@dataclass(frozen=True, kw_only=True, slots=True)
class NavigationReport:
    """What navigation saw and decided, as of its newest scan and picture.

    Attributes:
        guided: what leads: the potential field, the marker, a waypoint, the search for a marker, the way
            out of a corner; or the goal is reached, or there is nothing to go by and the robot stands.
        velocity: (2,) m/s, decided, forward and left.
        yaw_rate: rad/s, decided, left positive.
        pitch: rad, decided pitch of the trunk, nose down positive.
        field: (2,) sum of the potential field's forces, robot frame, forward and left.
        potential: m/s, the field's speed potential.
        mixing: share of the camera in the command, 0..1.
        marker: (3,) pixels: column, row and radius of the marker in the newest picture; NaN where unseen.
        marker_position: (3,) m, marker's centre in the odometry frame, as last seen; NaN before.
        marker_age: s since the marker was last seen; infinite before.
        clearance: m, from the robot's outline to the nearest point that it knows of; infinite in the open.
        waypoints_left: waypoints still to be reached.
        scan_time: s, of the newest usable scan; NaN before the first.
        reason: why, in few words, where that is not plain.
    """

    guided: Guided
    velocity: FloatArray
    yaw_rate: float
    pitch: float
    field: FloatArray
    potential: float
    mixing: float
    marker: FloatArray
    marker_position: FloatArray
    marker_age: float
    clearance: float
    waypoints_left: int = 0
    scan_time: float = float("nan")
    reason: str = ""


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
        navigation: how the robot finds its way; None while it is told where to go.
        crossing: what it knows of rough ground and decides there; None but for those tasks.
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
    navigation: NavigationReport | None = None
    crossing: CrossingReport | None = None
