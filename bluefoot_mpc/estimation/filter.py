"""Contact-aided invariant Kalman filter of attitude, velocity and feet.

After Bloesch et al. (contact-aided state of a legged robot: IMU for the
prediction, kinematics of the standing feet for the correction), with the
right-invariant error of Barrau and Bonnabel as Hartley et al. use it for
contacts. Two changes: the feet are kept relative to the IMU, so that the
unobservable position leaves the state, and a standing foot rolls on its ball.

Errors live in the world frame: with ``^`` for estimates and E = exp(xi),
``R^ = E R``, ``v^ = E v + rho_v``, ``s_i^ = E s_i + rho_i``, and biases as
differences. The foot measurement then reads ``R^ y_i - s_i^ = -rho_i + noise``,
whatever the attitude, and a foot set down anew is uncorrelated with the rest.
"""

from __future__ import annotations

import functools
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import EstimatorConfig, ImuConfig
from bluefoot_mpc.estimation.inertial import (
    Motion,
    Quaternion,
    Sample,
    Vector,
)
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import N_LEGS, FloatArray

IndexArray = np.ndarray[tuple[int], np.dtype[np.intp]]

ATTITUDE = np.arange(0, 3)
VELOCITY = np.arange(3, 6)
FEET = np.arange(6, 18)
GYRO_BIAS = np.arange(18, 21)
ACCEL_BIAS = np.arange(21, 24)
HARD_IRON = np.arange(24, 26)
SIZE = 26

_NO_ERROR = np.eye(SIZE)
# Linear map from a vector to the nine entries of its skew matrix.
_SKEW = np.zeros((3, 9))
_SKEW[0, 5], _SKEW[0, 7] = -1.0, 1.0
_SKEW[1, 2], _SKEW[1, 6] = 1.0, -1.0
_SKEW[2, 1], _SKEW[2, 3] = -1.0, 1.0
# Gravity's moment of an attitude error, (0, 0, -g) x xi, on velocity.
_TOPPLE = np.array(((0.0, GRAVITY, 0.0), (-GRAVITY, 0.0, 0.0), (0.0, 0.0, 0.0)))


class FilterState(NamedTuple):
    """Estimate and covariance.

    Attributes:
        quaternion: rotation_base_to_world, x, y, z, w.
        velocity: m/s of the IMU, world.
        feet: (4, 3) m, foot points relative to the IMU, world axes.
        gyro_bias: rad/s, base frame.
        accel_bias: m/s², base frame.
        hard_iron: of the field, constant part of the magnetometer in the base's x and y.
        covariance: (26, 26) of the errors: attitude, velocity, four feet, gyro
            bias, accelerometer bias, hard iron.
    """

    quaternion: Quaternion
    velocity: Vector
    feet: FloatArray
    gyro_bias: Vector
    accel_bias: Vector
    hard_iron: tuple[float, float]
    covariance: FloatArray


class Noise(NamedTuple):
    """Variances that one frame adds.

    Attributes:
        rate: rad²/s², of the frame's mean angular velocity.
        force: m²/s⁴, of its mean specific force along the trunk's x or y, and z.
    """

    rate: float
    force: tuple[float, float]


def frame_noise(samples: list[Sample], config: ImuConfig) -> Noise:
    """Variance of the means of a frame's samples, or of not knowing without any.

    The spread of the specific force within the frame counts as its noise:
    footfalls shake the trunk faster than the samples can follow, and what falls
    between them is missing from the mean.

    Args:
        samples: of the frame.
        config: noise figures.
    """
    n = len(samples)
    if n == 0:
        return Noise(config.lost_rate**2, (config.lost_accel**2, config.lost_accel**2))
    least = config.accel_noise**2
    x, y, z = (_spread([s.force[axis] for s in samples]) for axis in range(3))
    shake = config.shake / n
    return Noise(config.gyro_noise**2 / n, (least / n + shake * 0.5 * (x + y), least / n + shake * z))


def _spread(values: list[float]) -> float:
    """Mean square deviation from the mean."""
    mean = sum(values) / len(values)
    return sum([(value - mean) ** 2 for value in values]) / len(values)


def initial_state(quaternion: Quaternion, tilt: float, config: EstimatorConfig) -> FilterState:
    """State at the first frame: at rest, yaw zero by definition, feet not yet known.

    Args:
        quaternion: rotation_base_to_world with zero yaw.
        tilt: rad, deviation of its roll and pitch.
        config: deviations of the rest.
    """
    deviation = np.empty(SIZE)
    deviation[ATTITUDE] = (tilt, tilt, 1e-3)
    deviation[VELOCITY] = config.initial_speed
    deviation[FEET] = 1.0
    deviation[GYRO_BIAS] = config.imu.gyro_bias
    deviation[ACCEL_BIAS] = config.imu.accel_bias
    deviation[HARD_IRON] = config.heading.hard_iron
    zero = (0.0, 0.0, 0.0)
    return FilterState(quaternion, zero, np.zeros((N_LEGS, 3)), zero, zero, (0.0, 0.0), np.diag(deviation**2))


def transition(
    rotation: FloatArray, velocity: FloatArray, feet: FloatArray, dt: float
) -> tuple[FloatArray, FloatArray]:
    """Linear propagation of the error over one frame.

    Args:
        rotation: (3, 3) rotation_base_to_world; anywhere in the frame will do.
        velocity: (3,) m/s, world, mean over the frame.
        feet: (4, 3) m, relative to the IMU, world axes.
        dt: s.

    Returns:
        (26, 26) transition of the error, and (18, 3) lever of an angular rate
        error in world axes on attitude, velocity and feet.
    """
    levers = np.empty((6, 3, 3))
    levers[0] = _NO_ERROR[:3, :3]
    levers[1:] = (np.concatenate((velocity[None], feet)) @ _SKEW).reshape(5, 3, 3)
    lever = levers.reshape(18, 3)
    step = _NO_ERROR.copy()
    topple = dt * _TOPPLE
    half = -0.5 * dt * topple
    step[3:6, 0:3] = topple
    step[:18, 18:21] = (-dt) * lever @ rotation
    step[3:6, 18:21] += half @ rotation
    step[3:6, 21:24] = (-dt) * rotation
    fall = (0.5 * dt * dt) * rotation
    feet_rows = step[6:18].reshape(N_LEGS, 3, SIZE)
    feet_rows[:, :, 0:3] = half
    feet_rows[:, :, 21:24] = fall
    step[_FEET_DIAGONAL, _VELOCITY_DIAGONAL] = -dt
    return step, lever


_FEET_DIAGONAL = FEET
_VELOCITY_DIAGONAL = np.tile(VELOCITY, N_LEGS)


def predict(
    state: FilterState, motion: Motion, roll: FloatArray, noise: Noise, *, rotation: FloatArray,
    dt: float, config: EstimatorConfig,
) -> FilterState:  # fmt: skip
    """Carry estimate and covariance over one frame.

    Args:
        state: at the start.
        motion: mean motion of the IMU, from `inertial.integrate`.
        roll: (4, 3) m, way of the foot points over the ground by rolling, world axes.
        noise: of the frame's inertial samples.
        rotation: (3, 3) rotation_base_to_world at the end.
        dt: s.
        config: drifts and slip.
    """
    velocity = 0.5 * (np.array(state.velocity) + motion.velocity)
    feet = state.feet + roll - np.array(motion.displacement)
    step, lever = transition(rotation, velocity, state.feet, dt)
    covariance = step @ state.covariance @ step.T
    covariance[:18, :18] += (noise.rate * dt * dt) * (lever @ lever.T)
    diagonal = covariance.reshape(-1)[:: SIZE + 1]
    diagonal += dt * _drift(config)
    horizontal, vertical = noise.force
    diagonal[3:5] += horizontal * dt * dt
    diagonal[5] += vertical * dt * dt
    return state._replace(
        quaternion=motion.quaternion, velocity=motion.velocity, feet=feet, covariance=covariance
    )


@functools.lru_cache(maxsize=8)
def _drift(config: EstimatorConfig) -> FloatArray:
    """(26,) variances per second that slip and drifts add; do not write to it."""
    diagonal = np.zeros(SIZE)
    diagonal[FEET] = config.contact.slip**2
    diagonal[GYRO_BIAS] = config.imu.gyro_drift**2
    diagonal[ACCEL_BIAS] = config.imu.accel_drift**2
    return diagonal
