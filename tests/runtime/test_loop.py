import os
import re
import signal
from dataclasses import replace

import numpy as np
import pytest

from bluefoot_mpc.control.pipeline import ControlOutput, Pipeline
from bluefoot_mpc.io.safety import SafetyConfig, SafetySupervisor
from bluefoot_mpc.model.robot import load_robot
from bluefoot_mpc.runtime.log import read_log
from bluefoot_mpc.runtime.loop import INTERRUPTED, LoopHooks, run_loop
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.walking import Push, Walk
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.types import Mode

pytestmark = pytest.mark.slow


class SpyRobot(SimRobot):
    """The simulated robot, remembering what reached it."""

    def __init__(self, *args):
        self.sent = []
        self.stopped = 0
        super().__init__(*args)

    def step(self, command):
        self.sent.append(command)
        return super().step(command)

    def stop(self):
        self.stopped += 1
        super().stop()


class BrokenController:
    """The real pipeline until a given tick; then `break_it` has its way."""

    def __init__(self, pipeline, tick, break_it):
        self.pipeline, self.tick, self.break_it, self.count = pipeline, tick, break_it, 0

    def reset(self):
        self.pipeline.reset()

    def step(self, frame, motion, safety):
        output = self.pipeline.step(frame, motion, safety)
        self.count += 1
        return self.break_it(output) if self.count > self.tick else output


@pytest.fixture(scope="module")
def model():
    return load_robot()


@pytest.fixture
def resolved():
    return resolve(Walk, RunOptions(duration=6.0))


@pytest.fixture
def setup(model, resolved):
    robot = SpyRobot(model, resolved.stages.sim, 0)
    supervisor = SafetySupervisor(robot, model.lower, model.upper, SafetyConfig())
    return robot, supervisor, Pipeline(model, resolved.stages.control, robot.period)


def run(setup, controller, source, **hooks):
    robot, supervisor, _ = setup
    return run_loop(supervisor, controller, source, LoopHooks(truth=robot.truth, **hooks), {})


def test_a_run_ends_when_the_source_does_and_the_robot_is_stopped(setup, resolved):
    robot, _, pipeline = setup
    data = run(setup, pipeline, resolved.scenario.source)
    assert data.stop_reason == "completed"
    assert len(data.frames) == len(data.commands) == len(data.telemetry) == len(data.truth) == 300
    assert robot.stopped == 1
    assert data.telemetry[-1].mode is Mode.WALK
    assert all(telemetry.tick_us > 0.0 for telemetry in data.telemetry)


def test_an_exception_in_the_controller_lowers_the_robot_and_keeps_the_log(setup, resolved, tmp_path):
    robot, _, pipeline = setup

    def fail(output: ControlOutput) -> ControlOutput:
        raise ZeroDivisionError("gait of nothing")

    with Recorder(tmp_path / "log.mcap", {}, robot.period) as recorder:
        data = run(setup, BrokenController(pipeline, 150, fail), resolved.scenario.source, recorder=recorder)
    assert data.stop_reason == "controller error: ZeroDivisionError: gait of nothing"
    torque = np.array([command.torque_limit.max() for command in robot.sent])
    assert np.all(np.diff(torque[150:]) < 0.0)  # taken away gently
    assert torque[-1] == 0.0
    assert robot.stopped == 1
    log = read_log(tmp_path / "log.mcap")
    assert not log.truncated
    assert len(log.telemetry) == 150
    # The trunk sinks; it is never dropped.
    assert robot.truth().q[2] > 0.03


def test_what_breaks_beside_the_controller_does_not_drop_the_robot_either(setup, resolved):
    robot, _, pipeline = setup

    def full_disk(frame, output, truth):
        if frame.time > 3.0:
            raise OSError("no space left")

    with pytest.raises(OSError, match="no space left"):
        run(setup, pipeline, resolved.scenario.source, observers=(full_disk,))
    torque = np.array([command.torque_limit.max() for command in robot.sent])
    ramp = torque[np.flatnonzero(torque < 1.0)[0] :]
    assert len(ramp) == 50
    assert np.all(np.diff(ramp) < 0.0)
    assert ramp[-1] == 0.0
    assert robot.stopped == 1


@pytest.mark.parametrize("field", ["position", "torque_limit"])
def test_nan_from_the_controller_never_reaches_the_robot_and_ends_in_safe_mode(setup, resolved, field):
    robot, _, pipeline = setup

    def poison(output: ControlOutput) -> ControlOutput:
        bad = np.full(16, np.nan)
        return replace(output, command=replace(output.command, **{field: bad}))

    data = run(setup, BrokenController(pipeline, 150, poison), resolved.scenario.source)
    assert robot.discarded_commands == 0
    assert all(np.isfinite(command.position).all() for command in robot.sent)
    assert data.telemetry[-1].mode is Mode.SAFE
    assert "not finite" in " ".join(data.commands[-1].safety.reasons)


def test_one_nan_tick_stops_the_walk_and_sits_down_safely(setup, resolved):
    _, _, pipeline = setup
    ticks = iter(range(10_000))

    def poison_once(output: ControlOutput) -> ControlOutput:
        if next(ticks) == 0:
            return replace(output, command=replace(output.command, position=np.full(16, np.nan)))
        return output

    source = resolved.scenario.with_duration(12.0).source
    data = run(setup, BrokenController(pipeline, 150, poison_once), source)
    assert data.stop_reason.startswith("stopped at")
    assert "not finite" in data.stop_reason
    assert data.telemetry[-1].mode is Mode.SAFE
    tilt = np.abs([telemetry.estimate.rpy[:2] for telemetry in data.telemetry]).max()
    assert tilt < np.radians(15.0)  # it sat down, it did not fall
    assert data.commands[-1].joints.torque_limit.max() == 0.0


def test_ctrl_c_ends_the_gait_sits_and_goes_limp(setup):
    robot, _, pipeline = setup
    walk = Walk()

    def interrupt(frame, output, truth):
        if abs(frame.time - 3.0) < 0.5 * robot.period:
            os.kill(os.getpid(), signal.SIGINT)

    handler = signal.getsignal(signal.SIGINT)
    data = run(setup, pipeline, walk.source, observers=(interrupt,))
    assert data.stop_reason == INTERRUPTED
    assert signal.getsignal(signal.SIGINT) is handler
    assert data.telemetry[-1].mode is Mode.OFF
    assert data.commands[-1].joints.torque_limit.max() == 0.0
    assert robot.stopped == 1
    assert 3.0 < data.frames[-1].time < 12.0


@pytest.mark.parametrize(
    ("broken", "told"),
    [
        (lambda: 1 / 0, "scenario error: ZeroDivisionError: division by zero"),
        (lambda: 5, "scenario error: TypeError: the command must be a MotionCommand, .* not 5"),
    ],
)
def test_a_scenario_that_breaks_brings_the_robot_to_rest_and_keeps_the_log(setup, broken, told, tmp_path):
    robot, _, pipeline = setup
    walk = Walk()

    def source(time):
        return walk.source(time) if time < 3.0 else broken()

    with Recorder(tmp_path / "log.mcap", {}, robot.period) as recorder:
        data = run(setup, pipeline, source, recorder=recorder)
    assert re.fullmatch(told, data.stop_reason)
    assert data.telemetry[-1].mode is Mode.OFF
    assert data.commands[-1].joints.torque_limit.max() == 0.0
    assert robot.stopped == 1
    assert 3.0 < data.frames[-1].time < 12.0
    assert len(read_log(tmp_path / "log.mcap").frames) == len(data.frames)


def test_a_closed_terminal_ends_the_run_like_ctrl_c_but_not_under_nohup(setup):
    _, _, pipeline = setup
    walk = Walk().with_duration(4.0)

    def hang_up(frame, output, truth):
        if abs(frame.time - 2.0) < 0.01:
            os.kill(os.getpid(), signal.SIGHUP)

    # Tests may themselves run under nohup.
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    try:
        assert run(setup, pipeline, walk.source, observers=(hang_up,)).stop_reason == INTERRUPTED
        signal.signal(signal.SIGHUP, signal.SIG_IGN)
        assert run(setup, pipeline, walk.source, observers=(hang_up,)).stop_reason == "completed"
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_fall_makes_the_robot_limp_and_ends_the_run(model, resolved):
    options = RunOptions(impulse=30.0, direction=90.0, push_time=3.0, duration=8.0)
    pushed = resolve(Push, options)
    robot = SpyRobot(model, pushed.stages.sim, 0)
    supervisor = SafetySupervisor(robot, model.lower, model.upper, SafetyConfig())
    pipeline = Pipeline(model, pushed.stages.control, robot.period)
    data = run((robot, supervisor, pipeline), pipeline, pushed.scenario.source)
    assert data.stop_reason.startswith("stopped at 3.")
    assert "tilted" in data.stop_reason
    assert robot.sent[-1].torque_limit.max() == 0.0
    assert data.frames[-1].time < 6.0
