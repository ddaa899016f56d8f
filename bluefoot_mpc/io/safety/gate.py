"""The gate that every command passes: finite, inside the joint limits, no faster than servos can follow."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from bluefoot_mpc.io.safety.faults import Fault, Response
from bluefoot_mpc.types import JOINTS, N_JOINTS, BoolArray, FloatArray, JointCommand, SensorFrame

_ONES = np.ones(N_JOINTS)

JUMP = 0.5
"""rad that a goal may be away from the last one before people are told that it was slowed down."""
BEYOND = 0.1
"""rad that a goal may lie outside the limits before people are told; a limp joint may be found there."""

RECENT = 0.1
"""s for which a position counts as known: a slow adapter does not ask every servo in each period."""


class CommandGate:
    """Turns commands into ones that may be sent.

    Attributes:
        last: what was let through last, before any ceiling of the torque limits; None before the first.
        complaint: what was so wrong with the last command that people should know; mostly None.

    Args:
        lower: (16,) rad, lowest goal that may be sent.
        upper: (16,) rad, highest goal that may be sent.
        reach: rad that a goal may move in one period.
    """

    def __init__(self, lower: FloatArray, upper: FloatArray, reach: float) -> None:
        self._lower, self._upper, self._reach = lower, upper, reach
        self.reset()

    def reset(self) -> None:
        """Forget what was sent and where the joints are."""
        self.last: JointCommand | None = None
        self.complaint: Fault | None = None
        self.position = np.full(N_JOINTS, np.nan)

    def locate(self, frame: SensorFrame) -> None:
        """Take where the joints are; what is not known stays."""
        self.position = np.where(known(frame), frame.joint_position, self.position)

    def passed(self, command: JointCommand) -> JointCommand:
        """The command inside all limits; it must be finite."""
        reference = self._reference(command)
        goal = clip(command.position, reference - self._reach, reference + self._reach)
        goal = clip(goal, self._lower, self._upper)
        moved = self.last is not None and not (goal == command.position).all()
        self.complaint = self._complaint(command.position, reference) if moved else None
        limit = clip(command.torque_limit, 0.0, 1.0)
        self.last = JointCommand(position=goal, speed=np.maximum(command.speed, 0.0), torque_limit=limit)
        return self.last

    def held(self) -> JointCommand:
        """What is sent instead of a command that cannot be: the last one, at first where the joints are."""
        if self.last is not None:
            return self.last
        unknown = np.isnan(self.position)
        return JointCommand(
            position=clip(np.where(unknown, 0.0, self.position), self._lower, self._upper),
            speed=np.zeros(N_JOINTS),
            # A servo that is somewhere unknown stays limp: to hold it would be to move it.
            torque_limit=np.where(unknown, 0.0, 1.0),
        )

    def _complaint(self, wanted: FloatArray, reference: FloatArray) -> Fault | None:
        jump = np.abs(wanted - reference)
        if float(jump.max()) > JUMP:
            joint = int(jump.argmax())
            text = f"the goal of {JOINTS[joint]} jumped by {jump[joint]:.2f} rad: it moves there slowly"
            return Fault(key="jump", response=Response.WARN, text=f"{text}. Check the controller")
        beyond = np.maximum(wanted - self._upper, self._lower - wanted)
        if float(beyond.max()) > BEYOND:
            joint = int(beyond.argmax())
            text = (
                f"the goal of {JOINTS[joint]} was {beyond[joint]:.2f} rad outside its limits: it stops there"
            )
            return Fault(key="beyond", response=Response.WARN, text=f"{text}. Check the controller")
        return None

    def _reference(self, command: JointCommand) -> FloatArray:
        """(16,) rad, where goals are limited from: the last ones, at first where the joints are."""
        if self.last is not None:
            return self.last.position
        # Of a servo that has not answered yet nothing is known: its first goal goes as it is.
        return np.where(np.isnan(self.position), command.position, self.position)


def known(frame: SensorFrame) -> BoolArray:
    """(16,) True where a joint's position is known: measured in this period, or a moment ago."""
    measured: BoolArray = frame.joint_valid | (frame.time - frame.joint_time <= RECENT)
    return measured & np.isfinite(frame.joint_position)


def usable(command: JointCommand) -> bool:
    """True when every number of the command is finite."""
    return _finite(command.position) and _finite(command.speed) and _finite(command.torque_limit)


def unusable_joints(command: JointCommand) -> str:
    """The joints whose command is not finite, for a message."""
    finite: BoolArray = (
        np.isfinite(command.position) & np.isfinite(command.speed) & np.isfinite(command.torque_limit)
    )
    return ", ".join(JOINTS[i] for i in np.flatnonzero(~finite))


def capped(command: JointCommand, ceiling: FloatArray | float) -> JointCommand:
    """The command with its torque limits under a ceiling, (16,) or one for all, 0..1."""
    return replace(command, torque_limit=np.minimum(command.torque_limit, ceiling))


def clip(values: FloatArray, low: FloatArray | float, high: FloatArray | float) -> FloatArray:
    """`numpy.clip` in a third of its time on a few numbers."""
    return np.minimum(np.maximum(values, low), high)


def _finite(values: FloatArray) -> bool:
    # A sum is finite only when every entry is; as a product it is the fastest call of numpy.
    return math.isfinite(float(values @ _ONES))
