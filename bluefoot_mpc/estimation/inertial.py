"""Inertial samples: screening, and integration of attitude and velocity.

Screening works on plain floats: at four samples a frame they are several times
faster than arrays of three.
"""

from __future__ import annotations

import functools
import math
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from bluefoot_mpc.estimation import symbols
from bluefoot_mpc.estimation.workspace import Workspace, compile_function
from bluefoot_mpc.model.parameters import GRAVITY
from bluefoot_mpc.types import FloatArray, ImuBatch

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

ZERO: Vector = (0.0, 0.0, 0.0)
Span = tuple[float, float]

UPRIGHT = ca.DM([0.0, 0.0, GRAVITY])
"""m/s², specific force at rest."""
MOTION_SIZE = 23
_CHUNK = 5  # samples, one more than a frame has at 200 Hz
_CHUNK_VALUES = 8 * _CHUNK


class Sample(NamedTuple):
    """One usable inertial sample.

    Attributes:
        time: s.
        rate: rad/s, base frame, as measured.
        force: m/s², specific force, base frame, as measured.
    """

    time: float
    rate: Vector
    force: Vector


class Motion(NamedTuple):
    """Attitude and velocity carried over one frame, and sums of its samples.

    Attributes:
        values: (23,) what `Strapdown` carries; see its properties.
    """

    values: FloatArray

    @property
    def quaternion(self) -> FloatArray:
        """(4,) rotation_base_to_world at the end."""
        return self.values[0:4]

    @property
    def velocity(self) -> FloatArray:
        """(3,) m/s of the IMU in the world at the end."""
        return self.values[4:7]

    @property
    def displacement(self) -> FloatArray:
        """(3,) m, way of the IMU in the world."""
        return self.values[7:10]

    @property
    def turn(self) -> FloatArray:
        """(3,) rad, integrated angular velocity in the base frame."""
        return self.values[10:13]

    @property
    def sums(self) -> FloatArray:
        """(10,) number of samples, sums of their rates, of their forces but for rest, and of its squares."""
        return self.values[13:23]


def usable_samples(batch: ImuBatch, after: float, until: float, last: Sample | None) -> list[Sample]:
    """The samples of a batch that may be used, oldest first.

    Invalid and non-finite samples, samples outside the frame's time and exact
    repetitions of their predecessor (a frozen sensor: white noise does not
    repeat six values) are left out.

    Args:
        batch: samples since the previous frame.
        after: s, time of the previous frame.
        until: s, time of this frame.
        last: the newest sample used so far.
    """
    columns = (batch.time.tolist(), batch.gyro.tolist(), batch.accel.tolist(), batch.valid.tolist())
    samples: list[Sample] = []
    newest = last
    for time, (wx, wy, wz), (ax, ay, az), valid in zip(*columns, strict=True):
        if not valid or not math.isfinite(wx + wy + wz + ax + ay + az) or not after < time <= until + 1e-6:
            continue
        sample = Sample(time, (wx, wy, wz), (ax, ay, az))
        if newest is None or sample.rate != newest.rate or sample.force != newest.force:
            samples.append(sample)
        newest = sample
    return samples


class Strapdown:
    """Workspace that carries attitude and velocity of the IMU; holds no memory of the motion.

    A sample stands for the mean over the time since its predecessor, as sensors
    that low-pass and decimate give it; forces are seen from the middle of that
    turn. The last sample also fills the rest of the frame; without samples the
    robot goes on without turning or accelerating.
    """

    def __init__(self) -> None:
        self._work = Workspace(_strapdown())

    def advance(self, start: FloatArray, biases: FloatArray, samples: list[Sample], span: Span) -> Motion:
        """Integrate one frame.

        Args:
            start: (7,) quaternion and velocity (m/s, world) at the start.
            biases: (6,) of gyro (rad/s) and accelerometer (m/s²), base frame.
            samples: what `usable_samples` gave.
            span: s, start and end of the frame.
        """
        carried, known, rows = self._work.inputs
        carried[:7] = start
        carried[7:] = 0.0
        known[:] = biases
        time, end = span
        if not samples:
            carried[7:10] = carried[4:7] * (end - time)
        values: list[float] = []
        last = len(samples) - 1
        for k, (when, rate, force) in enumerate(samples):
            until = end if k == last else when
            values += (1.0, until - time, *rate, *force)
            time = until
        for first in range(0, len(values), _CHUNK_VALUES):
            chunk = values[first : first + _CHUNK_VALUES]
            chunk += [0.0] * (_CHUNK_VALUES - len(chunk))
            rows[:] = chunk
            self._work.call()
            carried[:] = self._work.outputs[0]
        return Motion(carried.copy())


def integrate(
    quaternion: Quaternion, velocity: Vector, samples: list[Sample], *,
    span: Span, biases: tuple[Vector, Vector],
) -> Motion:  # fmt: skip
    """Carry attitude and velocity of the IMU over one frame; see `Strapdown`.

    Args:
        quaternion: rotation_base_to_world at the start.
        velocity: m/s, world, at the start.
        samples: what `usable_samples` gave.
        span: s, start and end of the frame.
        biases: gyro bias (rad/s) and accelerometer bias (m/s²), base frame.
    """
    start, known = np.array((*quaternion, *velocity)), np.array((*biases[0], *biases[1]))
    return Strapdown().advance(start, known, samples, span)


@functools.lru_cache(maxsize=1)
def _strapdown() -> Any:
    """Integration over `_CHUNK` samples (immutable, so it may be shared); a row of zeros changes nothing.

    Rows are weight, duration (s), angular velocity and specific force. Carried
    are quaternion, velocity, way, turn, and for the noise of the frame the sums
    of weights, rates, forces without `UPRIGHT`, and squares of those.
    """
    carried, biases = ca.SX.sym("carried", MOTION_SIZE), ca.SX.sym("biases", 6)
    rows = ca.SX.sym("rows", _CHUNK_VALUES)
    quaternion, velocity, way, turn, sums = ca.vertsplit(carried, [0, 4, 7, 10, 13, 23])
    for k in range(_CHUNK):
        weight, dt, rate, measured = ca.vertsplit(rows[8 * k : 8 * k + 8], [0, 1, 2, 5, 8])
        step = (rate - biases[:3]) * dt
        middle = symbols.quaternion_product(quaternion, symbols.small_quaternion(0.5 * step))
        force = symbols.rotated(middle, measured - biases[3:]) - UPRIGHT
        way += (velocity + 0.5 * force * dt) * dt
        velocity += force * dt
        turn += step
        quaternion = symbols.quaternion_product(quaternion, symbols.small_quaternion(step))
        shake = measured - UPRIGHT
        sums += weight * ca.vertcat(1.0, rate, shake, shake * shake)
    return compile_function(
        "strapdown", {"carried": carried, "biases": biases, "rows": rows},
        {"after": ca.vertcat(quaternion, velocity, way, turn, sums)},
    )  # fmt: skip


def rotated(quaternion: Quaternion, ax: float, ay: float, az: float) -> Vector:
    """The vector (ax, ay, az) of the base frame in the world frame."""
    x, y, z, w = quaternion
    ux = 2.0 * (y * az - z * ay)
    uy = 2.0 * (z * ax - x * az)
    uz = 2.0 * (x * ay - y * ax)
    return (ax + w * ux + y * uz - z * uy, ay + w * uy + z * ux - x * uz, az + w * uz + x * uy - y * ux)


def rotation_matrix(quaternion: Quaternion) -> FloatArray:
    """(3, 3) rotation_base_to_world."""
    x, y, z, w = quaternion
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - z * w), 2.0 * (x * z + y * w)),
            (2.0 * (x * y + z * w), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - x * w)),
            (2.0 * (x * z - y * w), 2.0 * (y * z + x * w), 1.0 - 2.0 * (x * x + y * y)),
        )
    )


def level_quaternion(samples: list[Sample]) -> Quaternion:
    """Attitude at rest with zero yaw, from the mean specific force; level without samples."""
    if not samples:
        return (0.0, 0.0, 0.0, 1.0)
    x, y, z = (math.fsum(s.force[i] for s in samples) for i in range(3))
    roll = math.atan2(y, z)
    pitch = math.atan2(-x, math.hypot(y, z))
    cr, sr, cp, sp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    return (sr * cp, cr * sp, -sr * sp, cr * cp)


def mean_rate(samples: list[Sample]) -> Vector:
    """Mean measured angular velocity, rad/s; zero without samples."""
    if not samples:
        return ZERO
    n = len(samples)
    return (
        sum(s.rate[0] for s in samples) / n,
        sum(s.rate[1] for s in samples) / n,
        sum(s.rate[2] for s in samples) / n,
    )
