"""What the compensator sees of the robot, and how the network's inputs and outputs are scaled."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.types import N_JOINTS, N_LEGS, BodyState, FloatArray, ImuBatch

OUTPUTS = 22
"""ψ: force and moment on the trunk, torques on the joints."""
INPUTS = 2 * OUTPUTS + 3 * N_LEGS
"""z1, z2 and f_ext."""

_POSITION, _ANGLE, _JOINT = 0.01, 0.05, 0.25  # m, rad, rad
_SPEED, _RATE, _JOINT_RATE = 0.1, 0.5, 1.5  # m/s, rad/s, rad/s
_FORCE = 5.0  # N

INPUT_SCALE: FloatArray = np.array(
    [_POSITION] * 3 + [_ANGLE] * 3 + [_JOINT] * N_JOINTS
    + [_SPEED] * 3 + [_RATE] * 3 + [_JOINT_RATE] * N_JOINTS + [_FORCE] * (3 * N_LEGS)
)  # fmt: skip
"""(56,) sizes that count as one: what these quantities reach in a trot."""
OUTPUT_SCALE: FloatArray = np.array([5.0] * 3 + [0.5] * 3 + [0.25] * N_JOINTS)
"""(22,) N, N·m, N·m: the same of ψ."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LevelingInputs:
    """What one tick of the compensator needs.

    Attributes:
        estimate: state estimate.
        turn_rate: (3,) rad/s, angular velocity of the trunk at the frame's time, base frame.
        tilt_reference: (2,) rad, commanded roll and pitch.
        heading_error: rad, estimated heading less the commanded one.
        goals: (16,) rad, joint goals of the gait or controller.
        joint_load: (16,) duty that the servos report, -1..1; NaN where no report came.
        specific_force: (3,) m/s², p̈_b - g, base frame; None where it was not measured.
        voltage: V at the servos, above zero.
        walking: True while the gait steps.
    """

    estimate: BodyState
    turn_rate: FloatArray
    tilt_reference: FloatArray
    heading_error: float
    goals: FloatArray
    joint_load: FloatArray
    specific_force: FloatArray | None
    voltage: float
    walking: bool


def newest_rate(imu: ImuBatch, mean: FloatArray) -> FloatArray:
    """(3,) rad/s, angular velocity at the end of a batch, base frame.

    The estimate is the mean over the frame, half a period old. That is too late
    here: of a trot's angular accelerations, differences of means from frame to
    frame miss four fifths, differences of last samples a quarter.

    Args:
        imu: the frame's samples.
        mean: (3,) rad/s, their mean without the bias, as estimated.
    """
    usable = imu.gyro[imu.valid]
    if not len(usable):
        return mean
    newest: FloatArray = usable[-1] - usable.sum(axis=0) / len(usable) + mean
    return newest if np.isfinite(newest).all() else mean


def velocity(inputs: LevelingInputs) -> FloatArray:
    """(22,) z2: trunk twist in the base frame, joint speeds; m/s, rad/s."""
    estimate = inputs.estimate
    return np.concatenate([estimate.linear_velocity, inputs.turn_rate, estimate.joint_velocity])


def network_inputs(
    inputs: LevelingInputs, rotation: FloatArray, neutral: FloatArray, speed: FloatArray, forces: FloatArray
) -> FloatArray:
    """(56,) u = (z1, z2, f_ext) with the trunk's place counted from the feet, so that it stays bounded.

    Args:
        inputs: the tick's inputs.
        rotation: (3, 3) rotation_base_to_world of the estimate.
        neutral: (19,) trunk over the feet (m) and joints (rad) at rest, which count as zero.
        speed: (22,) z2.
        forces: (4, 3) N, estimated ground forces, world axes.
    """
    estimate = inputs.estimate
    over_feet = -(rotation @ (estimate.foot_position_in_base.sum(axis=0) / N_LEGS))
    u = np.empty(INPUTS)
    u[0:3] = over_feet - neutral[:3]
    u[3:5] = estimate.rpy[:2]
    u[5] = inputs.heading_error
    u[6:22] = estimate.joint_position - neutral[3:]
    u[22:44] = speed
    u[44:] = forces.ravel()
    return u
