"""From sensor frames to the state of the body."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bluefoot_mpc.estimation.config import EstimatorConfig
from bluefoot_mpc.estimation.contacts import SwitchState, advance_switches, initial_switches, lifting_feet
from bluefoot_mpc.estimation.corrections import Settler
from bluefoot_mpc.estimation.filter import FilterState, initial_state
from bluefoot_mpc.estimation.ground import GroundEstimate, GroundPlane
from bluefoot_mpc.estimation.heading import HeadingReference, advance_heading
from bluefoot_mpc.estimation.inertial import (
    MOTION_SIZE,
    Motion,
    Sample,
    Strapdown,
    level_quaternion,
    usable_samples,
)
from bluefoot_mpc.estimation.joints import JointFilter, JointState, initial_joints
from bluefoot_mpc.estimation.level import LevelFloor, LevelState
from bluefoot_mpc.estimation.odometry import Odometry
from bluefoot_mpc.estimation.prediction import Prediction, Predictor
from bluefoot_mpc.estimation.rest import RestState, advance_rest, at_rest, correct_bias
from bluefoot_mpc.estimation.stance import Stance, StanceState
from bluefoot_mpc.model.legs import LegGeometry
from bluefoot_mpc.types import N_LEGS, BodyState, FloatArray, SensorFrame

BLIND_TILT = 0.3  # rad, deviation of a level start without any inertial sample
FIRST_FRAME = 0.02  # s, samples this old belong to the first frame
MAX_LAG = 0.015  # s, an inertial sensor whose newest sample is further behind has missed some
MIN_KNOWN_LEGS = 3
_STANDING = {
    legs: tuple(leg in legs for leg in range(N_LEGS))
    for n in range(N_LEGS + 1)
    for legs in itertools.combinations(range(N_LEGS), n)
}


class _Memory(NamedTuple):
    """All that the estimator remembers from one frame to the next."""

    time: float
    joints: JointState
    switches: SwitchState
    filter: FilterState
    stance: StanceState
    heading: HeadingReference
    level: LevelState
    rest: RestState
    sample: Sample | None
    report: FloatArray  # (32,) what `Odometry` gave
    imu_age: float  # s since the last usable inertial sample

    @property
    def position(self) -> FloatArray:
        """(3,) m, IMU in the odometry frame."""
        return self.report[0:3]

    @property
    def rate(self) -> FloatArray:
        """(3,) rad/s, base frame, bias removed."""
        return self.report[16:19]


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
        self._config = config
        self._joints = JointFilter(config.joint)
        self._strapdown = Strapdown()
        self._predictor = Predictor(geometry, config)
        self._settler = Settler()
        self._stance = Stance(config.contact, self._settler)
        self._odometry = Odometry(config.imu.mount)
        self._ground = GroundPlane(config.ground)
        self._level = LevelFloor(config.level, config.imu.accel_bias, self._settler)
        self._memory: _Memory | None = None
        self._lag = 0.0  # s, of the newest inertial sample behind its frame

    def reset(self) -> None:
        """Forget everything; the next frame is the first."""
        self._memory = None
        self._lag = 0.0
        self._ground.reset()

    @property
    def gyro_bias(self) -> FloatArray:
        """(3,) rad/s, estimated bias of the gyro in the base frame; zero before the first frame."""
        return np.zeros(3) if self._memory is None else self._memory.filter.estimate[19:22].copy()

    @property
    def covariance(self) -> FloatArray:
        """(26, 26) covariance of the filter's errors (see `filter`); empty before the first frame."""
        return np.zeros((0, 0)) if self._memory is None else self._memory.filter.covariance.copy()

    @property
    def feet_used(self) -> tuple[int, ...]:
        """Feet that corrected the filter on the last frame."""
        return () if self._memory is None else self._memory.stance.used

    @property
    def ground(self) -> GroundEstimate:
        """Slope of the plane under the feet that stood still, in the heading frame."""
        return self._ground.latest

    def step(self, frame: SensorFrame) -> BodyState:
        """Take one frame.

        Args:
            frame: what the sensors gave since the previous one. A frame that is
                not newer, or much newer, than the previous one counts as a jump
                of the clock: the estimate goes on from where it was, with doubt.
        """
        memory = self._memory
        frame = self._at_newest_sample(frame)
        dt = math.nan if memory is None else frame.time - memory.time
        if memory is None or not 0.0 < dt <= self._config.max_step:
            return self._start(frame, memory)
        return self._go_on(frame, memory, dt)

    def _at_newest_sample(self, frame: SensorFrame) -> SensorFrame:
        """The frame at the time of its newest inertial sample, to which everything else is carried.

        A sensor board's samples are some milliseconds on their way, and a sample that was taken before
        the last frame belongs to this one all the same.
        """
        times = frame.imu.time
        lag = frame.time - float(times[-1]) if len(times) else math.nan
        if 0.0 <= lag <= MAX_LAG:
            self._lag = lag
        return frame if self._lag == 0.0 else replace(frame, time=frame.time - self._lag)

    def _go_on(self, frame: SensorFrame, memory: _Memory, dt: float) -> BodyState:
        """A frame that follows the previous one."""
        joints, known = self._read_joints(frame, memory.joints, dt)
        debounce = self._config.contact.debounce
        switches = advance_switches(memory.switches, frame.contact, frame.contact_valid, dt, debounce)
        samples = usable_samples(frame.imu, memory.time, frame.time, memory.sample)
        before = memory.filter.estimate
        motion = self._strapdown.advance(before[:7], before[19:25], samples, (memory.time, frame.time))
        angles = (memory.rest.joints, memory.joints.newest, joints.newest)
        loose = lifting_feet(switches, self._config.contact.lifting)
        ahead = self._predictor.advance(memory.filter, motion, angles, loose, dt)
        standing = [closed and answers > 0.0 for closed, answers in zip(switches.closed, known, strict=True)]
        state, stance = self._stance.advance(ahead, memory.stance, standing, dt)
        firm = tuple([leg for leg in stance.used if not loose[leg]])
        rest = advance_rest(memory.rest, ahead.moved, joints.newest, dt, self._config.rest)
        state = self._correct_at_rest(state, rest, standing, samples)
        state, heading = self._correct_heading(state, memory.heading, frame, dt)
        state, level = self._correct_level(state, memory.level, firm, dt)
        report = self._odometry.advance(
            memory.position, before, state.estimate, ahead,
            used=firm, contact=switches.contact, rate=memory.rate, sums=motion.sums,
        )  # fmt: skip
        sample, age = (samples[-1], 0.0) if samples else (memory.sample, memory.imu_age + dt)
        self._memory = _Memory(
            frame.time, joints, switches, state, stance, heading, level, rest, sample, report, age
        )
        estimate = self._state(self._memory, known)
        self._ground.step(estimate, _STANDING[firm], dt)
        return estimate

    def _correct_at_rest(
        self, state: FilterState, rest: RestState, standing: list[bool], samples: list[Sample]
    ) -> FilterState:
        if not at_rest(rest, standing, samples, state, self._config.rest):
            return state
        return correct_bias(state, samples, self._config.rest, self._settler)

    def _correct_heading(
        self, state: FilterState, reference: HeadingReference, frame: SensorFrame, dt: float
    ) -> tuple[FilterState, HeadingReference]:
        config = self._config.heading
        if not config.enabled:
            return state, reference
        return advance_heading(state, reference, frame.imu, dt=dt, config=config, settler=self._settler)

    def _correct_level(
        self, state: FilterState, level: LevelState, firm: tuple[int, ...], dt: float
    ) -> tuple[FilterState, LevelState]:
        if not self._config.level.enabled:
            return state, level
        return self._level.advance(state, level, firm, self._ground.latest, dt)

    def _start(self, frame: SensorFrame, memory: _Memory | None) -> BodyState:
        """First frame, or the first after a jump of the clock (then with what was known)."""
        config = self._config
        joints, known = self._read_joints(frame, initial_joints(), 0.0)
        switches = advance_switches(initial_switches(), frame.contact, frame.contact_valid, 0.0, 0.0)
        samples = usable_samples(frame.imu, frame.time - FIRST_FRAME, frame.time, None)
        tilt = config.initial_tilt if samples else BLIND_TILT
        state = initial_state(level_quaternion(samples), tilt, config)
        if memory is not None:
            state = _doubtful(memory.filter, state)
        carried = np.zeros(MOTION_SIZE)
        carried[:7] = state.estimate[:7]
        ahead = self._predictor.advance(state, Motion(carried), (joints.newest,) * 3, [True] * 4, 0.0)
        state = self._stance.plant(state, ahead)
        place = np.zeros(3) if memory is None else memory.position
        report = self._report_at_start(state, ahead, place, switches)
        if memory is None:
            # The trunk starts above the frame's origin, and the IMU where that puts it.
            place = np.array((0.0, 0.0, report[19])) - report[3:6]
            report = self._report_at_start(state, ahead, place, switches)
        self._memory = _Memory(
            frame.time, joints, switches, state, StanceState(),
            HeadingReference() if memory is None else memory.heading, LevelState(),
            RestState(joints.newest, 0.0), samples[-1] if samples else None,
            report, 0.0 if memory is None else math.inf,
        )  # fmt: skip
        return self._state(self._memory, known)

    def _report_at_start(
        self, state: FilterState, ahead: Prediction, place: FloatArray, switches: SwitchState
    ) -> FloatArray:
        """Numbers of the body state without a motion, for an IMU at a place (m)."""
        return self._odometry.advance(
            place, state.estimate, state.estimate, ahead,
            used=(), contact=switches.contact, rate=np.zeros(3), sums=np.zeros(10),
        )  # fmt: skip

    def _read_joints(
        self, frame: SensorFrame, state: JointState, dt: float
    ) -> tuple[JointState, list[float]]:
        """Advance the joint filter; angles are carried from their reading to the time of the estimate."""
        delay = frame.time - frame.joint_time
        return self._joints.advance(state, frame.joint_position, frame.joint_valid, delay, dt)

    def _state(self, memory: _Memory, known: list[float]) -> BodyState:
        """The public record."""
        report = memory.report
        return BodyState(
            time=memory.time,
            position=report[3:6],
            quaternion=report[6:10],
            rpy=report[10:13],
            linear_velocity=report[13:16],
            angular_velocity=report[16:19],
            joint_position=memory.joints.newest,
            joint_velocity=memory.joints.velocity,
            contact=np.array(memory.switches.contact),
            foot_position_in_base=report[20:32].reshape(N_LEGS, 3),
            height=float(report[19]),
            healthy=memory.imu_age <= self._config.imu.lost_after and sum(known) >= MIN_KNOWN_LEGS,
        )


def _doubtful(before: FilterState, fresh: FilterState) -> FilterState:
    """What may be kept across a gap of unknown length: attitude and biases, the first with doubt."""
    estimate, covariance = fresh.estimate.copy(), fresh.covariance.copy()
    estimate[0:4] = before.estimate[0:4]
    estimate[19:] = before.estimate[19:]
    covariance[18:, 18:] = before.covariance[18:, 18:]
    covariance[2, 2] += before.covariance[2, 2] + fresh.covariance[0, 0]
    return FilterState(estimate, covariance)
