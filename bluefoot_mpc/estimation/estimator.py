"""From sensor frames to the state of the body."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import EstimatorConfig
from bluefoot_mpc.estimation.contacts import SwitchState, advance_switches, initial_switches
from bluefoot_mpc.estimation.corrections import plant_feet
from bluefoot_mpc.estimation.filter import FilterState, frame_noise, initial_state, predict
from bluefoot_mpc.estimation.heading import HeadingReference, advance_heading
from bluefoot_mpc.estimation.inertial import (
    ZERO,
    Motion,
    Sample,
    integrate,
    level_quaternion,
    mean_rate,
    rotation_matrix,
    usable_samples,
)
from bluefoot_mpc.estimation.joints import (
    JointState,
    advance_joints,
    initial_joints,
    known_legs,
)
from bluefoot_mpc.estimation.odometry import (
    OdometryState,
    advance_position,
    start_odometry,
    trunk_height,
)
from bluefoot_mpc.estimation.rest import RestState, advance_rest, at_rest, correct_bias
from bluefoot_mpc.estimation.stance import (
    StanceState,
    advance_stance,
    measure_feet,
    rolling,
)
from bluefoot_mpc.model.legs import LegGeometry, feet_in_base, foot_jacobians_in_base
from bluefoot_mpc.types import N_LEGS, BodyState, FloatArray, SensorFrame

BLIND_TILT = 0.3  # rad, deviation of a level start without any inertial sample
FIRST_FRAME = 0.02  # s, samples this old belong to the first frame
MAX_READ_DELAY = 0.03  # s, older joint readings are taken as they are
MIN_KNOWN_LEGS = 3


class _Memory(NamedTuple):
    """All that the estimator remembers from one frame to the next."""

    time: float
    joints: JointState
    angles: FloatArray  # (16,) rad, as used at the last frame
    switches: SwitchState
    filter: FilterState
    stance: StanceState
    heading: HeadingReference
    odometry: OdometryState
    rest: RestState
    sample: Sample | None
    rate: tuple[float, float, float]  # rad/s, base frame, bias removed
    imu_age: float  # s since the last usable inertial sample


class _Prediction(NamedTuple):
    """The filter carried to a frame's time, before it sees that frame's feet."""

    filter: FilterState
    motion: Motion
    roll: FloatArray  # (4, 3) m, way of the foot points by rolling, world axes
    rotation: FloatArray  # (3, 3) rotation_base_to_world


class Estimator:
    """State of the body from what the robot measures, one frame at a time.

    The odometry frame has its origin under the trunk of the first frame, at the
    height of the foot points (one ball radius above the floor), x along the
    heading of that frame and z up; the trunk origin starts at (0, 0, height).
    Start at rest: attitude and gyro bias settle within the first second.

    Args:
        geometry: legs of the robot.
        config: settings; `config.imu.mount` must be where the IMU sits.
    """

    def __init__(self, geometry: LegGeometry, config: EstimatorConfig) -> None:
        self._geometry = geometry
        self._config = config
        self._mount = np.array(config.imu.mount)
        self._azimuth: list[float] = geometry.hip_azimuth.tolist()
        self._memory: _Memory | None = None

    def reset(self) -> None:
        """Forget everything; the next frame is the first."""
        self._memory = None

    @property
    def gyro_bias(self) -> FloatArray:
        """(3,) rad/s, estimated bias of the gyro in the base frame; zero before the first frame."""
        return np.zeros(3) if self._memory is None else np.array(self._memory.filter.gyro_bias)

    @property
    def covariance(self) -> FloatArray:
        """(26, 26) covariance of the filter's errors (see `filter`); empty before the first frame."""
        return np.zeros((0, 0)) if self._memory is None else self._memory.filter.covariance.copy()

    @property
    def feet_used(self) -> tuple[int, ...]:
        """Feet that corrected the filter on the last frame."""
        return () if self._memory is None else self._memory.stance.used

    def step(self, frame: SensorFrame) -> BodyState:
        """Take one frame.

        Args:
            frame: what the sensors gave since the previous one. A frame that is
                not newer, or much newer, than the previous one counts as a jump
                of the clock: the estimate goes on from where it was, with doubt.
        """
        memory = self._memory
        dt = math.nan if memory is None else frame.time - memory.time
        if memory is None or not 0.0 < dt <= self._config.max_step:
            return self._start(frame, memory)
        joints, angles = self._read_joints(frame, memory.joints, dt)
        switches = advance_switches(
            memory.switches, frame.contact, frame.contact_valid, dt, self._config.contact.debounce
        )
        samples = usable_samples(frame.imu, memory.time, frame.time, memory.sample)
        ahead = self._predict(memory, angles, samples, (memory.time, frame.time))
        points = feet_in_base(self._geometry, angles)
        closed = frame.contact & frame.contact_valid & switches.contact
        standing: list[bool] = (closed & known_legs(joints, self._config.joint)).tolist()
        state, stance, rest = self._correct(
            memory, ahead, samples, standing=standing, angles=angles, points=points, dt=dt
        )
        heading = memory.heading
        if self._config.heading.enabled:
            state, heading = advance_heading(state, heading, frame.imu, dt, self._config.heading)
        odometry = advance_position(
            memory.odometry, state.feet, ahead.roll, stance.used, ahead.motion.displacement
        )
        sample, rate, age = memory.sample, memory.rate, memory.imu_age + dt
        if samples:
            mean, bias = mean_rate(samples), state.gyro_bias
            rate = (mean[0] - bias[0], mean[1] - bias[1], mean[2] - bias[2])
            sample, age = samples[-1], 0.0
        memory = _Memory(
            frame.time, joints, angles, switches, state, stance, heading, odometry, rest, sample, rate, age
        )
        return self._finish(memory, points)

    def _start(self, frame: SensorFrame, memory: _Memory | None) -> BodyState:
        """First frame, or the first after a jump of the clock (then with what was known)."""
        config = self._config
        joints, angles = self._read_joints(frame, initial_joints(), 0.0)
        switches = advance_switches(initial_switches(), frame.contact, frame.contact_valid, 0.0, 0.0)
        samples = usable_samples(frame.imu, frame.time - FIRST_FRAME, frame.time, None)
        points = feet_in_base(self._geometry, angles)
        tilt = config.initial_tilt if samples else BLIND_TILT
        state = initial_state(level_quaternion(samples), tilt, config)
        if memory is not None:
            state = _doubtful(memory.filter, state)
        rotation = rotation_matrix(state.quaternion)
        feet = measure_feet(
            rotation, points - self._mount, foot_jacobians_in_base(self._geometry, angles), config.contact
        )
        state = plant_feet(state, list(range(N_LEGS)), feet.points @ rotation.T, feet.noise)
        if memory is None:
            height = trunk_height(points @ rotation.T, switches.contact.tolist())
            odometry = start_odometry(state.feet, height, rotation @ self._mount)
        else:
            odometry = OdometryState(memory.odometry.position, state.feet, ())
        fresh = _Memory(
            frame.time, joints, angles, switches, state, StanceState(),
            HeadingReference() if memory is None else memory.heading, odometry, RestState(angles, 0.0),
            samples[-1] if samples else None, ZERO, 0.0 if memory is None else math.inf,
        )  # fmt: skip
        return self._finish(fresh, points)

    def _read_joints(self, frame: SensorFrame, state: JointState, dt: float) -> tuple[JointState, FloatArray]:
        """Advance the joint filter; angles are carried from their reading to the frame's time."""
        valid = frame.joint_valid & np.isfinite(frame.joint_position)
        complete = bool(valid.all())
        measured = frame.joint_position if complete else np.where(valid, frame.joint_position, 0.0)
        joints = advance_joints(state, measured, valid, dt, self._config.joint)
        newest = measured.copy() if complete else np.where(valid, measured, joints.position)
        delay = frame.time - frame.joint_time
        if delay.any():
            newest += np.where((delay > 0.0) & (delay <= MAX_READ_DELAY), delay, 0.0) * joints.velocity
        return joints, newest

    def _predict(
        self, memory: _Memory, angles: FloatArray, samples: list[Sample], span: tuple[float, float]
    ) -> _Prediction:
        """Carry the filter to the frame's time."""
        before = memory.filter
        motion = integrate(
            before.quaternion, before.velocity, samples, span=span,
            biases=(before.gyro_bias, before.accel_bias),
        )  # fmt: skip
        bend = (angles - memory.angles).reshape(N_LEGS, -1)[:, 1:].sum(axis=1).tolist()
        direction = [a + q for a, q in zip(self._azimuth, angles[::4].tolist(), strict=True)]
        rotation = rotation_matrix(motion.quaternion)
        roll = rolling(self._geometry.foot_radius, rotation, np.array(motion.turn), direction, bend)
        noise = frame_noise(samples, self._config.imu)
        state = predict(
            before, motion, roll, noise, rotation=rotation, dt=span[1] - span[0], config=self._config
        )
        return _Prediction(state, motion, roll, rotation)

    def _correct(
        self, memory: _Memory, ahead: _Prediction, samples: list[Sample], *, standing: list[bool],
        angles: FloatArray, points: FloatArray, dt: float,
    ) -> tuple[FilterState, StanceState, RestState]:  # fmt: skip
        """Use standing feet, and the gyro's rest."""
        config = self._config
        jacobians = foot_jacobians_in_base(self._geometry, angles)
        feet = measure_feet(ahead.rotation, points - self._mount, jacobians, config.contact)
        state, stance = advance_stance(
            ahead.filter, memory.stance, feet, standing, dt=dt, config=config.contact
        )
        rest = advance_rest(memory.rest, angles, dt, config.rest)
        if at_rest(rest, standing, samples, state, config.rest):
            state = correct_bias(state, samples, config.rest)
        return state, stance, rest

    def _finish(self, memory: _Memory, points: FloatArray) -> BodyState:
        """Keep the memory and make the public record from it."""
        self._memory = memory
        state = memory.filter
        rotation = rotation_matrix(state.quaternion)
        wx, wy, wz = memory.rate
        mx, my, mz = self._config.imu.mount
        spin = (wy * mz - wz * my, wz * mx - wx * mz, wx * my - wy * mx)
        contact = memory.switches.contact
        known = known_legs(memory.joints, self._config.joint)
        return BodyState(
            time=memory.time,
            position=np.array(memory.odometry.position) - rotation @ self._mount,
            quaternion=np.array(state.quaternion),
            rpy=np.array(_rpy(state.quaternion)),
            linear_velocity=np.array(state.velocity) @ rotation - spin,
            angular_velocity=np.array(memory.rate),
            joint_position=memory.angles,
            joint_velocity=memory.joints.velocity,
            contact=contact,
            foot_position_in_base=points,
            height=trunk_height(points @ rotation.T, contact.tolist()),
            healthy=memory.imu_age <= self._config.imu.lost_after and int(known.sum()) >= MIN_KNOWN_LEGS,
        )


def _doubtful(before: FilterState, fresh: FilterState) -> FilterState:
    """What may be kept across a gap of unknown length: attitude and biases, the first with doubt."""
    covariance = fresh.covariance.copy()
    covariance[18:, 18:] = before.covariance[18:, 18:]
    covariance[2, 2] += before.covariance[2, 2] + fresh.covariance[0, 0]
    return fresh._replace(
        quaternion=before.quaternion, gyro_bias=before.gyro_bias, accel_bias=before.accel_bias,
        hard_iron=before.hard_iron, covariance=covariance,
    )  # fmt: skip


def _rpy(quaternion: tuple[float, float, float, float]) -> tuple[float, float, float]:
    """Roll, pitch, yaw (rad) of the zyx sequence."""
    x, y, z, w = quaternion
    roll = math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = math.asin(min(1.0, max(-1.0, 2.0 * (w * y - z * x))))
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return roll, pitch, yaw
