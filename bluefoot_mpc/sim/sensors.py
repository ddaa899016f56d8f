"""Sensors of the simulated robot: what the truth looks like to the robot.

Every sensor draws from a stream of its own, so that changing one leaves the
others' errors as they were. Error sizes are assumptions: see `SensorConfig`.

The numbers of a frame are one CasADi function that reads the simulator's
memory where it lies, and one copy of its results: 5 µs, where a few dozen calls
of numpy take 50, and several times that when the controller has just had the
processor's caches.
"""

from __future__ import annotations

import functools
import itertools
import math
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from bluefoot_mpc.codegen import compiled, made_once
from bluefoot_mpc.model.parameters import ServoParameters
from bluefoot_mpc.model.servo import SPEED_UNIT
from bluefoot_mpc.sim.config import SensorConfig
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.sim.switches import BITS, FootSwitches
from bluefoot_mpc.types import N_JOINTS, N_LEGS, BoolArray, FloatArray, ImuBatch, SensorFrame

SAMPLE = 3 + 4 * N_LEGS
"""Numbers of a sample: magnetometer (3), then of each foot the number of contacts and their force (3)."""

_MINUTE = 60.0
_NOISE_ROWS = 32
"""Frames whose noise is drawn at once."""


@functools.cache
def all_valid(count: int) -> BoolArray:
    """(count,) True, shared and read-only."""
    valid = np.ones(count, dtype=np.bool_)
    valid.flags.writeable = False
    return valid


@dataclass(frozen=True, kw_only=True, slots=True)
class Probe:
    """Views into memory that the sensors read, and the rates of the robot.

    Attributes:
        means: (n, 6) angular velocity (rad/s) and specific force (m/s²) over the
            inertial windows of a frame, base frame; n is the most of a frame.
        samples: (n, 19) field over its strength (base frame), contacts and force
            (N) of each foot, at the ends of the windows.
        position: (16,) rad, joint angles now.
        duty: (16,) duty now: all that a servo knows of its load.
        temperature: (16,) °C.
        physics_period: s.
        frame_steps: physics steps between two frames.
        window_steps: physics steps of an inertial window.
    """

    means: FloatArray
    samples: FloatArray
    position: FloatArray
    duty: FloatArray
    temperature: FloatArray
    physics_period: float
    frame_steps: int
    window_steps: int


class Sensors:
    """IMU, foot switches and servo reports.

    Attributes:
        bias: (9,) of gyro (rad/s), accelerometer (m/s²) and magnetometer (of the
            field) in this run.
    """

    def __init__(self, config: SensorConfig, servo: ServoParameters, probe: Probe, seed: int) -> None:
        self._config, self._probe, self._seed = config, probe, seed
        self._switches = FootSwitches(config, seed)
        self._rows = len(probe.means)
        self.bias = np.zeros(9)
        # Step of the frame, step of its first sample, size of the gyro's drift in the frame.
        self._clock = np.zeros(3)
        self._before = np.zeros(N_JOINTS)
        self._field = np.zeros((self._rows, 3))
        rates = (len(probe.means), probe.physics_period, probe.frame_steps, probe.window_steps)
        function: Any = made_once(
            lambda: compiled(sensor_function(config, servo, probe)), "sensors", config, servo, rates
        )
        self._noise = np.zeros(function.size1_in(3))
        self._reports = function.size1_out(0)
        ends = [2 * self._rows + k * N_JOINTS for k in range(6)]
        self._parts = [slice(start, end) for start, end in itertools.pairwise([*ends, self._reports])]
        # What follows the function's results: times of the switches, and a field without samples.
        self._out = np.full(self._reports + N_LEGS + self._field.size, math.nan)
        self._drift = [
            config.gyro_drift * math.sqrt(count * config.imu_period / _MINUTE)
            for count in range(self._rows + 1)
        ]
        self._buffer, self._run = self._connect(function)
        self.reset()

    def reset(self) -> None:
        """Draw this run's biases, restart the noise, open the switches; a speed needs a position before."""
        config, seed = self._config, self._seed
        self._gyro, self._accel = stream(seed, "gyro"), stream(seed, "accelerometer")
        self._magnetometer, self._servos = stream(seed, "magnetometer"), stream(seed, "servo reports")
        self.bias[0:3] = self._gyro.uniform(-1.0, 1.0, 3) * config.gyro_bias
        self.bias[3:6] = self._accel.uniform(-1.0, 1.0, 3) * config.accel_bias
        self.bias[6:9] = self._magnetometer.uniform(-1.0, 1.0, 3) * config.magnetometer_bias
        self._ahead: list[FloatArray] = []
        self._samples = 0
        self._is_warm = False
        self._switches.reset()

    def measure(self, step: int, first: int, count: int, voltage: float) -> SensorFrame:
        """The frame at a physics step.

        Positions, speeds and loads are quantised; a speed is the mean since the
        last frame, so half a period old. The slower magnetometer has samples in
        some rows only.

        Args:
            step: number of the physics step.
            first: number of the physics step at which the first sample was taken.
            count: samples since the last frame.
            voltage: V, mean at the servos.
        """
        self._noise[:] = self._ahead.pop() if self._ahead else self._draw()
        if not self._is_warm:
            self._before[:] = self._probe.position
            self._is_warm = True
        self._clock[:] = (step, first, self._drift[count])
        self._run()
        self._before[:] = self._probe.position
        rows, end, out = self._rows, self._reports, self._out.copy()
        time = out[:rows]
        now = step * self._probe.physics_period
        contact, contact_time = self._switches.measure(
            time[:count].tolist(), out[rows : rows + count].tolist(), now
        )
        position, speed, load, temperature, joint_time, inertial = [out[part] for part in self._parts]
        switch_time = out[end : end + N_LEGS]
        switch_time.fill(contact_time)
        field = out[end + N_LEGS :].reshape(rows, 3)
        divider = self._config.magnetometer_divider
        due = -self._samples % divider
        field[due:count:divider] = self._field[due:count:divider]
        self._samples += count
        imu = ImuBatch(
            time=time[:count],
            gyro=inertial[: 3 * count].reshape(count, 3),
            accel=inertial[3 * rows : 3 * (rows + count)].reshape(count, 3),
            magnetometer=field[:count],
            valid=all_valid(count),
        )
        return SensorFrame(
            time=now,
            joint_position=position,
            joint_speed=speed,
            joint_load=load,
            joint_temperature=temperature,
            joint_time=joint_time,
            joint_valid=all_valid(N_JOINTS),
            voltage=round(voltage, 1),
            voltage_valid=True,
            imu=imu,
            contact=contact,
            contact_time=switch_time,
            contact_valid=all_valid(N_LEGS),
        )

    def _draw(self) -> FloatArray:
        """Draw the noise of the coming frames; gives that of the next."""
        rows, sampled = self._rows, -(-self._rows // self._config.magnetometer_divider)
        sources = (
            (self._gyro, 3 * (rows + 1)),
            (self._accel, 3 * rows),
            (self._magnetometer, 3 * sampled),
            (self._servos, 2 * N_JOINTS),
        )
        block = np.hstack([source.standard_normal((_NOISE_ROWS, count)) for source, count in sources])
        self._ahead = list(block[::-1])
        return self._ahead.pop()

    def _connect(self, function: ca.Function) -> tuple[Any, Any]:
        buffer: Any
        buffer, run = function.buffer()
        probe = self._probe
        inputs = (self._clock, probe.means, probe.samples, self._noise, self.bias)
        for index, array in enumerate((*inputs, probe.position, self._before, probe.duty, probe.temperature)):
            buffer.set_arg(index, array.data)
        # A bias is read before it is written, so it may be updated in place.
        for index, array in enumerate((self._out[: self._reports], self._field, self.bias[:3])):
            buffer.set_res(index, array.data)
        return buffer, run


def sensor_function(config: SensorConfig, servo: ServoParameters, probe: Probe) -> ca.Function:
    """The numbers of one frame from truth and noise.

    Inputs: clock, means, samples, noise (gyro and its drift, accelerometer,
    magnetometer, joint speed, load), biases, joint positions now and before,
    duties, temperatures. Outputs: all reports in a row (times of the samples,
    closed switches, five numbers a joint, gyro, accelerometer), the field in every
    sample, and the gyro's bias anew.
    """
    rows, n, divider = len(probe.means), N_JOINTS, config.magnetometer_divider
    sampled = -(-rows // divider)
    clock, bias = ca.SX.sym("clock", 3), ca.SX.sym("bias", 9)
    means, samples = ca.SX.sym("means", 6, rows), ca.SX.sym("samples", SAMPLE, rows)
    noise = ca.SX.sym("noise", 3 * (rows + 1) + 3 * rows + 3 * sampled + 2 * n)
    parts = ca.vertsplit(noise, [0, *np.cumsum([3 * (rows + 1), 3 * rows, 3 * sampled, n, n]).tolist()])
    gyro_noise, accel_noise, field_noise = (ca.reshape(part, 3, -1) for part in parts[:3])
    joints = [ca.SX.sym(name, n) for name in ("now", "before", "duty", "temperature")]

    dt = probe.physics_period
    times = [(clock[1] + row * probe.window_steps) * dt for row in range(rows)]
    closed = [_closed(samples[3:, row], config.switch_threshold) for row in range(rows)]
    gyro = [config.gyro_noise * gyro_noise[:, row] + bias[0:3] + means[0:3, row] for row in range(rows)]
    accel = [config.accel_noise * accel_noise[:, row] + bias[3:6] + means[3:6, row] for row in range(rows)]
    field = [
        samples[0:3, row] + bias[6:9] + config.magnetometer_noise * field_noise[:, row // divider]
        for row in range(rows)
    ]
    speed_noise, load_noise = config.speed_noise * parts[3], config.load_noise * parts[4]
    servos = [
        _rounded(joints[0], servo.step_angle),
        _rounded((joints[0] - joints[1]) / (probe.frame_steps * dt) + speed_noise, SPEED_UNIT),
        _rounded(joints[2] + load_noise, config.load_step),
        _rounded(joints[3], 1.0),
        ca.repmat(clock[0] * dt, n),
    ]
    return ca.Function(
        "sensors",
        [clock, means, samples, noise, bias, *joints],
        [
            ca.vertcat(*times, *closed, *servos, *gyro, *accel),
            ca.horzcat(*field),
            bias[0:3] + clock[2] * gyro_noise[:, rows],
        ],
    )


def _closed(feet: ca.SX, threshold: float) -> ca.SX:
    """Sum of 1, 2, 4, 8 over the legs whose force (the last three of each foot's four) closes its switch."""
    forces = [ca.sqrt(ca.sumsqr(feet[4 * leg + 1 : 4 * leg + 4])) for leg in range(N_LEGS)]
    return ca.dot(ca.DM(BITS), ca.vertcat(*forces) > threshold)


def _rounded(value: ca.SX, unit: float) -> ca.SX:
    return ca.floor(value / unit + 0.5) * unit
