"""Sensors that fail while the robot walks: it slows down or stands, and never falls."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.pipeline import BLIND
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.types import ImuBatch, Mode, MotionCommand, SafetyLevel, SensorFrame, TrunkPose
from tests.control.closed_loop import Trace, after, mode, play, walk

pytestmark = pytest.mark.slow

FR = slice(4, 8)


@pytest.fixture(scope="module")
def model():
    return load_robot()


def silent_imu(frame: SensorFrame) -> SensorFrame:
    none = np.zeros((0, 3))
    empty = ImuBatch(
        time=np.zeros(0), gyro=none, accel=none, magnetometer=none, valid=np.zeros(0, dtype=bool)
    )
    return replace(frame, imu=empty)


def nan_imu(frame: SensorFrame) -> SensorFrame:
    nan = np.full_like(frame.imu.gyro, np.nan)
    return replace(frame, imu=replace(frame.imu, gyro=nan, accel=nan, magnetometer=nan))


def frozen_imu(frame: SensorFrame) -> SensorFrame:
    same = {name: np.full_like(frame.imu.gyro, 0.1) for name in ("gyro", "accel", "magnetometer")}
    return replace(frame, imu=replace(frame.imu, **same))


def silent_leg(frame: SensorFrame) -> SensorFrame:
    position, valid = frame.joint_position.copy(), frame.joint_valid.copy()
    position[FR], valid[FR] = np.nan, False
    return replace(frame, joint_position=position, joint_valid=valid)


def silent_joints(frame: SensorFrame) -> SensorFrame:
    return replace(frame, joint_valid=np.zeros(16, dtype=bool))


def stuck_switch(leg: int, value: bool):
    def fault(frame: SensorFrame) -> SensorFrame:
        contact = frame.contact.copy()
        contact[leg] = value
        return replace(frame, contact=contact)

    return fault


def clock_ahead(seconds: float):
    def fault(frame: SensorFrame) -> SensorFrame:
        return replace(
            frame,
            time=frame.time + seconds,
            joint_time=frame.joint_time + seconds,
            contact_time=frame.contact_time + seconds,
            imu=replace(frame.imu, time=frame.imu.time + seconds),
        )

    return fault


def commanded_speed(trace: Trace) -> np.ndarray:
    return np.array([np.hypot(*output.telemetry.motion.velocity) for output in trace.outputs])


def attitude_error_deg(trace: Trace) -> np.ndarray:
    estimate = np.array([output.telemetry.estimate.rpy[:2] for output in trace.outputs])
    return np.degrees(np.abs(estimate - trace.rpy[:, :2]).max(axis=1))


@pytest.mark.parametrize("fault", [silent_imu, nan_imu, frozen_imu])
@pytest.mark.parametrize("gait", ["trot", "walk"])
def test_the_robot_does_not_walk_on_while_its_imu_is_lost(model, gait, fault):
    trace = play(model, lambda t: walk(0.06, gait=gait), 8.0, fault=(fault, 3.0, 3.3))
    speed = commanded_speed(trace)
    assert np.all(speed[trace.between(3.14, 3.3)] == 0.0)
    assert np.all(speed[trace.between(3.4, 8.0)] == 0.06)
    assert trace.events.count(BLIND) == 1
    assert trace.tilt_deg.max() < 2.0
    error = attitude_error_deg(trace)
    assert error[trace.between(2.0, 8.0)].max() < 2.5  # the feet alone do not see it all
    assert error[trace.between(5.0, 8.0)].max() < 0.5
    assert np.diff(trace.position[trace.between(5.0, 8.0), 0][[0, -1]])[0] > 0.12


def test_an_imu_that_stays_away_ends_the_walk_on_four_feet_and_tilts_nothing(model):
    trace = play(model, lambda t: walk(0.08), 9.0, fault=(silent_imu, 3.0, 7.0))
    inside = trace.between(5.0, 9.0)
    assert not trace.swing[inside].any()
    assert np.ptp(trace.position[inside, :2], axis=0).max() < 0.005
    assert trace.tilt_deg.max() < 1.5
    assert trace.modes == [Mode.STAND, Mode.WALK, Mode.SIT]  # and sits, until somebody asks anew


@pytest.mark.parametrize("gait", ["trot", "walk"])
def test_a_leg_that_does_not_answer_for_a_moment_is_walked_over(model, gait):
    # A quarter of the readings for 0.38 s: less than a fifth of those of half a second.
    trace = play(model, lambda t: walk(0.06, gait=gait), 7.0, fault=(silent_leg, 3.0, 3.38))
    assert trace.tilt_deg.max() < 2.0
    assert attitude_error_deg(trace)[trace.between(2.0, 7.0)].max() < 0.6
    assert trace.modes == [Mode.STAND, Mode.WALK]
    assert np.isfinite([output.command.position for output in trace.outputs]).all()
    assert np.diff(trace.position[trace.between(4.0, 7.0), 0][[0, -1]])[0] == pytest.approx(0.18, abs=0.035)


def test_a_leg_that_stays_silent_makes_the_robot_sit_and_it_gets_up_again(model):
    trace = play(model, lambda t: walk(0.06), 9.0, fault=(silent_leg, 3.0, 6.0))
    assert trace.modes == [Mode.STAND, Mode.WALK, Mode.SIT, Mode.STAND, Mode.WALK]
    assert trace.tilt_deg.max() < 2.0
    assert not trace.fell


def test_no_joint_answers_for_half_a_second(model):
    trace = play(model, lambda t: walk(0.06), 7.0, fault=(silent_joints, 3.0, 3.5))
    assert trace.events.count(BLIND) == 1
    assert np.all(commanded_speed(trace)[trace.between(3.14, 3.5)] == 0.0)
    assert trace.tilt_deg.max() < 2.0


@pytest.mark.parametrize("value", [True, False])
@pytest.mark.parametrize("leg", [0, 3])
def test_a_stuck_foot_switch_hardly_matters(model, leg, value):
    trace = play(model, lambda t: walk(0.06), 8.0, fault=(stuck_switch(leg, value), 0.0, math.inf))
    assert trace.tilt_deg.max() < 1.5
    assert attitude_error_deg(trace)[trace.between(2.0, 8.0)].max() < 0.8
    assert np.diff(trace.position[trace.between(3.0, 8.0), 0][[0, -1]])[0] == pytest.approx(0.3, rel=0.1)


@pytest.mark.parametrize("seconds", [0.5, -0.5, 1000.0])
def test_a_clock_that_jumps_costs_one_tick(model, seconds):
    trace = play(model, lambda t: walk(0.06), 7.0, fault=(clock_ahead(seconds), 3.0, math.inf))
    healthy = [output.telemetry.estimate.healthy for output in trace.outputs]
    assert healthy.count(False) == 1
    assert trace.tilt_deg.max() < 1.5
    assert attitude_error_deg(trace)[trace.between(5.0, 7.0)].max() < 0.6
    assert trace.outputs[-1].telemetry.time == pytest.approx(trace.truth[-1].time + seconds)


def test_a_servo_that_does_not_answer_at_the_start_does_not_stop_the_robot(model):
    trace = play(model, lambda t: walk(0.06), 4.0, fault=(silent_leg, -1.0, 0.01))
    assert np.isfinite([output.command.position for output in trace.outputs]).all()
    assert trace.safety.request.level is SafetyLevel.NONE
    assert trace.position[-1, 0] > 0.12
    assert trace.tilt_deg.max() < 1.5


@pytest.mark.parametrize("bad", [math.nan, math.inf])
def test_a_command_that_is_not_finite_makes_the_robot_stand(model, bad):
    pose = TrunkPose(position=np.array([0.0, 0.0, bad]), rpy=np.zeros(3))
    broken = MotionCommand(mode=Mode.WALK, velocity=np.array([bad, 0.0]), yaw_rate=bad, trunk=pose)
    raised = walk(0.06, position=[0.0, 0.0, 0.01])
    trace = play(model, after((0.0, raised), (3.0, broken), (5.0, raised)), 7.0)
    assert not trace.swing[trace.between(4.5, 5.0)].any()
    assert trace.swing[trace.between(5.2, 6.0)].any()
    assert trace.height[trace.between(3.0, 7.0)].min() > 0.127  # where the last good command put it
    assert len([event for event in trace.events if "not finite" in event]) == 2
    assert trace.tilt_deg.max() < 1.5


def test_the_wrapper_lies_only_in_its_time(model):
    trace = play(model, lambda t: mode(Mode.STAND), 0.2, fault=(silent_imu, 0.05, 0.1))
    counts = np.array([len(frame.imu.time) for frame in trace.frames])
    np.testing.assert_array_equal(counts == 0, trace.between(0.05, 0.1))
