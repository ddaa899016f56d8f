"""What the supervisor looks at in every frame: supply, heat, replies, inertial samples."""

from __future__ import annotations

import math
from collections import deque

import numpy as np

from bluefoot_mpc.io.safety.config import SafetyConfig
from bluefoot_mpc.io.safety.faults import Fault, Response
from bluefoot_mpc.types import JOINTS, LEG_JOINTS, LEGS, N_JOINTS, FloatArray, SensorFrame

_SLACK = 1e-9
"""s of rounding when periods are added up."""


class SupplyMonitor:
    """Voltage at the servos: filtered for what may wait, as measured for what may not.

    Args:
        config: thresholds.
        required: True where an unknown voltage is a fault itself.
    """

    def __init__(self, config: SafetyConfig, required: bool) -> None:
        self._config, self._required = config, required
        self.reset()

    def reset(self) -> None:
        """Forget every voltage."""
        self.voltage = math.nan
        self._low = self._unknown = 0.0

    def step(self, frame: SensorFrame, dt: float) -> list[Fault]:
        """Judge a frame that came `dt` (s) after the last one."""
        config = self._config
        if not frame.voltage_valid or not math.isfinite(frame.voltage):
            self._unknown += dt
            return self._missing()
        self._unknown = 0.0
        if math.isnan(self.voltage):
            self.voltage = frame.voltage
        self.voltage += min(1.0, dt / config.voltage_time_constant) * (frame.voltage - self.voltage)
        self._low = self._low + dt if frame.voltage < config.voltage_cut else 0.0
        if self._low >= config.voltage_cut_time - _SLACK and self._low > 0.0:
            text = f"the supply broke down: below {config.voltage_cut:g} V for {config.voltage_cut_time:g} s"
            return [Fault(key="supply cut", response=Response.EMERGENCY, text=f"{text}. {_CHARGE}")]
        for key, limit, response, name in (
            ("supply stop", config.voltage_stop, Response.STOP, "battery empty"),
            ("supply sit", config.voltage_sit, Response.SIT, "battery low"),
            ("supply warn", config.voltage_warn, Response.WARN, "battery getting low"),
        ):
            if self.voltage < limit:
                text = f"{name} ({self.voltage:.1f} V, below {limit:g} V). {_CHARGE}"
                return [Fault(key=key, response=response, text=text)]
        return []

    def _missing(self) -> list[Fault]:
        if not self._required or self._unknown <= self._config.unknown_hold:
            return []
        text = "the voltage is not known. Check the power board's cable, and the servos'"
        return [_unknown("supply unknown", text, self._unknown > self._config.unknown_sit)]


class HeatMonitor:
    """Temperatures of the servos, and the torque that they may still give.

    Attributes:
        ceiling: (16,) torque limits that heat allows, 0..1.

    Args:
        config: thresholds.
        required: True where an unknown temperature is a fault itself.
    """

    def __init__(self, config: SafetyConfig, required: bool) -> None:
        self._config, self._required = config, required
        self.reset()

    def reset(self) -> None:
        """Forget all heat."""
        self.ceiling: FloatArray = np.ones(N_JOINTS)
        self.derated = False
        self._off = np.zeros(N_JOINTS, dtype=bool)
        self._unknown = [0.0] * N_JOINTS

    def step(self, frame: SensorFrame, dt: float) -> list[Fault]:
        """Judge a frame that came `dt` (s) after the last one."""
        # Lists: going through sixteen numbers costs less than one call of numpy.
        temperature: list[float] = frame.joint_temperature.tolist()
        faults = self._missing(temperature, dt) if self._required else []
        warm = [i for i, value in enumerate(temperature) if value >= self._config.temperature_warn]
        if warm or self.derated:
            self._derate(frame.joint_temperature)
        if warm:
            faults += self._heat(temperature, warm)
        return faults

    def _heat(self, temperature: list[float], warm: list[int]) -> list[Fault]:
        config = self._config
        hottest = max(warm, key=temperature.__getitem__)
        value, name = temperature[hottest], JOINTS[hottest]
        if value < config.temperature_sit:
            text = f"servo {name} is warm ({value:.0f} °C, warning at {config.temperature_warn:g} °C)"
            return [Fault(key="heat warn", response=Response.WARN, text=f"{text}. Let the robot rest")]
        if value < config.temperature_stop:
            text = f"servo {name} is hot ({value:.0f} °C, limit {config.temperature_sit:g} °C)"
            return [Fault(key="heat sit", response=Response.SIT, text=f"{text}. {_COOL}")]
        faults = []
        for leg, start in zip(LEGS, range(0, N_JOINTS, len(LEG_JOINTS)), strict=True):
            degrees = max(temperature[start : start + len(LEG_JOINTS)])
            if degrees >= config.temperature_stop:
                self._off[start : start + len(LEG_JOINTS)] = True
                joint = JOINTS[temperature.index(degrees, start)]
                text = f"servo {joint} is hot ({degrees:.0f} °C, limit {config.temperature_stop:g} °C)"
                text = f"{text}: leg {leg} is switched off. {_COOL}"
                faults.append(Fault(key=f"heat stop {leg}", response=Response.STOP, text=text))
        self.ceiling = np.where(self._off, 0.0, self.ceiling)
        return faults

    def _derate(self, temperature: FloatArray) -> None:
        config = self._config
        span = config.temperature_sit - config.temperature_warn
        share = np.clip((np.nan_to_num(temperature) - config.temperature_warn) / span, 0.0, 1.0)
        self.ceiling = np.where(self._off, 0.0, 1.0 - (1.0 - config.derated_torque) * share)
        self.derated = bool((self.ceiling < 1.0).any())

    def _missing(self, temperature: list[float], dt: float) -> list[Fault]:
        self._unknown = [
            0.0 if math.isfinite(value) else age + dt
            for value, age in zip(temperature, self._unknown, strict=True)
        ]
        longest = max(self._unknown)
        if longest <= self._config.unknown_hold:
            return []
        names = ", ".join(JOINTS[i] for i, age in enumerate(self._unknown) if age > self._config.unknown_hold)
        text = f"the temperature of {names} is not known. Check the servos' plugs"
        return [_unknown("heat unknown", text, longest > self._config.unknown_sit)]


class ReplyMonitor:
    """Lost and late replies of the servos.

    Args:
        config: thresholds.
        period: s, command period.
        required: True where a single servo that stays silent is a fault itself.
    """

    def __init__(self, config: SafetyConfig, period: float, required: bool) -> None:
        self._config, self._required = config, required
        self._length = max(1, round(config.silence_window / period))
        self.reset()

    def reset(self) -> None:
        """Forget every loss."""
        self._lost: deque[int] = deque([0] * self._length, maxlen=self._length)
        self._sum = 0
        self._silent = [0.0] * N_JOINTS

    def step(self, frame: SensorFrame, dt: float, put_off: tuple[int, ...] = ()) -> list[Fault]:
        """Judge a frame that came `dt` (s) after the last one.

        Args:
            frame: what the sensors say.
            dt: s.
            put_off: joints that nobody asked in this period; lost only when their reading is too old.
        """
        oldest = frame.time - self._config.reading_max_age - _SLACK
        valid = frame.joint_valid
        if put_off:
            valid = valid.copy()
            valid[list(put_off)] = True
        answered: list[bool] = (valid & (frame.joint_time >= oldest)).tolist()
        lost = answered.count(False)
        self._sum += lost - self._lost[0]
        self._lost.append(lost)
        faults = self._alone(answered, dt) if self._required else []
        if self._sum > self._config.max_silent_share * N_JOINTS * self._length:
            now = _names([i for i, known in enumerate(answered) if not known])
            text = f"too many lost joint readings (now: {now}). Check the bus and its adapter"
            faults.append(Fault(key="replies", response=Response.SIT, text=text, latched=False))
        return faults

    def _alone(self, answered: list[bool], dt: float) -> list[Fault]:
        self._silent = [0.0 if known else age + dt for known, age in zip(answered, self._silent, strict=True)]
        gone = [i for i, age in enumerate(self._silent) if age > self._config.silence_window]
        # As many at once are no plug: that is the line's, told and forgiven as lost readings.
        if not gone or len(gone) > self._config.max_silent_share * N_JOINTS:
            return []
        text = f"no reply from {_names(gone)} for {self._config.silence_window:g} s. Check the plugs"
        return [Fault(key=f"no reply {gone[0]}", response=Response.SIT, text=text)]


class InertialMonitor:
    """Usable inertial samples: valid, finite, of this frame's time, and not the last one repeated.

    The estimate is blind after the same time and does not walk on by itself;
    what is added here is that it is told, and that a robot which stays blind
    sits down.

    Args:
        config: thresholds.
        required: True where samples must come from the start; else only once some have come.
    """

    def __init__(self, config: SafetyConfig, required: bool) -> None:
        self._config, self._required = config, required
        self.reset()

    def reset(self) -> None:
        """Forget every sample."""
        self._age = 0.0
        self._seen = self._required
        self._last: list[float] = []
        self._time = -math.inf

    def step(self, frame: SensorFrame, dt: float) -> list[Fault]:
        """Judge a frame that came `dt` (s) after the last one."""
        if self._usable(frame):
            self._age, self._seen = 0.0, True
        else:
            self._age += dt
        self._time = frame.time
        if not self._seen or self._age <= self._config.imu_hold + _SLACK:
            return []
        text = f"no usable inertial sample for {self._config.imu_hold:g} s: the robot does not walk on"
        if self._age > self._config.imu_sit + _SLACK:
            text = f"no usable inertial sample for {self._config.imu_sit:g} s: the robot sits down"
            return [Fault(key="inertial sit", response=Response.SIT, text=f"{text}. {_IMU}")]
        # The controller, blind by then, stops and goes on by itself; a robot with power ends its gait too.
        response = Response.HOLD if self._required else Response.WARN
        return [Fault(key="inertial", response=response, text=f"{text}. {_IMU}", latched=not self._required)]

    def _usable(self, frame: SensorFrame) -> bool:
        imu = frame.imu
        before = self._last
        good = False
        columns = (imu.time.tolist(), imu.gyro.tolist(), imu.accel.tolist(), imu.valid.tolist())
        for time, gyro, accel, valid in zip(*columns, strict=True):
            sample = gyro + accel
            if not valid or not math.isfinite(sum(sample)) or not self._time < time <= frame.time + 1e-6:
                continue
            good = good or sample != before
            before = sample
        self._last = before
        return good


class FrameMonitor:
    """Frames that come, and whose time goes on.

    Args:
        config: thresholds.
    """

    def __init__(self, config: SafetyConfig) -> None:
        self._config = config
        self.reset()

    def reset(self) -> None:
        """Forget every frame."""
        self._stuck = 0.0

    def step(self, advanced: bool, dt: float) -> list[Fault]:
        """Judge whether time went on in a frame that should have come `dt` (s) after the last one."""
        self._stuck = 0.0 if advanced else self._stuck + dt
        if self._stuck <= self._config.reading_max_age + _SLACK:
            return []
        text = "the time of the robot's frames does not go on: nothing measured can be trusted"
        return [Fault(key="frames", response=Response.STOP, text=text)]


def _names(joints: list[int]) -> str:
    if len(joints) == N_JOINTS:
        return "all servos"
    return ", ".join(JOINTS[i] for i in joints) or "none"


def _unknown(key: str, text: str, long: bool) -> Fault:
    if long:
        return Fault(key=f"{key} sit", response=Response.SIT, text=f"{text}; the robot sits down")
    return Fault(key=key, response=Response.HOLD, text=text, latched=False)


_CHARGE = "Charge or change the pack"
_COOL = "Let it cool below 50 °C"
_IMU = "Check the power board's cable and its sensor"
