"""Sensors of a balancing robot, and the Kalman filter that joins them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.wheels.balance_config import BalanceConfig
from bluefoot_mpc.wheels.pendulum import GRAVITY
from bluefoot_mpc.wheels.regulator import KalmanFilter, LinearModel, discretised

_TORQUE_NOISE = 0.05  # N·m, what the filter allows for all that its linear model leaves out
_BIAS_DRIFT = 1e-4  # rad/s in a second, of the gyro


class Reading(NamedTuple):
    """One sample of all sensors.

    Attributes:
        encoders: (2,) rad, left and right wheel against the body.
        gyro: rad/s, tilt rate.
        accelerometer: m/s², forward axis of the body.
        yaw_rate: rad/s.
    """

    encoders: FloatArray
    gyro: float
    accelerometer: float
    yaw_rate: float


class Imu:
    """The sensors with their errors; encoders belong to it."""

    def __init__(self, config: BalanceConfig, rng: np.random.Generator) -> None:
        sensors = config.sensors
        self._config = config
        self._rng = rng
        self._gyro_bias, self._yaw_bias = rng.uniform(-sensors.gyro_bias, sensors.gyro_bias, 2).tolist()
        self._accelerometer_bias = float(rng.uniform(-1.0, 1.0)) * sensors.accelerometer_bias

    def read(self, body_state: FloatArray, yaw_rate: float, wheels: FloatArray, torque: float) -> Reading:
        """Sample everything.

        Args:
            body_state: (4,) truth: m, m/s, rad, rad/s.
            yaw_rate: rad/s.
            wheels: (2,) rad, turned against the body.
            torque: N·m, of both motors, that acts.
        """
        sensors = self._config.sensors
        _, speed, tilt, rate = body_state.tolist()
        push, turn = self._config.body.accelerations(speed, tilt, rate, torque)
        force = push * math.cos(tilt) + sensors.accelerometer_height * turn - GRAVITY * math.sin(tilt)
        noise = self._rng.standard_normal(3)
        step = 2.0 * math.pi / sensors.encoder_steps
        return Reading(
            encoders=step * np.round(wheels / step),
            gyro=rate + self._gyro_bias + sensors.gyro_noise * float(noise[0]),
            accelerometer=force + self._accelerometer_bias + sensors.accelerometer_noise * float(noise[1]),
            yaw_rate=yaw_rate + self._yaw_bias + sensors.gyro_noise * float(noise[2]),
        )


class BalanceFilter:
    """Kalman filter of axle's path and speed, tilt, tilt rate and the gyro's bias."""

    def __init__(self, config: BalanceConfig) -> None:
        self._filter = KalmanFilter(filter_model(config), np.zeros(5), _start_covariance(config))

    @property
    def state(self) -> FloatArray:
        """(5,) m, m/s, rad, rad/s, rad/s."""
        return self._filter.state

    @property
    def covariance(self) -> FloatArray:
        """(5, 5) of the estimate's error."""
        return self._filter.covariance

    def step(self, reading: Reading, torque: float) -> FloatArray:
        """One period on, in which `torque` (N·m) acted, then a reading; gives the (5,) estimate."""
        control = np.array([torque])
        self._filter.predict(control)
        measured = np.array([float(reading.encoders.mean()), reading.gyro, reading.accelerometer])
        self._filter.correct(measured, control)
        return self._filter.state


def filter_model(config: BalanceConfig) -> LinearModel:
    """The linear model of body and sensors, with the gyro's bias as a fifth state.

    Encoders see the wheels' turn less the tilt, the gyro the tilt rate and its bias, the
    accelerometer the acceleration of its place less gravity's share g tilt.
    """
    sensors, body = config.sensors, config.body
    a, b = body.linear()
    transition, control = np.eye(5), np.zeros((5, 1))
    transition[:4, :4], control[:4] = discretised(a, b, config.period)
    measurement, direct = np.zeros((3, 5)), np.zeros((3, 1))
    measurement[0, [0, 2]] = 1.0 / body.wheel_radius, -1.0
    measurement[1, [3, 4]] = 1.0
    measurement[2, :4] = a[1] + sensors.accelerometer_height * a[3]
    measurement[2, 2] -= GRAVITY
    direct[2] = b[1] + sensors.accelerometer_height * b[3]
    process = _TORQUE_NOISE**2 * control @ control.T + 1e-12 * np.eye(5)
    process[4, 4] += _BIAS_DRIFT**2 * config.period
    step = 2.0 * math.pi / sensors.encoder_steps
    # A bias of the accelerometer cannot be told from tilt: it counts as noise.
    spread = sensors.accelerometer_noise + sensors.accelerometer_bias
    noise = np.diag([step**2 / 12.0, sensors.gyro_noise**2 + 1e-8, spread**2 + 1e-6])
    return LinearModel(
        transition=transition, control=control, measurement=measurement, direct=direct,
        process_noise=process, sensor_noise=noise,
    )  # fmt: skip


def _start_covariance(config: BalanceConfig) -> FloatArray:
    """(5, 5): it starts nearly upright, with a gyro not yet known."""
    return np.diag([1e-6, 1e-6, 0.02**2, 0.01, config.sensors.gyro_bias**2 + 1e-8])
