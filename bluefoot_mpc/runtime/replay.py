"""Recorded runs once more: as a robot, or as a test of today's controller."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.exceptions import LogError
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.log import RunLog
from bluefoot_mpc.types import JOINTS, JointCommand, MotionCommand, SafetyRequest, SensorFrame

Step = Callable[[SensorFrame, MotionCommand, SafetyRequest], JointCommand]
"""One tick of a controller."""

_QUANTITIES = ("position", "speed", "torque_limit")


@dataclass(frozen=True, kw_only=True, slots=True)
class CommandDifference:
    """One number of a command that came out otherwise.

    Attributes:
        time: s, time of the frame.
        joint: name of the joint.
        quantity: ``position`` (rad), ``speed`` (rad/s) or ``torque_limit``.
        recorded: what the log holds.
        rethought: what the controller says today.
    """

    time: float
    joint: str
    quantity: str
    recorded: float
    rethought: float


@dataclass(frozen=True, kw_only=True, slots=True)
class RethinkReport:
    """How today's commands compare with the recorded ones.

    Attributes:
        ticks: number of commands compared.
        differing: number of ticks on which any number differs in any bit.
        max_difference: rad, largest difference of a goal position (NaN against a number counts as infinite).
        first: the first number that differs, None when all are equal.
    """

    ticks: int
    differing: int
    max_difference: float
    first: CommandDifference | None

    @property
    def equal(self) -> bool:
        """True when every command is bit-equal."""
        return self.differing == 0

    def __str__(self) -> str:
        if self.first is None:
            return f"all {self.ticks} commands are equal, bit for bit"
        f = self.first
        return (
            f"{self.differing} of {self.ticks} commands differ, by up to {self.max_difference:.3g} rad; "
            f"first at {f.time:.3f} s: {f.joint} {f.quantity} was {f.recorded:.9g}, is {f.rethought:.9g}"
        )


def rethink(log: RunData, make_step: Callable[[], Step]) -> RethinkReport:
    """Run a controller on the recorded frames and inputs and compare its commands.

    Args:
        log: a recorded run.
        make_step: makes the controller, in the state in which a run starts, and
            returns its tick.

    Raises:
        LogError: the log holds no commands, or frames and commands do not belong together.
    """
    if not log.commands:
        raise LogError("the log holds no commands to compare with")
    step = make_step()
    differing, largest, first = 0, 0.0, None
    ticks, frame_at = min(len(log.frames), len(log.commands)), _frame_at(log)
    for index, record in enumerate(log.commands[:ticks]):
        frame = frame_at(index)
        if frame.time != record.time:
            raise LogError(f"the log is damaged: no command for the frame at {frame.time:.3f} s")
        answer = step(frame, record.motion, record.safety)
        difference = _first_difference(record.time, record.joints, answer)
        if difference is not None:
            differing += 1
            first = first or difference
            largest = max(largest, _distance(record.joints, answer))
    return RethinkReport(ticks=ticks, differing=differing, max_difference=largest, first=first)


def _frame_at(log: RunData) -> Callable[[int], SensorFrame]:
    """What gives the frames as the controller got them, with the pictures that a log has packed."""
    return log.frame if isinstance(log, RunLog) else log.frames.__getitem__


def _first_difference(
    time: float, recorded: JointCommand, rethought: JointCommand
) -> CommandDifference | None:
    for quantity in _QUANTITIES:
        old, new = getattr(recorded, quantity), getattr(rethought, quantity)
        if not np.array_equal(old, new, equal_nan=True):
            joint = int(np.flatnonzero(~((old == new) | (np.isnan(old) & np.isnan(new))))[0])
            return CommandDifference(
                time=time,
                joint=JOINTS[joint],
                quantity=quantity,
                recorded=float(old[joint]),
                rethought=float(new[joint]),
            )
    return None


def _distance(a: JointCommand, b: JointCommand) -> float:
    both_unknown = np.isnan(a.position) & np.isnan(b.position)
    distance = np.where(both_unknown, 0.0, np.abs(a.position - b.position))
    return float(np.nan_to_num(distance, nan=np.inf).max())


class ReplayRobot:
    """A robot that lives its recorded run again, whatever it is told.

    Args:
        log: a recorded run with at least one frame.

    Raises:
        LogError: the log holds no frames.
    """

    def __init__(self, log: RunData) -> None:
        if not log.frames:
            raise LogError("the log holds no sensor frames to replay")
        self.period = log.period
        self._frames, self._frame_at = log.frames, _frame_at(log)
        self._next = 0

    @property
    def finished(self) -> bool:
        """True when the last recorded frame has been given."""
        return self._next >= len(self._frames)

    def reset(self) -> SensorFrame:
        """Go back to the first recorded frame."""
        self._next = 0
        return self._advance()

    def step(self, command: JointCommand) -> SensorFrame:
        """Ignore the command and return the next recorded frame.

        Raises:
            LogError: there is none.
        """
        return self._advance()

    def stop(self) -> None:
        """Nothing to stop."""

    def close(self) -> None:
        """Nothing to give back."""

    def _advance(self) -> SensorFrame:
        if self.finished:
            raise LogError(f"the recorded run ends at {self._frames[-1].time:.3f} s")
        frame = self._frame_at(self._next)
        self._next += 1
        return frame
