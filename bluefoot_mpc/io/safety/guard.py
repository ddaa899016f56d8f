"""The watchdog under the control thread: what the bus thread writes when no new set-point comes.

Staged, and pure but for its memory: a set-point that is late is held; one that
stays away makes the guard lower the body by itself, with no controller, and
then switch the torque off. What has begun is not called off by a set-point
that comes too late: torque returns only by arming anew. A guard that was away itself (a
halted program) does not go on either: others have switched the robot off meanwhile.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.safety import sink
from bluefoot_mpc.io.safety.sink import Sink, SinkConfig
from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import FloatArray, JointCommand

EMERGENCY = "emergency stop"
"""Reason of an emergency stop that nobody gave a reason for."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GuardConfig:
    """When the guard steps in."""

    hold_after: float = 0.1  # s without a new set-point until the last goals are held
    sink_after: float = 0.5  # s, the same until the guard lowers the robot by itself
    off_after: float = 0.5  # s between two calls after which others have switched the robot off
    longest_step: float = 0.1  # s that goals move on at most between two calls, however late the second is
    sink: SinkConfig = field(default_factory=SinkConfig)

    def __post_init__(self) -> None:
        require_positive(hold_after=self.hold_after, off_after=self.off_after, longest_step=self.longest_step)
        if self.sink_after <= self.hold_after:
            raise ConfigurationError(
                f"sink_after = {self.sink_after:g} must be longer than hold_after = {self.hold_after:g} (s)"
            )


class GuardState(enum.StrEnum):
    """What the guard has the bus do."""

    SEND = "send"
    HOLD = "hold"
    SINK = "sink"
    OFF = "off"


@dataclass(frozen=True, kw_only=True, slots=True)
class GuardAction:
    """What to write in this cycle.

    Attributes:
        state: what it is: a new set-point, the last goals again, the guard's own, or no torque.
        command: goals, speeds and torque limits to write; None with `GuardState.OFF`: broadcast
            torque off, cut power, set the latch; None with another state: nothing to write yet.
        reason: why it is not a new set-point; empty while it is.
    """

    state: GuardState
    command: JointCommand | None
    reason: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class GuardMemory:
    """What the guard remembers.

    Attributes:
        state: what it did last.
        now: s, when it was called last.
        sent: what was written last; None before the first.
        sink: the lowering under way.
        reason: why it is off or sinking.
    """

    state: GuardState = GuardState.SEND
    now: float = math.nan
    sent: JointCommand | None = None
    sink: Sink | None = None
    reason: str = ""


@dataclass(frozen=True, kw_only=True, slots=True)
class GuardInputs:
    """What a bus cycle brings.

    Attributes:
        now: s, on the bus's clock.
        age: s since the set-point was given; NaN counts as for ever.
        setpoint: newest set-point; None before the first.
        emergency: why torque must go at once; empty while it need not.
    """

    now: float
    age: float
    setpoint: JointCommand | None
    emergency: str = ""


def advance(
    memory: GuardMemory, inputs: GuardInputs, sit: FloatArray | None, config: GuardConfig
) -> GuardMemory:
    """What the guard does in this cycle.

    Args:
        memory: what it did before.
        inputs: what the cycle brings.
        sit: (16,) rad, sitting posture; None where it is not known.
        config: times.
    """
    step = inputs.now - memory.now
    # A stalled adapter, or a first call, must not make the goals jump.
    dt = min(max(step, 0.0), config.longest_step) if math.isfinite(step) else 0.0
    memory = replace(memory, now=inputs.now)
    off = _why_off(memory, inputs, step, config)
    if off:
        return replace(memory, state=GuardState.OFF, sink=None, reason=off)
    if memory.sink is not None:
        return _sinking(memory, memory.sink, sit, dt, config)
    if inputs.age <= config.hold_after and inputs.setpoint is not None:
        return replace(memory, state=GuardState.SEND, sent=inputs.setpoint, reason="")
    if inputs.age <= config.sink_after:
        reason = f"no set-point for {config.hold_after:g} s: the last goals are held"
        return replace(memory, state=GuardState.HOLD, reason=reason)
    reason = f"no set-point for {config.sink_after:g} s: the robot is lowered and switched off"
    memory = replace(memory, reason=reason)
    if memory.sent is None:
        return replace(memory, state=GuardState.OFF)
    begun = Sink(goal=memory.sent.position, torque=memory.sent.torque_limit)
    return _sinking(memory, begun, sit, dt, config)


def _why_off(memory: GuardMemory, inputs: GuardInputs, step: float, config: GuardConfig) -> str:
    """Why there is no torque at all; empty where there may be."""
    if memory.state is GuardState.OFF:
        return memory.reason
    if inputs.emergency:
        return inputs.emergency
    if step > config.off_after:
        # Watchdog process and power board have acted: a goal now would switch limp servos on again.
        return f"the bus thread was away for {step:.1f} s: the robot stays off"
    return ""


def _sinking(
    memory: GuardMemory, begun: Sink, sit: FloatArray | None, dt: float, config: GuardConfig
) -> GuardMemory:
    lower = sink.advance(begun, sit, dt, config.sink)
    if lower.limp:
        return replace(memory, state=GuardState.OFF, sink=None)
    return replace(memory, state=GuardState.SINK, sink=lower, sent=lower.command())


class Guard:
    """The staged watchdog with its memory. One thread steps it; `emergency` may come from any.

    Attributes:
        memory: what it remembers.

    Args:
        config: times.
    """

    def __init__(self, config: GuardConfig | None = None) -> None:
        self.config = config or GuardConfig()
        self._sit: FloatArray | None = None
        self.reset()

    @property
    def state(self) -> GuardState:
        """What it did last."""
        return self.memory.state

    def watch_over(self, sit: FloatArray) -> None:
        """Tell where to sink to: (16,) rad, the sitting posture."""
        self._sit = sit

    def reset(self, holding: JointCommand | None = None) -> None:
        """Trust the control thread anew, emergency included: for arming alone.

        Args:
            holding: what arming has written, held until the first set-point comes.
        """
        self.memory = GuardMemory(sent=holding)
        self._emergency = ""

    def emergency(self, reason: str) -> None:
        """From the next cycle on no torque, until `reset`."""
        self._emergency = self._emergency or reason or EMERGENCY

    def step(self, now: float, age_of_setpoint: float, setpoint: JointCommand | None) -> GuardAction:
        """What to write in this bus cycle.

        Args:
            now: s, on the bus's clock.
            age_of_setpoint: s since the control thread gave `setpoint` (before the first: since arming).
            setpoint: newest set-point; None before the first.
        """
        inputs = GuardInputs(now=now, age=age_of_setpoint, setpoint=setpoint, emergency=self._emergency)
        self.memory = memory = advance(self.memory, inputs, self._sit, self.config)
        command = None if memory.state is GuardState.OFF else memory.sent
        return GuardAction(state=memory.state, command=command, reason=memory.reason)
