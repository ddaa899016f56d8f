"""What the robot does as a whole: off, stand, walk, sit, safe.

A pure state machine. Posture moves between standing and sitting by a level
(0 stands, 1 sits) at limited speed, torque by a factor, so that no change of
mode is a jump. Walking always ends with all feet down before anything else.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from bluefoot_mpc.settings import require_positive
from bluefoot_mpc.types import Mode, SafetyLevel, SafetyRequest


@dataclass(frozen=True, kw_only=True, slots=True)
class ModeConfig:
    """Times and limits of the mode changes."""

    sit_time: float = 1.5  # s, from standing to sitting
    limp_time: float = 0.5  # s, torque from full to none
    gait_end_time: float = 2.0  # s, longest wait for the feet in a safety stop
    fall_tilt_deg: float = 45.0  # trunk tilt that counts as fallen

    def __post_init__(self) -> None:
        require_positive(
            sit_time=self.sit_time, limp_time=self.limp_time, gait_end_time=self.gait_end_time,
            fall_tilt_deg=self.fall_tilt_deg,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True, slots=True)
class ModeState:
    """Where the state machine stands.

    Attributes:
        mode: the mode the robot is in.
        sit_level: 0 stands, 1 sits.
        torque: torque limit of all servos, 0..1.
        ending: s since walking was told to end; 0 while it was not.
        fallen: True once the trunk tilted too far.
        reason: why the robot is in ``SAFE``.
    """

    mode: Mode = Mode.STAND
    sit_level: float = 0.0
    torque: float = 1.0
    ending: float = 0.0
    fallen: bool = False
    reason: str = ""


def advance(
    state: ModeState,
    wanted: Mode,
    safety: SafetyRequest,
    walking: bool,
    tilt_deg: float,
    dt: float,
    config: ModeConfig,
) -> ModeState:
    """The next state.

    Args:
        state: the present state.
        wanted: mode that the operator or script wants.
        safety: what the supervisor wants; it overrules the operator.
        walking: True while a foot is or will be in the air.
        tilt_deg: estimated tilt of the trunk from the vertical, degrees.
        dt: s.
        config: times and limits.
    """
    state = _enter_safe(state, safety, tilt_deg, config)
    target = state.mode if state.mode is Mode.SAFE else _target(wanted, safety)
    if state.mode is Mode.SAFE and state.fallen:
        return replace(state, torque=max(0.0, state.torque - dt / config.limp_time))
    overdue = state.ending >= config.gait_end_time and (
        state.mode is Mode.SAFE or safety.level >= SafetyLevel.SIT
    )
    if target is not Mode.WALK and walking and not overdue:
        # Feet first: the gait is told to end, and the mode changes when it has.
        return replace(state, ending=state.ending + dt)
    ending = state.ending if walking else 0.0
    if target is not state.mode or ending != state.ending:
        state = replace(state, mode=target, ending=ending)
    return _settle(state, dt, config)


def _enter_safe(state: ModeState, safety: SafetyRequest, tilt_deg: float, config: ModeConfig) -> ModeState:
    if not state.fallen and tilt_deg > config.fall_tilt_deg:
        reason = f"trunk tilted {tilt_deg:.0f} degrees"
        return replace(state, mode=Mode.SAFE, fallen=True, reason=state.reason or reason)
    if state.mode is not Mode.SAFE and safety.level >= SafetyLevel.STOP:
        return replace(state, mode=Mode.SAFE, reason="; ".join(safety.reasons))
    return state


def _target(wanted: Mode, safety: SafetyRequest) -> Mode:
    if safety.level >= SafetyLevel.SIT:
        return Mode.SIT
    if safety.level >= SafetyLevel.HOLD and wanted is Mode.WALK:
        return Mode.STAND
    return Mode.STAND if wanted is Mode.SAFE else wanted


def _settle(state: ModeState, dt: float, config: ModeConfig) -> ModeState:
    """Move the posture level and the torque towards what the mode wants."""
    step = dt / config.sit_time
    upright = state.mode in (Mode.STAND, Mode.WALK)
    level = max(0.0, state.sit_level - step) if upright else min(1.0, state.sit_level + step)
    limp = state.mode in (Mode.OFF, Mode.SAFE) and level >= 1.0
    torque = (
        max(0.0, state.torque - dt / config.limp_time)
        if limp
        else min(1.0, state.torque + dt / config.limp_time)
    )
    if state.mode is Mode.SAFE:
        torque = min(torque, state.torque)
    # Nothing walks before it stands.
    mode = Mode.STAND if state.mode is Mode.WALK and level > 0.0 else state.mode
    if (mode, level, torque) == (state.mode, state.sit_level, state.torque):
        return state
    return replace(state, mode=mode, sit_level=level, torque=torque)
