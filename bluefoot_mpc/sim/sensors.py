"""Sensors of the simulated robot: what the truth looks like to the robot.

Every sensor draws from a stream of its own, so that changing one leaves the
others' errors as they were. Error sizes are assumptions: see `SensorConfig`.
"""

from __future__ import annotations

import functools
import math
from collections import deque
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import SPEED_UNIT
from bluefoot_mpc.sim.config import SensorConfig
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray, ImuBatch

_MINUTE = 60.0
_BITS = np.array([1, 2, 4, 8])
_SWITCHES = (np.arange(16)[:, None] & _BITS) != 0
"""(16, 4) states of four switches by number, shared and read-only."""
_SWITCHES.flags.writeable = False


@functools.cache
def all_valid(count: int) -> BoolArray:
    """(count,) True, shared and read-only."""
    valid = np.ones(count, dtype=np.bool_)
    valid.flags.writeable = False
    return valid


class Imu:
    """Gyro, accelerometer and magnetometer with white noise, bias and drift."""

    def __init__(self, config: SensorConfig, seed: int) -> None:
        self._config, self._seed = config, seed
        self.reset()

    def reset(self) -> None:
        """Draw this run's biases."""
        config, seed = self._config, self._seed
        self._gyro, self._accel = stream(seed, "gyro"), stream(seed, "accelerometer")
        self._magnetometer = stream(seed, "magnetometer")
        self.gyro_bias: FloatArray = self._gyro.uniform(-1.0, 1.0, 3) * config.gyro_bias
        self.accel_bias: FloatArray = self._accel.uniform(-1.0, 1.0, 3) * config.accel_bias
        self.magnetometer_bias: FloatArray = (
            self._magnetometer.uniform(-1.0, 1.0, 3) * config.magnetometer_bias
        )
        self._samples = 0

    def measure(self, time: FloatArray, inertial: FloatArray, field: FloatArray) -> ImuBatch:
        """Samples of one frame.

        Args:
            time: (n,) s.
            inertial: (n, 6) true angular velocity (rad/s) and specific force
                (m/s²) at the sensor, base frame.
            field: (n, 3) true magnetic field over its strength, base frame.
        """
        config, count = self._config, len(time)
        noise = self._gyro.standard_normal((count + 1, 3))
        gyro = config.gyro_noise * noise[:count]
        gyro += self.gyro_bias
        gyro += inertial[:, 0:3]
        span = count * config.imu_period
        self.gyro_bias = self.gyro_bias + (config.gyro_drift * math.sqrt(span / _MINUTE)) * noise[count]
        accel = self._accel.standard_normal((count, 3))
        accel *= config.accel_noise
        accel += self.accel_bias
        accel += inertial[:, 3:6]
        batch = ImuBatch(
            time=time, gyro=gyro, accel=accel, magnetometer=self._field(field), valid=all_valid(count)
        )
        self._samples += count
        return batch

    def _field(self, truth: FloatArray) -> FloatArray:
        """The rows where the slower magnetometer has a sample; NaN between them."""
        config, count = self._config, len(truth)
        field = np.empty((count, 3))
        field.fill(math.nan)
        for row in range(-self._samples % config.magnetometer_divider, count, config.magnetometer_divider):
            noise = self._magnetometer.standard_normal(3)
            noise *= config.magnetometer_noise
            field[row] = truth[row] + self.magnetometer_bias + noise
        return field


class FootSwitches:
    """Four switches that close above a force, arrive late, and now and then chatter."""

    def __init__(self, config: SensorConfig, seed: int) -> None:
        self._config, self._seed = config, seed
        self.reset()

    def reset(self) -> None:
        """All open, no history."""
        self._rng = stream(self._seed, "switches")
        self._closed = 0
        self._chatter: tuple[float, int, int] | None = None
        self._history: deque[tuple[float, int]] = deque([(-math.inf, 0)])

    def measure(self, time: list[float], force: FloatArray, now: float) -> tuple[BoolArray, float]:
        """Switch states as they arrive at `now`.

        Args:
            time: n sampling times since the last frame, s, rising.
            force: (n, 4) N, force on each foot at those times.
            now: s, time of the frame.

        Returns:
            (4,) states, and the time (s) at which they were sampled.
        """
        closed = np.packbits(force > self._config.switch_threshold, axis=1, bitorder="little")
        for when, state in zip(time, closed[:, 0].tolist(), strict=True):
            self._sample(when, state)
        limit = now - self._config.switch_delay + 1e-9
        history = self._history
        while len(history) > 1 and history[1][0] <= limit:
            history.popleft()
        when, state = history[0]
        return _SWITCHES[state], when

    def _sample(self, when: float, state: int) -> None:
        if state != self._closed:
            edges, before = state ^ self._closed, self._closed
            self._closed = state
            falling_back = edges & int((self._rng.random(N_LEGS) < self._config.switch_chatter) @ _BITS)
            if falling_back:
                # The edge itself is seen; the samples after it are the old state for a while.
                self._chatter = (when + self._config.switch_chatter_time, falling_back, before)
        elif self._chatter is not None:
            until, feet, before = self._chatter
            if when <= until:
                state = (state & ~feet) | (before & feet)
            else:
                self._chatter = None
        self._history.append((when, state))


class ServoSensors:
    """What servos report: quantised positions, noisy speeds, coarse loads."""

    def __init__(self, config: SensorConfig, servo: ServoParameters, seed: int) -> None:
        self._config, self._seed = config, seed
        # Position now and before, duty; noise of speed and load; seconds between the positions.
        self._truth, self._noise, self._period = np.zeros((3, N_JOINTS)), np.zeros((2, N_JOINTS)), np.zeros(1)
        self._reports = np.zeros((3, N_JOINTS))
        buffer: Any
        buffer, self._run = report_function(config, servo).buffer()
        for index, array in enumerate((self._truth, self._noise, self._period)):
            buffer.set_arg(index, array.data)
        buffer.set_res(0, self._reports.data)
        self._buffer = buffer
        self.reset()

    def reset(self) -> None:
        """Restart the noise; the last position is unknown."""
        self._rng = stream(self._seed, "servo reports")
        self._is_warm = False

    def measure(
        self, position: FloatArray, duty: FloatArray, period: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Reports of one frame.

        Args:
            position: (16,) rad, true joint angles now.
            duty: (16,) duty now: all that the servo knows of its load.
            period: s since the last frame.

        Returns:
            (16,) positions in rad, (16,) speeds in rad/s, (16,) loads as
            fractions of stall torque. A speed is the mean since the last frame,
            so half a period old.
        """
        truth = self._truth
        truth[1] = truth[0] if self._is_warm else position
        truth[0], truth[2] = position, duty
        self._is_warm = True
        self._period[0] = period
        self._rng.standard_normal(out=self._noise)
        self._run()
        angle, speed, load = self._reports.copy()
        return angle, speed, load


def report_function(config: SensorConfig, servo: ServoParameters) -> ca.Function:
    """Reports of all servos, (16, 3), from true positions now and before with duties (16, 3), noise and time.

    The numbers of a frame in one call: 1 µs, where numpy takes ten.
    """
    truth, noise, period = ca.SX.sym("truth", N_JOINTS, 3), ca.SX.sym("noise", N_JOINTS, 2), ca.SX.sym("dt")
    speed = (truth[:, 0] - truth[:, 1]) / period + config.speed_noise * noise[:, 0]
    load = truth[:, 2] + config.load_noise * noise[:, 1]
    rounded = [
        _rounded(value, unit)
        for value, unit in ((truth[:, 0], servo.step_angle), (speed, SPEED_UNIT), (load, config.load_step))
    ]
    return ca.Function("reports", [truth, noise, period], [ca.horzcat(*rounded)])


def _rounded(value: ca.SX, unit: float) -> ca.SX:
    return ca.floor(value / unit + 0.5) * unit
