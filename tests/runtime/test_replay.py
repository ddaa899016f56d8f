"""A log as a robot, and as a test of the controller."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.runtime.data import CommandRecord, RunData
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.runtime.replay import ReplayRobot, Step, rethink
from bluefoot_mpc.types import JOINTS, JointCommand, MotionCommand, SafetyRequest, SensorFrame
from tests.runtime.made_up_run import CONFIG, frames_of, make_run, record_ticks, same


class Filter:
    """A controller with memory, whose answer depends on everything that it is told."""

    def __init__(self, gain: float = 0.3) -> None:
        self.gain = gain
        self.state = np.zeros(16)

    def step(self, frame: SensorFrame, motion: MotionCommand, safety: SafetyRequest) -> JointCommand:
        self.state = self.state + self.gain * (frame.joint_position - self.state)
        speed = np.full(16, motion.velocity[0] + frame.imu.gyro.sum())
        return JointCommand(
            position=self.state, speed=speed, torque_limit=np.full(16, 1.0 - safety.level / 3)
        )


def make_filter() -> Step:
    return Filter().step


@pytest.fixture
def log(tmp_path: Path) -> RunData:
    """A recorded run of the filter."""
    run, controller = make_run(80), Filter()
    for k, (frame, record) in enumerate(zip(run.frames, run.commands, strict=True)):
        joints = controller.step(frame, record.motion, record.safety)
        run.commands[k] = CommandRecord(
            time=frame.time, motion=record.motion, safety=record.safety, joints=joints
        )
    with Recorder(tmp_path / "log.mcap", CONFIG) as recorder:
        record_ticks(recorder, run)
    return read_log(tmp_path / "log.mcap")


def test_the_same_controller_thinks_the_same(log: RunData) -> None:
    report = rethink(log, make_filter)
    assert report.equal
    assert (report.ticks, report.max_difference, report.first) == (80, 0.0, None)
    assert str(report) == "all 80 commands are equal, bit for bit"


def test_another_controller_is_seen(log: RunData) -> None:
    report = rethink(log, lambda: Filter(0.3 + 1e-12).step)
    assert not report.equal
    assert 0.0 < report.max_difference < 1e-9
    assert report.first is not None
    assert report.first.time == 0.0
    assert (report.first.joint, report.first.quantity) == (JOINTS[0], "position")
    assert "first at 0.000 s: FL_hip_yaw position was" in str(report)


def test_one_bit_of_one_joint_is_found(log: RunData) -> None:
    record = log.commands[33]
    limit = record.joints.torque_limit.copy()
    limit[9] = np.nextafter(limit[9], 2.0)
    log.commands[33] = replace(record, joints=replace(record.joints, torque_limit=limit))
    report = rethink(log, make_filter)
    assert report.differing == 1
    assert report.max_difference == 0.0
    assert report.first is not None
    assert (report.first.time, report.first.joint) == (log.frames[33].time, JOINTS[9])
    assert report.first.quantity == "torque_limit"


def test_nan_equals_nan_and_nothing_else(log: RunData) -> None:
    log.frames[-1].joint_position[3] = np.nan
    record = log.commands[-1]
    report = rethink(log, make_filter)
    assert report.differing == 1
    assert report.max_difference == np.inf
    position = record.joints.position.copy()
    position[3] = np.nan
    log.commands[-1] = replace(record, joints=replace(record.joints, position=position))
    assert rethink(log, make_filter).equal


def test_a_stopped_run_may_lack_its_last_command(log: RunData) -> None:
    del log.commands[-1]
    assert rethink(log, make_filter).ticks == 79


def test_frames_and_commands_must_belong_together(log: RunData) -> None:
    del log.frames[5]
    with pytest.raises(LogError, match=r"no command for the frame at 0\.120 s"):
        rethink(log, make_filter)
    with pytest.raises(LogError, match="holds no commands"):
        rethink(RunData(), make_filter)


def test_a_log_is_a_robot(log: RunData) -> None:
    robot = ReplayRobot(log)
    assert isinstance(robot, Robot)
    command = JointCommand(position=np.zeros(16), speed=np.zeros(16), torque_limit=np.zeros(16))
    for _ in range(2):
        frames = [robot.reset()]
        while not robot.finished:
            frames.append(robot.step(command))
        assert all(map(same, frames, frames_of(log)))
        assert len(frames) == 80
    with pytest.raises(LogError, match=r"ends at 1\.580 s"):
        robot.step(command)
    robot.stop()
    robot.close()
    with pytest.raises(LogError, match="no sensor frames"):
        ReplayRobot(RunData())
