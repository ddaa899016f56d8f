"""A trotting trunk in closed form, and the sensor frames that it would give.

Independent of the simulator: smooth profiles of speed, turning and sway on a
1 ms grid, feet that stand still (but for the rolling of their balls) or swing,
joints by inverse kinematics, sensors with the figures of the hardware notes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from bluefoot_mpc.model.legs import LegGeometry, feet_in_base, inverse_in_leg, to_leg_frame
from bluefoot_mpc.model.parameters import GRAVITY, load_parameters
from bluefoot_mpc.types import FloatArray, ImuBatch, SensorFrame

STEP = math.radians(300.0) / 1023
MOUNT = np.array([0.0, 0.0, 0.02])
FIELD = np.array([0.45, 0.1, -0.88])
IMU_PERIOD = 0.005
FRAME_PERIOD = 0.02
NOMINAL_FEET = np.array([[0.165, 0.165], [0.165, -0.165], [-0.165, 0.165], [-0.165, -0.165]])


@dataclass(frozen=True)
class Motion:
    """What the synthetic robot does."""

    duration: float = 30.0
    start: float = 3.0  # s of standing first
    speed: float = 0.1  # m/s
    lateral: float = 0.0
    yaw_rate: float = 0.2  # rad/s
    surge: float = 0.0  # m/s, slow variation of the speed, period 5 s
    ramp: float = 0.5  # s to reach speed
    cycle: float = 0.5  # s
    swing: float = 0.4  # share of the cycle
    lift: float = 0.015
    height: float = 0.115
    sway: float = 0.003  # m
    tilt: float = math.radians(0.7)
    start_tilt: tuple[float, float] = (0.0, 0.0)
    ankle_swing: float = 0.0  # rad, change of the last link's direction with the stride: rolls the ball


@dataclass(frozen=True)
class Sensors:
    """Figures of the sensors."""

    gyro_noise: float = 0.01
    gyro_bias: float = 0.02
    gyro_drift: float = 0.001
    accel_noise: float = 0.1
    accel_bias: float = 0.03
    field_noise: float = 0.01
    hard_iron: float = 0.03
    quantised: bool = True
    switch_delay: float = 0.01
    chatter: float = 0.01
    slip: float = 0.0  # m, deviation of the slip of a foot per stance


PERFECT = Sensors(
    gyro_noise=0.0, gyro_bias=0.0, gyro_drift=0.0, accel_noise=0.0, accel_bias=0.0, field_noise=0.0,
    hard_iron=0.0, quantised=False, switch_delay=0.0, chatter=0.0,
)  # fmt: skip


@dataclass
class Run:
    """Frames and the truth at their times."""

    frames: list[SensorFrame]
    time: FloatArray
    position: FloatArray
    rpy: FloatArray
    velocity_in_base: FloatArray
    rate: FloatArray
    joints: FloatArray
    joint_speed: FloatArray
    stance: FloatArray
    gyro_bias: FloatArray
    accel_bias: FloatArray


def geometry() -> LegGeometry:
    return LegGeometry.from_parameters(load_parameters())


def smooth(s: FloatArray) -> FloatArray:
    s = np.clip(s, 0.0, 1.0)
    return s**3 * (10 - 15 * s + 6 * s * s)


def rotations(rpy: FloatArray) -> FloatArray:
    c, s = np.cos(rpy), np.sin(rpy)
    (cr, cp, cy), (sr, sp, sy) = np.moveaxis(c, -1, 0), np.moveaxis(s, -1, 0)
    rows = [
        [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
        [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
        [-sp, cp * sr, cp * cr],
    ]
    return np.moveaxis(np.array(rows), (0, 1), (-2, -1))


def make_run(motion: Motion, sensors: Sensors, seed: int) -> Run:
    """Truth on a 1 ms grid, then the frames."""
    rng = np.random.default_rng(seed)
    geo = geometry()
    t = np.arange(0.0, motion.duration + 0.05, 0.001)
    position, rpy, velocity = _trunk(motion, t)
    p, e = CubicSpline(t, position), CubicSpline(t, rpy)
    rotation = rotations(rpy)
    rate = _body_rate(rpy, e(t, 1))
    force = _mean_force(CubicSpline(t, position + rotation @ MOUNT)(t, 1), e, t)
    feet, stance = _feet(motion, t, velocity, rpy[:, 2], rng=rng, slip=sensors.slip)
    joints, feet = _joints(motion, geo, t, position, rotation=rotation, feet=feet, stance=stance)
    truth = Run(
        [], t, position, rpy, np.einsum("nji,nj->ni", rotation, p(t, 1)), rate, joints,
        CubicSpline(t, joints)(t, 1), stance, np.zeros(3), np.zeros(3),
    )  # fmt: skip
    return _frames(truth, force, sensors, rng)


def _trunk(motion: Motion, t: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    share = smooth((t - motion.start) / motion.ramp)
    w = 2 * math.pi / motion.cycle
    phase = w * (t - motion.start)
    yaw = np.concatenate(([0.0], np.cumsum(share[1:] * motion.yaw_rate * 0.001)))
    speed = motion.speed + motion.surge * np.sin(2 * math.pi * (t - motion.start) / 5.0)
    vx, vy = share * speed, share * motion.lateral
    world = np.stack([np.cos(yaw) * vx - np.sin(yaw) * vy, np.sin(yaw) * vx + np.cos(yaw) * vy], axis=1)
    xy = np.vstack([np.zeros(2), np.cumsum(0.5 * (world[1:] + world[:-1]) * 0.001, axis=0)])
    position = np.column_stack([xy, np.full(len(t), motion.height)])
    position[:, 1] += share * motion.sway * np.sin(phase)
    position[:, 2] += share * 0.5 * motion.sway * np.sin(2 * phase)
    roll = motion.start_tilt[0] + share * motion.tilt * np.sin(phase + 0.4)
    pitch = motion.start_tilt[1] + share * motion.tilt * np.sin(phase + 1.9)
    return position, np.column_stack([roll, pitch, yaw]), world


def _body_rate(rpy: FloatArray, change: FloatArray) -> FloatArray:
    roll, pitch = rpy[:, 0], rpy[:, 1]
    dr, dp, dy = change.T
    return np.column_stack(
        [
            dr - np.sin(pitch) * dy,
            np.cos(roll) * dp + np.sin(roll) * np.cos(pitch) * dy,
            -np.sin(roll) * dp + np.cos(roll) * np.cos(pitch) * dy,
        ]
    )


def _mean_force(velocity: FloatArray, rpy: CubicSpline, t: FloatArray) -> FloatArray:
    """(n, 3) specific force, mean over the IMU's period before each time, base frame in its middle."""
    k = round(IMU_PERIOD / 0.001)
    change = (velocity - np.vstack([np.repeat(velocity[:1], k, axis=0), velocity[:-k]])) / IMU_PERIOD
    middle = rotations(rpy(t - 0.5 * IMU_PERIOD))
    return np.einsum("nji,nj->ni", middle, change + np.array([0.0, 0.0, GRAVITY]))


def _mean_rate(rate: FloatArray) -> FloatArray:
    """(n, 3) rad/s, mean over the IMU's period before each time (trapezoid on the grid)."""
    k = round(IMU_PERIOD / 0.001)
    total = np.vstack([np.zeros(3), np.cumsum(0.5 * (rate[1:] + rate[:-1]), axis=0)])
    before = np.vstack([np.repeat(total[:1], k, axis=0), total[:-k]])
    return (total - before) / k


def _feet(
    motion: Motion,
    t: FloatArray,
    velocity: FloatArray,
    yaw: FloatArray,
    *,
    rng: np.random.Generator,
    slip: float,
) -> tuple[FloatArray, FloatArray]:
    """Foot centres in the world, and who stands; a diagonal pair swings at a time."""
    way = np.vstack([np.zeros(2), np.cumsum(velocity[:-1] * 0.001, axis=0)])
    feet = np.zeros((len(t), 4, 3))
    stance = np.ones((len(t), 4), dtype=bool)
    for leg in range(4):
        offset = 0.0 if leg in (0, 3) else 0.5
        lift_offs = np.arange(motion.start + offset * motion.cycle, t[-1], motion.cycle)

        def hold(when: float, leg: int = leg) -> FloatArray:
            k = min(int(when / 0.001), len(t) - 1)
            c, s = math.cos(yaw[k]), math.sin(yaw[k])
            return way[k] + np.array([[c, -s], [s, c]]) @ NOMINAL_FEET[leg]

        here = hold(0.0)
        feet[:, leg, :2] = here
        for up in lift_offs:
            down = up + motion.swing * motion.cycle
            target = hold(down + 0.5 * (1 - motion.swing) * motion.cycle)
            k0, k1 = int(np.ceil(up / 0.001)), int(np.ceil(down / 0.001))
            s = (t[k0:k1] - up) / (down - up)
            feet[k0:k1, leg, :2] = here + smooth(s)[:, None] * (target - here)
            feet[k0:k1, leg, 2] = motion.lift * 16 * (s * (1 - s)) ** 2
            stance[k0:k1, leg] = False
            here = target
            feet[k1:, leg, :2] = here
            if slip > 0.0:
                glide = rng.normal(0.0, slip, 2)
                n = min(200, len(t) - k1)
                if n > 0:
                    feet[k1 : k1 + n, leg, :2] += np.linspace(0, 1, n)[:, None] * glide
                    feet[k1 + n :, leg, :2] += glide
                here = here + glide
    return feet, stance


def _joints(
    motion: Motion, geo: LegGeometry, t: FloatArray, position: FloatArray, *, rotation: FloatArray,
    feet: FloatArray, stance: FloatArray,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Joint angles; the balls of standing feet roll when the last links turn."""
    shift = np.zeros((len(t), 4, 2))
    for _ in range(2 if motion.ankle_swing else 1):
        world = feet.copy()
        world[:, :, :2] += shift
        in_base = np.einsum("nji,nlj->nli", rotation, world - position[:, None, :])
        in_leg = to_leg_frame(geo, in_base)
        reach = np.hypot(in_leg[..., 0], in_leg[..., 1])
        ankle = math.radians(-99.0) + motion.ankle_swing * (reach - 0.14) / 0.03
        angles, missing = inverse_in_leg(geo, in_leg, ankle)
        if missing.max() > 1e-9:
            raise ValueError("the synthetic feet are out of reach")
        direction = angles[..., 0] + geo.hip_azimuth
        bend = np.diff(ankle, axis=0, prepend=ankle[:1])
        axis = np.stack([np.sin(direction), -np.cos(direction), np.zeros_like(direction)], axis=-1)
        turn = np.einsum("nij,nlj->nli", rotation, axis * bend[..., None])
        roll = geo.foot_radius * np.stack([turn[..., 1], -turn[..., 0]], axis=-1)
        if motion.ankle_swing:
            # In the air the ball glides back to its planned place.
            for leg in range(4):
                total = np.zeros(2)
                for k in range(1, len(t)):
                    total = total + roll[k, leg] if stance[k, leg] else 0.98 * total
                    shift[k, leg] = total
    return angles.reshape(len(t), 16), world


def _frames(truth: Run, force: FloatArray, sensors: Sensors, rng: np.random.Generator) -> Run:
    t = truth.time
    gyro_bias = rng.uniform(-1, 1, 3) * sensors.gyro_bias
    accel_bias = rng.uniform(-1, 1, 3) * sensors.accel_bias
    iron = rng.uniform(-1, 1, 3) * sensors.hard_iron
    rotation, rate = rotations(truth.rpy), _mean_rate(truth.rate)
    closed = np.zeros(4, dtype=bool)
    k_frame, k_imu = round(FRAME_PERIOD / 0.001), round(IMU_PERIOD / 0.001)
    picks = np.arange(k_frame, len(t) - k_frame, k_frame)
    bias = gyro_bias.copy()
    for k in picks:
        rows = np.arange(k - k_frame + k_imu, k + 1, k_imu)
        n = len(rows)
        bias = bias + rng.normal(0, sensors.gyro_drift * math.sqrt(FRAME_PERIOD / 60.0), 3)
        magnetometer = np.full((n, 3), np.nan)
        magnetometer[-1] = rotation[k].T @ FIELD + iron + rng.normal(0, sensors.field_noise, 3)
        wanted = truth.stance[max(0, k - round(sensors.switch_delay / 0.001))]
        flips = (wanted != closed) & (rng.random(4) < sensors.chatter)
        seen = wanted ^ flips
        closed = wanted.copy()
        angles = truth.joints[k]
        batch = ImuBatch(
            time=t[rows], gyro=rate[rows] + bias + rng.normal(0, sensors.gyro_noise, (n, 3)),
            accel=force[rows] + accel_bias + rng.normal(0, sensors.accel_noise, (n, 3)),
            magnetometer=magnetometer, valid=np.ones(n, dtype=bool),
        )  # fmt: skip
        truth.frames.append(
            frame(t[k], np.round(angles / STEP) * STEP if sensors.quantised else angles, batch, seen)
        )
    return replace(
        truth, time=t[picks], position=truth.position[picks], rpy=truth.rpy[picks],
        velocity_in_base=truth.velocity_in_base[picks], rate=truth.rate[picks], joints=truth.joints[picks],
        joint_speed=truth.joint_speed[picks], stance=truth.stance[picks], gyro_bias=bias,
        accel_bias=accel_bias,
    )  # fmt: skip


def frame(time: float, joints: FloatArray, imu: ImuBatch, contact: FloatArray) -> SensorFrame:
    """A frame with everything else as it should be."""
    return SensorFrame(
        time=float(time), joint_position=joints, joint_speed=np.zeros(16), joint_load=np.zeros(16),
        joint_temperature=np.full(16, 25.0), joint_time=np.full(16, float(time)),
        joint_valid=np.ones(16, dtype=bool), voltage=12.0, voltage_valid=True, imu=imu,
        contact=contact.copy(),
        contact_time=np.full(4, float(time)), contact_valid=np.ones(4, dtype=bool),
    )  # fmt: skip


__all__ = ["PERFECT", "Motion", "Run", "Sensors", "feet_in_base", "frame", "geometry", "make_run"]
