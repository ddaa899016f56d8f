"""The supervisor's states and what leads from one to the next: a pure state machine.

    DISARMED ─▶ CHECKING ─▶ ARMING ─▶ ACTIVE ⇄ HOLD ⇄ SITTING ─▶ STOPPING ─▶ STOPPED

EMERGENCY is reached from everywhere. Torque comes back from DISARMED, STOPPED
and EMERGENCY only by an explicit wish to arm, through CHECKING. The picture is
in ``docs/safety.md``.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from bluefoot_mpc.io.safety.config import SafetyConfig
from bluefoot_mpc.types import SafetyLevel


class SafetyState(enum.StrEnum):
    """How far the robot is allowed to move."""

    DISARMED = "disarmed"
    CHECKING = "checking"
    ARMING = "arming"
    ACTIVE = "active"
    HOLD = "hold"
    SITTING = "sitting"
    STOPPING = "stopping"
    STOPPED = "stopped"
    EMERGENCY = "emergency"


LIMP = frozenset({SafetyState.DISARMED, SafetyState.CHECKING, SafetyState.STOPPED, SafetyState.EMERGENCY})
"""No torque may be on."""
OBEYING = frozenset({SafetyState.ACTIVE, SafetyState.HOLD, SafetyState.SITTING})
"""The controller's commands go through, as far as they are safe."""


class Checks(enum.Enum):
    """How the checks before torque, or the arming itself, stand."""

    PENDING = 0
    PASSED = 1
    REFUSED = 2


@dataclass(frozen=True, kw_only=True, slots=True)
class Machine:
    """The state machine's memory.

    Attributes:
        state: where it stands.
        torque: highest torque limit of any servo, 0..1.
        elapsed: s in this state.
        limp: s since the controller last asked for torque.
    """

    state: SafetyState = SafetyState.DISARMED
    torque: float = 0.0
    elapsed: float = 0.0
    limp: float = 0.0


@dataclass(frozen=True, kw_only=True, slots=True)
class Inputs:
    """What a tick brings.

    Attributes:
        emergency: an emergency stop is wanted, or latched.
        arm: somebody wants the robot armed, explicitly.
        checks: how the checks, or the arming, came out.
        level: worst of the faults.
        limp: the command asks for no torque at all.
        rests: a command without torque means the end (robots that must be armed).
    """

    emergency: bool = False
    arm: bool = False
    checks: Checks = Checks.PENDING
    level: SafetyLevel = SafetyLevel.NONE
    limp: bool = False
    rests: bool = False


def advance(machine: Machine, inputs: Inputs, dt: float, config: SafetyConfig) -> Machine:
    """The next state of the machine.

    Args:
        machine: the present state.
        inputs: what the tick brought.
        dt: s since the last tick.
        config: times and torque of arming and stopping.
    """
    limp = machine.limp + dt if inputs.limp else 0.0
    state = _next(machine, inputs, limp, config)
    elapsed = machine.elapsed + dt if state is machine.state else 0.0
    return Machine(state=state, torque=_torque(machine, state, dt, config), elapsed=elapsed, limp=limp)


def overdue(machine: Machine, config: SafetyConfig) -> bool:
    """True when the controller had its time for a controlled stop and has not come to rest."""
    return machine.state is SafetyState.STOPPING and machine.elapsed > config.stop_timeout


def _next(machine: Machine, inputs: Inputs, limp: float, config: SafetyConfig) -> SafetyState:
    state = machine.state
    if inputs.emergency:
        return SafetyState.EMERGENCY
    if state is SafetyState.CHECKING:
        return _CHECKED[inputs.checks]
    if state in LIMP:
        return SafetyState.CHECKING if inputs.arm else state
    if state is SafetyState.ARMING:
        return _armed(machine, inputs)
    at_rest = limp >= config.limp_time
    if state is SafetyState.STOPPING or inputs.level >= SafetyLevel.STOP:
        return SafetyState.STOPPED if at_rest and state is SafetyState.STOPPING else SafetyState.STOPPING
    return SafetyState.STOPPED if at_rest and inputs.rests else _LEVELS[inputs.level]


def _armed(machine: Machine, inputs: Inputs) -> SafetyState:
    if inputs.checks is Checks.REFUSED or inputs.level >= SafetyLevel.SIT:
        return SafetyState.DISARMED
    return SafetyState.ACTIVE if machine.torque >= 1.0 else SafetyState.ARMING


def _torque(machine: Machine, state: SafetyState, dt: float, config: SafetyConfig) -> float:
    """The ceiling of the torque limits: none where limp, a ramp while arming, all else."""
    if state in LIMP:
        return 0.0
    if state is not SafetyState.ARMING:
        return 1.0
    if machine.state is not SafetyState.ARMING:
        return config.arming_torque
    return min(1.0, machine.torque + (1.0 - config.arming_torque) * dt / config.arming_time)


_CHECKED = {
    Checks.PENDING: SafetyState.CHECKING,
    Checks.PASSED: SafetyState.ARMING,
    Checks.REFUSED: SafetyState.DISARMED,
}
_LEVELS = {
    SafetyLevel.NONE: SafetyState.ACTIVE,
    SafetyLevel.HOLD: SafetyState.HOLD,
    SafetyLevel.SIT: SafetyState.SITTING,
    SafetyLevel.STOP: SafetyState.STOPPING,
}
