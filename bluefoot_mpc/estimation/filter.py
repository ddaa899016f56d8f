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

from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from bluefoot_mpc.estimation.config import EstimatorConfig, ImuConfig
from bluefoot_mpc.estimation.inertial import Quaternion, Vector
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
"""Components of the error."""
VALUES = 27
"""Values of the estimate: one more, for the quaternion."""


class FilterState(NamedTuple):
    """Estimate and covariance.

    Attributes:
        estimate: (27,) see the properties.
        covariance: (26, 26) of the errors: attitude, velocity, four feet, gyro
            bias, accelerometer bias, hard iron.
    """

    estimate: FloatArray
    covariance: FloatArray

    @property
    def quaternion(self) -> Quaternion:
        """rotation_base_to_world, x, y, z, w."""
        x, y, z, w = self.estimate[0:4].tolist()
        return (x, y, z, w)

    @property
    def velocity(self) -> Vector:
        """m/s of the IMU, world."""
        x, y, z = self.estimate[4:7].tolist()
        return (x, y, z)

    @property
    def feet(self) -> FloatArray:
        """(4, 3) m, foot points relative to the IMU, world axes."""
        return self.estimate[7:19].reshape(N_LEGS, 3)

    @property
    def gyro_bias(self) -> Vector:
        """rad/s, base frame."""
        x, y, z = self.estimate[19:22].tolist()
        return (x, y, z)

    @property
    def accel_bias(self) -> Vector:
        """m/s², base frame."""
        x, y, z = self.estimate[22:25].tolist()
        return (x, y, z)

    @property
    def hard_iron(self) -> tuple[float, float]:
        """Of the field, constant part of the magnetometer in the base's x and y."""
        x, y = self.estimate[25:27].tolist()
        return (x, y)


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
    estimate = np.zeros(VALUES)
    estimate[0:4] = quaternion
    return FilterState(estimate, np.diag(deviation**2))


def frame_noise(sums: Any, config: ImuConfig) -> tuple[Any, Any]:
    """Variances of the means of a frame's samples, or of not knowing without any.

    The spread of the specific force within the frame counts as its noise:
    footfalls shake the trunk faster than the samples can follow, and what falls
    between them is missing from the mean.

    Args:
        sums: 10 values, last part of what `inertial.Strapdown` carries.
        config: noise figures.

    Returns:
        rad²/s² of the mean angular velocity, and (m/s²)² of the mean force on each axis.
    """
    any_sample = sums[0] > 0.0
    n = ca.if_else(any_sample, sums[0], 1.0)
    mean = sums[4:7] / n
    spread = ca.fmax(0.0, sums[7:10] / n - mean * mean)
    # How the shaking lies about the vertical is not known.
    level = 0.5 * (spread[0] + spread[1])
    force = config.accel_noise**2 / n + config.shake / n * ca.vertcat(level, level, spread[2])
    rate = ca.if_else(any_sample, config.gyro_noise**2 / n, config.lost_rate**2)
    return rate, ca.if_else(any_sample, force, config.lost_accel**2)


def transition(rotation: Any, velocity: Any, feet: Any, dt: Any) -> tuple[Any, Any]:
    """Linear propagation of the error over one frame, as CasADi expressions.

    Args:
        rotation: 3 x 3 rotation_base_to_world; anywhere in the frame will do.
        velocity: 3 m/s, world, mean over the frame.
        feet: 12 m, relative to the IMU, world axes.
        dt: s.

    Returns:
        26 x 26 transition of the error, and 18 x 3 lever of an angular rate
        error in world axes on attitude, velocity and feet.
    """
    points = [velocity, *(feet[3 * leg : 3 * leg + 3] for leg in range(N_LEGS))]
    lever = ca.vertcat(ca.SX.eye(3), *(ca.skew(point) for point in points))
    # Gravity's moment of an attitude error, (0, 0, -g) x xi, on velocity.
    topple = dt * ca.skew(ca.DM([0.0, 0.0, -GRAVITY]))
    half = -0.5 * dt * topple
    step = ca.SX.eye(SIZE)
    step[3:6, 0:3] = topple
    step[:18, 18:21] = -dt * (lever @ rotation)
    step[3:6, 18:21] += half @ rotation
    step[3:6, 21:24] = -dt * rotation
    for row in range(6, 18, 3):
        step[row : row + 3, 0:3] = half
        step[row : row + 3, 3:6] = -dt * ca.SX.eye(3)
        step[row : row + 3, 21:24] = (0.5 * dt * dt) * rotation
    return step, lever
