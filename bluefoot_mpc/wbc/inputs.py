"""What the whole-body controller is given on each tick, and what it answers."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.types import BoolArray, Fallback, FloatArray


@dataclass(frozen=True, kw_only=True, slots=True)
class WholeBodyInputs:
    """State and references; "world" is any inertial frame with z up in which q is given.

    References left out (None) mean rest: no velocity, no acceleration; a posture
    left out is the present one.

    Attributes:
        q: (nq,) configuration: base position (m), quaternion x, y, z, w, joints (rad).
        v: (nv,) base twist in the base frame (linear m/s, angular rad/s), joints (rad/s).
        contact: (k,) True where a foot stands and may push.
        com: (3,) m, wanted centre of mass, world.
        com_velocity: (3,) m/s, world.
        com_acceleration: (3,) m/s², world.
        trunk: (4,) wanted quaternion x, y, z, w of the trunk, base to world.
        trunk_velocity: (3,) rad/s, wanted angular velocity, world axes.
        trunk_acceleration: (3,) rad/s², world axes.
        foot: (k, 3) m, wanted positions of swing feet, world; rows of standing feet are not used, but finite.
        foot_velocity: (k, 3) m/s.
        foot_acceleration: (k, 3) m/s².
        posture: (nj,) rad, wanted joints.
        posture_velocity: (nj,) rad/s.
        posture_acceleration: (nj,) rad/s².
        remaining: (k,) s until a standing foot's scheduled lift-off; None: none is scheduled.
        ground: (3,) normal of the ground, world; None: upwards.
        voltage: V at the servos; None: nominal.
        derating: share of the torque that heat leaves, 0..1.
    """

    q: FloatArray
    v: FloatArray
    contact: BoolArray
    com: FloatArray
    trunk: FloatArray
    foot: FloatArray
    com_velocity: FloatArray | None = None
    com_acceleration: FloatArray | None = None
    trunk_velocity: FloatArray | None = None
    trunk_acceleration: FloatArray | None = None
    foot_velocity: FloatArray | None = None
    foot_acceleration: FloatArray | None = None
    posture: FloatArray | None = None
    posture_velocity: FloatArray | None = None
    posture_acceleration: FloatArray | None = None
    remaining: FloatArray | None = None
    ground: FloatArray | None = None
    voltage: float | None = None
    derating: float = 1.0


@dataclass(frozen=True, kw_only=True, slots=True)
class WholeBodyPlan:
    """Accelerations, ground forces and torques of one tick.

    Attributes:
        acceleration: (nv,) base (in its axes, linear m/s², angular rad/s²), joints (rad/s²).
        foot_force: (k, 3) N, ground on foot, world axes; zero without contact.
        torque: (nj,) N·m at the joints.
        com_acceleration: (3,) m/s², of the centre of mass, world.
        foot_acceleration: (k, 3) m/s², of the foot points, world; what a standing foot has left is its slack.
        status: rung of the ladder that the plan comes from.
        residual: N and N·m, error of the equations of motion; inf where the plan does not
            belong to this tick's state.
        iterations: of the solver; 0 where the optimum without limits kept them all.
        saturated: (nj,) True where the torque lies at its envelope.
        reason: why the plan is not the optimum, or what a person should know; "" when all is well.
    """

    acceleration: FloatArray
    foot_force: FloatArray
    torque: FloatArray
    com_acceleration: FloatArray
    foot_acceleration: FloatArray
    status: Fallback
    residual: float
    iterations: int
    saturated: BoolArray
    reason: str = ""
