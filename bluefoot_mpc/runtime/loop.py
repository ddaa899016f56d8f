"""The control loop, the same for every robot: frame in, command out, nothing lost.

Whatever goes wrong in a tick, the robot sinks under torque before it is made
limp, and what was recorded stays. A run that ends lets a robot with power end
its gait and sit down before it goes limp; a simulation simply ends.
"""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from bluefoot_mpc.control.pipeline import ControlOutput
from bluefoot_mpc.io.safety import ArmingInterruptedError, SafetyState, SafetySupervisor
from bluefoot_mpc.runtime.data import COMPLETED, CommandRecord, RunData
from bluefoot_mpc.runtime.garbage import YoungCollection
from bluefoot_mpc.runtime.interruption import interruptible
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.types import (
    N_JOINTS,
    JointCommand,
    Mode,
    MotionCommand,
    SafetyRequest,
    SensorFrame,
    Telemetry,
    TruthSample,
)

log = logging.getLogger(__name__)

INTERRUPTED = "interrupted"
AFTER_FALL = 1.0
"""s that are still recorded after a fall, limp."""
REST_TIMEOUT = 6.0
"""s that a robot gets to end its gait, sit and go limp when its run is cut short."""
_REST = MotionCommand(mode=Mode.OFF)
RAMP_DOWN = 1.0
"""s over which torque is taken away when the controller itself has failed."""


class Controller(Protocol):
    """What the loop needs of a controller."""

    def reset(self) -> None:
        """Forget everything."""
        ...

    def step(self, frame: SensorFrame, motion: MotionCommand, safety: SafetyRequest) -> ControlOutput:
        """One tick."""
        ...


CommandSource = Callable[[float], MotionCommand | None]
"""Wanted motion at a time since the start (s); None ends the run."""

Observer = Callable[[SensorFrame, ControlOutput, TruthSample | None], None]


@dataclass(kw_only=True, slots=True)
class LoopHooks:
    """What may watch a run.

    Attributes:
        recorder: writes the log.
        truth: the simulator's truth, for the record only.
        observers: called after every tick (live view, progress).
        rests: the robot sits down at the end of a run, as it does when one is cut short.
    """

    recorder: Recorder | None = None
    truth: Callable[[], TruthSample] | None = None
    observers: tuple[Observer, ...] = ()
    rests: bool = False


def run_loop(
    robot: SafetySupervisor,
    controller: Controller,
    source: CommandSource,
    hooks: LoopHooks,
    config: dict[str, Any],
) -> RunData:
    """Run a controller on a robot until the source ends, the robot falls or someone stops it.

    Args:
        robot: the supervised robot.
        controller: the controller.
        source: wanted motion over time.
        hooks: recorder, truth and observers.
        config: everything resolved, for the record.
    """
    data = RunData(period=robot.period, config=config)
    started = time.perf_counter()
    with interruptible(robot.interrupt) as interrupted, YoungCollection() as garbage:
        try:
            controller.reset()
            frame = robot.reset()
            hooks = replace(hooks, observers=(*hooks.observers, lambda *_: garbage.tick()))
            data.stop_reason = _ticks(robot, controller, source, hooks, data, frame, interrupted)
        except ArmingInterruptedError:
            if not interrupted.is_set():
                raise
            data.stop_reason = INTERRUPTED
        finally:
            robot.stop()
    elapsed = time.perf_counter() - started
    if data.frames and elapsed > 0.0:
        data.real_time_factor = (data.frames[-1].time - data.frames[0].time) / elapsed
    return data


def _ticks(
    robot: SafetySupervisor,
    controller: Controller,
    source: CommandSource,
    hooks: LoopHooks,
    data: RunData,
    frame: SensorFrame,
    interrupted: threading.Event,
) -> str:
    start = frame.time
    ending = _Ending()
    misses = warned = 0
    while True:
        now = frame.time - start
        motion = _wanted(source, now, ending, interrupted, hooks.rests)
        if motion is None:
            return COMPLETED
        safety = robot.request
        tick_start = time.perf_counter_ns()
        try:
            output = controller.step(frame, motion, safety)
        except Exception as error:  # The boundary that keeps a robot standing when its controller breaks.
            log.exception("the controller failed at %.2f s", frame.time)
            _ramp_down(robot, data, frame, hooks.rests)
            return f"controller error: {type(error).__name__}: {error}"
        tick_us = (time.perf_counter_ns() - tick_start) * 1e-3
        telemetry = _timed(output.telemetry, tick_us, robot.period, misses)
        if len(robot.warnings) > warned:
            telemetry = replace(telemetry, events=(*telemetry.events, *robot.warnings[warned:]))
        misses, warned = telemetry.deadline_misses, len(robot.warnings)
        output = ControlOutput(command=output.command, telemetry=telemetry)
        try:
            _record(data, hooks, frame, motion, safety, output)
        except Exception:  # A full disk or a broken viewer is no reason to drop the robot.
            _ramp_down(robot, data, frame, hooks.rests)
            raise
        frame = robot.step(output.command)
        reason = ending.reason(robot, telemetry.mode, motion.mode if hooks.rests else None, now)
        if reason is not None:
            if hooks.rests:
                # Whoever has not come to rest in time is lowered, not dropped; one that is off stays so.
                robot.controlled_stop("the controller has not brought the robot to rest in time")
            return reason or _safe_reason(data)


@dataclass(kw_only=True, slots=True)
class _Ending:
    """How a run comes to its end.

    Attributes:
        cut_short: why the robot is being brought to rest; None while the run goes on.
        resting_since: s, since when.
        stopping_since: s, since when the controller is in its safe mode.
    """

    cut_short: str | None = None
    resting_since: float = float("inf")
    stopping_since: float = float("inf")

    def begin(self, why: str, now: float) -> None:
        """Bring the robot to rest."""
        self.cut_short = why
        self.resting_since = now

    def reason(self, robot: SafetySupervisor, mode: Mode, wanted: Mode | None, now: float) -> str | None:
        """Why the run is over now, empty where the controller's account tells it; None while it is not.

        Args:
            robot: the supervised robot.
            mode: that the controller is in.
            wanted: mode that was asked for; None for a robot that need not be armed.
            now: s since the start.
        """
        if robot.state is SafetyState.EMERGENCY:
            told = (reason for reason in robot.request.reasons if reason.startswith("emergency"))
            return next(told, "emergency stop")
        if mode is Mode.SAFE:
            self.stopping_since = min(self.stopping_since, now)
            if robot.limp and now - self.stopping_since >= AFTER_FALL:
                return ""
        if self.cut_short is None:
            if wanted is None or not robot.stopped:
                return None
            return COMPLETED if wanted is Mode.OFF else ""
        return self.cut_short if robot.limp or now - self.resting_since > REST_TIMEOUT else None


def _wanted(
    source: CommandSource, now: float, ending: _Ending, interrupted: threading.Event, rests: bool
) -> MotionCommand | None:
    """The motion of this tick, rest once the run is being ended; None where it simply ends."""
    if ending.cut_short is None and interrupted.is_set():
        ending.begin(INTERRUPTED, now)
    if ending.cut_short is not None:
        return _REST
    motion, failure = _ask(source, now)
    if failure is not None:
        ending.begin(failure, now)
    elif motion is None and rests:
        ending.begin(COMPLETED, now)
        return _REST
    return motion


def _timed(telemetry: Telemetry, tick_us: float, period: float, misses: int) -> Telemetry:
    """The tick's account with its time, and the count of late ticks."""
    return replace(telemetry, tick_us=tick_us, deadline_misses=misses + (tick_us > 1e6 * period))


def _ask(source: CommandSource, now: float) -> tuple[MotionCommand | None, str | None]:
    """The wanted motion, or rest and the reason why the run must end: scenarios are users' code."""
    try:
        motion = source(now)
        if motion is not None and not isinstance(motion, MotionCommand):
            raise TypeError(f"the command must be a MotionCommand, or None to end the run, not {motion!r}")
    except Exception as error:
        log.exception("the scenario failed at %.2f s", now)
        return _REST, f"scenario error: {type(error).__name__}: {error}"
    return motion, None


def _record(
    data: RunData,
    hooks: LoopHooks,
    frame: SensorFrame,
    motion: MotionCommand,
    safety: SafetyRequest,
    output: ControlOutput,
) -> None:
    truth = hooks.truth() if hooks.truth is not None else None
    # Pictures are in the log, a few of them kept; an hour of them would not fit into memory.
    data.keep_picture(frame, output.telemetry)
    data.frames.append(frame if frame.camera is None else replace(frame, camera=None))
    data.commands.append(CommandRecord(time=frame.time, motion=motion, safety=safety, joints=output.command))
    data.telemetry.append(output.telemetry)
    if truth is not None:
        data.truth.append(truth)
    if hooks.recorder is not None:
        hooks.recorder.frame(frame)
        hooks.recorder.command(motion, output.command, safety)
        hooks.recorder.telemetry(output.telemetry)
        if truth is not None:
            hooks.recorder.truth(truth)
    for observer in hooks.observers:
        observer(frame, output, truth)


def _ramp_down(robot: SafetySupervisor, data: RunData, frame: SensorFrame, rests: bool) -> None:
    """Lower the body without its controller; where it need not sit down, torque is just taken away."""
    if rests:
        robot.controlled_stop("the controller has failed")
        return
    last = data.commands[-1].joints.position if data.commands else frame.joint_position
    # Goals that are not finite would make the supervisor hold at full torque to the end.
    goal = np.where(np.isfinite(last), last, np.nan_to_num(frame.joint_position))
    steps = max(1, round(RAMP_DOWN / robot.period))
    for step in range(steps):
        limit = np.full(N_JOINTS, 1.0 - (step + 1) / steps)
        robot.step(JointCommand(position=goal, speed=np.zeros(N_JOINTS), torque_limit=limit))


def _safe_reason(data: RunData) -> str:
    for telemetry in data.telemetry:
        for event in telemetry.events:
            if "-> safe" in event:
                return (
                    f"stopped at {telemetry.time:.2f} s: {event.split('-> safe', 1)[1].strip() or 'unknown'}"
                )
    return "stopped"
