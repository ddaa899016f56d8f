"""The safety supervisor: one wrapper around every robot, the simulated one included.

Below it nothing but checked commands reach the servos: finite, inside the
joint limits, no faster than the servos can follow. Above it the controller
learns, one tick later, what the supervisor wants it to do.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.types import (
    JOINTS,
    N_JOINTS,
    BoolArray,
    FloatArray,
    JointCommand,
    SafetyLevel,
    SafetyRequest,
    SensorFrame,
)

log = logging.getLogger(__name__)

_ONES = np.ones(N_JOINTS)


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyConfig:
    """Thresholds of the supervisor (3S packs, AX-12A)."""

    max_goal_rate: float = 12.0  # rad/s, twice the servo's no-load speed
    voltage_sit: float = 10.2  # V, filtered; below it the robot sits down
    voltage_stop: float = 9.6  # V, filtered
    voltage_time_constant: float = 1.0  # s
    temperature_sit: float = 65.0  # °C
    temperature_stop: float = 68.0  # °C
    max_silent_share: float = 0.2  # of joint readings in `silence_window`
    silence_window: float = 0.5  # s

    def __post_init__(self) -> None:
        require_positive(
            max_goal_rate=self.max_goal_rate,
            voltage_time_constant=self.voltage_time_constant,
            silence_window=self.silence_window,
            voltage_stop=self.voltage_stop,
            temperature_sit=self.temperature_sit,
        )
        require_nonnegative(max_silent_share=self.max_silent_share)
        if self.voltage_sit < self.voltage_stop or self.temperature_stop < self.temperature_sit:
            raise ConfigurationError("the sit threshold must be met before the stop threshold")


class SafetySupervisor:
    """Checks every command on its way down and every frame on its way up.

    Args:
        robot: the robot to protect.
        lower: (16,) rad, lowest goal that may be sent.
        upper: (16,) rad, highest goal that may be sent.
        config: thresholds.
    """

    def __init__(self, robot: Robot, lower: FloatArray, upper: FloatArray, config: SafetyConfig) -> None:
        self.robot = robot
        self.period = robot.period
        self._lower, self._upper, self._config = lower, upper, config
        self._reach = config.max_goal_rate * robot.period
        self._clear()

    def _clear(self) -> None:
        self.request = SafetyRequest()
        self.stopped = False
        self._latched: list[tuple[SafetyLevel, str]] = []
        self._last: JointCommand | None = None
        self._voltage = math.nan
        self._silent_share = 0.0
        self._position = np.full(N_JOINTS, np.nan)

    def reset(self) -> SensorFrame:
        """Reset the robot and forget every fault."""
        self._clear()
        frame = self.robot.reset()
        self._locate(frame)
        return frame

    def step(self, command: JointCommand) -> SensorFrame:
        """Send the command as far as it is safe, and judge the frame that comes back."""
        checked = self.check(command)
        frame = self.robot.step(checked)
        self._watch(frame)
        return frame

    def check(self, command: JointCommand) -> JointCommand:
        """The command that may be sent: finite, inside limits, slew-limited."""
        if not (_finite(command.position) and _finite(command.speed) and _finite(command.torque_limit)):
            bad = [JOINTS[i] for i in np.flatnonzero(~_finite_joints(command))]
            self._latch(SafetyLevel.STOP, f"command is not finite for {', '.join(bad)}: discarded")
            return self._hold()
        reference = self._reference(command)
        goal = _clip(command.position, reference - self._reach, reference + self._reach)
        goal = _clip(goal, self._lower, self._upper)
        limit = np.zeros(N_JOINTS) if self.stopped else _clip(command.torque_limit, 0.0, 1.0)
        self._last = JointCommand(position=goal, speed=np.maximum(command.speed, 0.0), torque_limit=limit)
        return self._last

    def stop(self) -> None:
        """Make the robot limp; later commands keep it so until `reset`."""
        self.stopped = True
        self.robot.stop()

    def close(self) -> None:
        """Give back the robot's resources."""
        self.robot.close()

    def _reference(self, command: JointCommand) -> FloatArray:
        """(16,) rad, where goals are limited from: the last ones, at first where the joints are."""
        if self._last is not None:
            return self._last.position
        # Of a servo that has not answered yet nothing is known: its first goal goes as it is.
        return np.where(np.isnan(self._position), command.position, self._position)

    def _hold(self) -> JointCommand:
        """What is sent instead of a command that cannot be: the last one, at first where the joints are."""
        if self._last is not None:
            return replace(self._last, torque_limit=np.zeros(N_JOINTS)) if self.stopped else self._last
        unknown = np.isnan(self._position)
        return JointCommand(
            position=_clip(np.where(unknown, 0.0, self._position), self._lower, self._upper),
            speed=np.zeros(N_JOINTS),
            # A servo that is somewhere unknown stays limp: to hold it would be to move it.
            torque_limit=np.where(unknown | self.stopped, 0.0, 1.0),
        )

    def _locate(self, frame: SensorFrame) -> None:
        answered = frame.joint_valid & np.isfinite(frame.joint_position)
        self._position = np.where(answered, frame.joint_position, self._position)

    def _latch(self, level: SafetyLevel, reason: str) -> None:
        if all(known != reason for _, known in self._latched):
            log.warning("safety: %s", reason)
            self._latched.append((level, reason))
        self._publish(())

    def _publish(self, passing: tuple[tuple[SafetyLevel, str], ...]) -> None:
        findings = (*self._latched, *passing)
        if not findings and self.request.level is SafetyLevel.NONE:
            return
        level = max((level for level, _ in findings), default=SafetyLevel.NONE)
        self.request = SafetyRequest(level=level, reasons=tuple(reason for _, reason in findings))

    def _watch(self, frame: SensorFrame) -> None:
        config = self._config
        # Lists: going through sixteen numbers costs less than one call of numpy.
        valid: list[bool] = frame.joint_valid.tolist()
        if self._last is None:
            self._locate(frame)
        self._watch_voltage(frame)
        temperature: list[float] = frame.joint_temperature.tolist()
        hot = [i for i, value in enumerate(temperature) if value >= config.temperature_sit]
        if hot:
            hottest = max(hot, key=temperature.__getitem__)
            level = SafetyLevel.STOP if temperature[hottest] >= config.temperature_stop else SafetyLevel.SIT
            self._latch(level, f"servo {JOINTS[hottest]} is hot (limit {config.temperature_sit:g} °C)")
        blend = min(1.0, self.period / config.silence_window)
        self._silent_share += blend * (valid.count(False) / N_JOINTS - self._silent_share)
        passing: tuple[tuple[SafetyLevel, str], ...] = ()
        if self._silent_share > config.max_silent_share:
            silent = ", ".join(JOINTS[i] for i in np.flatnonzero(~frame.joint_valid))
            passing = ((SafetyLevel.SIT, f"too many lost joint readings (now: {silent or 'none'})"),)
        self._publish(passing)

    def _watch_voltage(self, frame: SensorFrame) -> None:
        if not frame.voltage_valid or not math.isfinite(frame.voltage):
            return
        config = self._config
        if math.isnan(self._voltage):
            self._voltage = frame.voltage
        blend = min(1.0, self.period / config.voltage_time_constant)
        self._voltage += blend * (frame.voltage - self._voltage)
        if self._voltage < config.voltage_stop:
            self._latch(SafetyLevel.STOP, f"battery empty (below {config.voltage_stop:g} V)")
        elif self._voltage < config.voltage_sit:
            self._latch(SafetyLevel.SIT, f"battery low (below {config.voltage_sit:g} V)")


def _clip(values: FloatArray, low: FloatArray | float, high: FloatArray | float) -> FloatArray:
    # np.clip does the same in three times the time, on a few numbers.
    return np.minimum(np.maximum(values, low), high)


def _finite(values: FloatArray) -> bool:
    # A sum is finite only when every entry is; as a product it is the fastest call of numpy.
    return math.isfinite(float(values @ _ONES))


def _finite_joints(command: JointCommand) -> BoolArray:
    return np.isfinite(command.position) & np.isfinite(command.speed) & np.isfinite(command.torque_limit)
