"""A run as plain arrays over time: what every plot, the replay and the figures draw from.

Where the simulator's truth is missing (hardware), the estimate takes its place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion, rotation_z, rpy_from_quaternion
from bluefoot_mpc.runtime.data import RunData, happenings
from bluefoot_mpc.runtime.metrics import mass_from_load, mass_in_motion, zero_moment_points
from bluefoot_mpc.types import BoolArray, FloatArray, Telemetry, TruthSample

_LOADED = 0.5  # N, a foot with less under it counts as lifted


@dataclass(frozen=True, kw_only=True, slots=True)
class RunSeries:
    """Time series of one run, n ticks; world frame unless named otherwise.

    Attributes:
        time: (n,) s, from the first tick.
        has_truth: True where simulator truth was recorded.
        q: (n, 23) configuration to draw: truth, else the estimate.
        rpy_estimate: (n, 3) rad.
        rpy_truth: (n, 3) rad; NaN without truth.
        rpy_command: (n, 2) rad, commanded roll and pitch.
        velocity_estimate: (n, 2) m/s, forward and left in the trunk's heading frame.
        velocity_truth: (n, 2) m/s; NaN without truth.
        velocity_command: (n, 2) m/s.
        yaw_rate: (n,) rad/s, drawn robot.
        yaw_rate_command: (n,) rad/s.
        height: (n,) m, trunk origin.
        feet: (n, 4, 3) m.
        scheduled: (n, 4) True where the gait wants the foot to stand.
        switch: (n, 4) foot switches as measured.
        loaded: (n, 4) True where the ground carries the foot (truth), else the switches.
        com: (n, 3) m; NaN without truth.
        zmp: (n, 2) m, from the true rate of momentum; NaN without truth or in flight.
        zmp_plan: (n, 2) m, ZMP that the controller assumed; NaN where it had none.
        reference: (n, 2) m, wanted trunk position, carried over from b' by the stance feet.
        torque: (n, 16) N·m motor torque (truth); load share times stall torque without truth.
        temperature: (n, 16) °C of the motors (truth), else as the servos report it.
        voltage: (n,) V.
        power: (n,) W drawn by the servos; NaN without truth.
        push: (n, 3) N, push on the trunk; zeros without truth.
        tick_us: (n,) µs.
        mode: (n,) names of the modes.
        walking: (n,) True where the gait walks.
        events: time (s) and text of everything that happened, in order.
    """

    time: FloatArray
    has_truth: bool
    q: FloatArray
    rpy_estimate: FloatArray
    rpy_truth: FloatArray
    rpy_command: FloatArray
    velocity_estimate: FloatArray
    velocity_truth: FloatArray
    velocity_command: FloatArray
    yaw_rate: FloatArray
    yaw_rate_command: FloatArray
    height: FloatArray
    feet: FloatArray
    scheduled: BoolArray
    switch: BoolArray
    loaded: BoolArray
    com: FloatArray
    zmp: FloatArray
    zmp_plan: FloatArray
    reference: FloatArray
    torque: FloatArray
    temperature: FloatArray
    voltage: FloatArray
    power: FloatArray
    push: FloatArray
    tick_us: FloatArray
    mode: tuple[str, ...]
    walking: BoolArray
    events: tuple[tuple[float, str], ...]

    @property
    def duration(self) -> float:
        """Seconds from the first to the last tick; 0 for an empty run."""
        return float(self.time[-1]) if len(self.time) else 0.0


def extract(run: RunData, stall_torque: float) -> RunSeries:
    """Turn a run's records into arrays.

    Args:
        run: the run; ticks at the end that lack a record are dropped.
        stall_torque: N·m, gives the servo's reported load share a unit.
    """
    n = min(len(run.telemetry), len(run.frames))
    has_truth = bool(run.truth)
    if has_truth:
        n = min(n, len(run.truth))
    telemetry, frames, truth = run.telemetry[:n], run.frames[:n], run.truth[:n]
    time = _array([t.time for t in telemetry], n)
    start = float(time[0]) if n else 0.0
    nothing = np.full((n, 3), np.nan)
    q = _array([t.q for t in truth] if has_truth else [estimated_q(t) for t in telemetry], n, 23)
    rpy = _array([rpy_from_quaternion(row) for row in q[:, 3:7]], n, 3)
    feet_rows = [t.foot_position for t in truth] if has_truth else [estimated_feet(t) for t in telemetry]
    feet = _array(feet_rows, n, 4, 3)
    switch = _array([f.contact for f in frames], n, 4).astype(bool)
    walking = _array([t.phase.walking for t in telemetry], n).astype(bool)
    swing = _array([t.phase.swing for t in telemetry], n, 4).astype(bool) & walking[:, None]
    trunk_virtual = _array([t.reference.trunk_position[:2] for t in telemetry], n, 2)
    planned = np.stack([trunk_virtual, _array([t.zmp for t in telemetry], n, 2)])
    wanted_feet = _array([t.reference.foot_position[:, :2] for t in telemetry], n, 4, 2)
    planned = from_virtual(planned, wanted_feet, feet[:, :, :2], ~swing, rpy[:, 2])
    com = _array([t.com for t in truth], n, 3) if has_truth else nothing
    rates = [t.v[5] for t in truth] if has_truth else [t.estimate.angular_velocity[2] for t in telemetry]
    hot = [t.motor_temperature for t in truth] if has_truth else [f.joint_temperature for f in frames]
    # A robot that finds its own way commands itself.
    pairs = zip(run.commands[:n], telemetry, strict=False)
    wanted = [c.motion if c.motion.guide is None else t.motion for c, t in pairs]
    share = _array([f.joint_load for f in frames], n, 16)
    return RunSeries(
        time=time - start, has_truth=has_truth, q=q,
        rpy_estimate=_array([t.estimate.rpy for t in telemetry], n, 3),
        rpy_truth=rpy if has_truth else nothing,
        rpy_command=_array([t.motion.trunk.rpy[:2] for t in telemetry], n, 2),
        velocity_estimate=_array([_estimated_velocity(t) for t in telemetry], n, 2),
        velocity_truth=_array([_true_velocity(t) for t in truth], n, 2) if has_truth else nothing[:, :2],
        velocity_command=_array([m.velocity for m in wanted], n, 2),
        yaw_rate=_array(rates, n),
        yaw_rate_command=_array([m.yaw_rate for m in wanted], n),
        height=q[:, 2].copy(), feet=feet, scheduled=~swing, switch=switch,
        loaded=_array([t.foot_force[:, 2] for t in truth], n, 4) > _LOADED if has_truth else switch,
        com=com, zmp=_measured_zmp(truth, time, com, n), zmp_plan=planned[1], reference=planned[0],
        torque=_array([t.motor_torque for t in truth], n, 16) if has_truth else share * stall_torque,
        temperature=_array(hot, n, 16),
        voltage=_array([f.voltage for f in frames], n),
        power=_array([t.electrical_power for t in truth], n) if has_truth else nothing[:, 0],
        push=_array([t.external_force for t in truth], n, 3) if has_truth else np.zeros((n, 3)),
        tick_us=_array([t.tick_us for t in telemetry], n),
        mode=tuple(str(t.mode) for t in telemetry), walking=walking, events=tuple(
            (when - start, what) for when, what in happenings(telemetry)
        ),
    )  # fmt: skip


def _measured_zmp(truth: Sequence[TruthSample], time: FloatArray, com: FloatArray, n: int) -> FloatArray:
    """(n, 2) m, where the ground's reaction acts, as the run's summary takes it."""
    if n < 3 or not truth:
        return np.full((n, 2), np.nan)
    momentum = _array([t.momentum for t in truth], n, 6)
    push = _array([np.concatenate([t.external_force, t.q[:3]]) for t in truth], n, 6)
    ground = np.array([np.min(t.foot_position[:, 2] - t.foot_height) for t in truth])
    mass = mass_in_motion(com, momentum[:, :3], time)
    if mass is None:
        mass = mass_from_load(_array([t.foot_force for t in truth], n, 4, 3), push[:, :3])
    if not mass > 0.0:
        return np.full((n, 2), np.nan)
    points = zero_moment_points(time, com, momentum, push, ground, mass=mass)
    return np.vstack([points, points[-1:]])


def from_virtual(
    points: FloatArray, feet_virtual: FloatArray, feet: FloatArray, stance: BoolArray, yaw: FloatArray
) -> FloatArray:
    """(k, n, 2) m, points of b' in the world: b' laid so that the wanted stance feet meet the real ones.

    Args:
        points: (k, n, 2) m, in b'.
        feet_virtual: (n, 4, 2) m, wanted feet in b'.
        feet: (n, 4, 2) m, real feet in the world.
        stance: (n, 4) True where a foot is wanted on the ground.
        yaw: (n,) rad, heading of the trunk in the world.
    """
    weight = np.where(stance.any(axis=1, keepdims=True), stance, True).astype(float)
    weight /= weight.sum(axis=1, keepdims=True)
    middle_virtual = (weight[:, :, None] * feet_virtual).sum(axis=1)
    middle = (weight[:, :, None] * feet).sum(axis=1)
    x, y = np.moveaxis(points - middle_virtual, -1, 0)
    c, s = np.cos(yaw), np.sin(yaw)
    return np.asarray(middle + np.stack([c * x - s * y, s * x + c * y], axis=-1))


def _array(rows: Sequence[Any], n: int, *shape: int) -> FloatArray:
    """(n, *shape) array that keeps its shape with no rows, too."""
    return np.array(rows, dtype=np.float64).reshape(n, *shape) if rows else np.zeros((n, *shape))


def estimated_q(telemetry: Telemetry) -> FloatArray:
    """(23,) configuration as estimated, odometry frame."""
    state = telemetry.estimate
    return np.concatenate([state.position, state.quaternion, state.joint_position])


def estimated_feet(telemetry: Telemetry) -> FloatArray:
    """(4, 3) m, foot points as estimated, odometry frame."""
    state = telemetry.estimate
    rotation = rotation_from_quaternion(state.quaternion)
    return np.asarray(state.position + state.foot_position_in_base @ rotation.T)


def _estimated_velocity(telemetry: Telemetry) -> FloatArray:
    state = telemetry.estimate
    return _in_heading(state.quaternion, state.linear_velocity)


def _true_velocity(truth: TruthSample) -> FloatArray:
    return _in_heading(truth.q[3:7], truth.v[:3])


def _in_heading(quaternion: FloatArray, velocity_in_base: FloatArray) -> FloatArray:
    """(2,) m/s, forward and left along the trunk's own heading."""
    rotation = rotation_from_quaternion(quaternion)
    yaw = np.arctan2(rotation[1, 0], rotation[0, 0])
    return np.asarray((rotation_z(-yaw) @ rotation @ velocity_in_base)[:2])
