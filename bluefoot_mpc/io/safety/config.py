"""Thresholds and times of the safety supervisor (3S packs, AX-12A)."""

from __future__ import annotations

from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.safety.sink import SinkConfig
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class SafetyConfig:
    """Thresholds of the supervisor (3S packs, AX-12A)."""

    max_goal_rate: float = 12.0  # rad/s, twice the servo's no-load speed
    voltage_warn: float = 10.8  # V, filtered; below it people are told
    voltage_sit: float = 10.2  # V, filtered; below it the robot sits down
    voltage_stop: float = 9.6  # V, filtered; below it the robot stops for good
    voltage_cut: float = 9.0  # V, as measured; below it for `voltage_cut_time` power is cut at once
    voltage_cut_time: float = 0.2  # s
    voltage_time_constant: float = 1.0  # s
    unknown_hold: float = 1.0  # s without knowing voltage or a temperature until the robot does not walk on
    unknown_sit: float = 5.0  # s, the same until it sits down
    temperature_warn: float = 60.0  # °C; above it the servo's torque limit fades
    temperature_sit: float = 65.0  # °C
    temperature_stop: float = 68.0  # °C; above it the servo's leg is switched off
    derated_torque: float = 0.7  # torque limit of a servo at `temperature_sit`
    max_silent_share: float = 0.2  # of joint readings in `silence_window`
    silence_window: float = 0.5  # s
    reading_max_age: float = 0.1  # s; an older reading counts as a lost one
    imu_hold: float = 0.1  # s without a usable inertial sample until the robot does not walk on
    imu_sit: float = 1.0  # s, the same until it sits down
    arming_torque: float = 0.3  # torque limit with which servos are switched on
    arming_time: float = 1.0  # s, from there to all of it
    unusable_time: float = 0.5  # s of commands that cannot be used until the supervisor lowers the robot
    stop_timeout: float = 6.0  # s that the controller gets for a controlled stop
    limp_time: float = 0.1  # s without torque that count as the end
    sink: SinkConfig = field(default_factory=SinkConfig)

    def __post_init__(self) -> None:
        require_positive(
            max_goal_rate=self.max_goal_rate, voltage_time_constant=self.voltage_time_constant,
            silence_window=self.silence_window, voltage_stop=self.voltage_stop,
            temperature_warn=self.temperature_warn, arming_time=self.arming_time,
            stop_timeout=self.stop_timeout, reading_max_age=self.reading_max_age,
            arming_torque=self.arming_torque,
        )  # fmt: skip
        require_nonnegative(
            max_silent_share=self.max_silent_share, voltage_cut=self.voltage_cut,
            voltage_cut_time=self.voltage_cut_time, unknown_hold=self.unknown_hold, imu_hold=self.imu_hold,
            unusable_time=self.unusable_time, limp_time=self.limp_time,
        )  # fmt: skip
        require_range(0.0, 1.0, arming_torque=self.arming_torque, derated_torque=self.derated_torque)
        if self.voltage_sit < self.voltage_stop or self.temperature_stop < self.temperature_sit:
            raise ConfigurationError("the sit threshold must be met before the stop threshold")
        if self.voltage_warn < self.voltage_sit or self.temperature_sit <= self.temperature_warn:
            raise ConfigurationError("the warn threshold must be met before the sit threshold")
        if self.voltage_stop < self.voltage_cut:
            raise ConfigurationError("the stop threshold must be met before power is cut")
        if self.unknown_sit < self.unknown_hold or self.imu_sit < self.imu_hold:
            raise ConfigurationError("a robot must hold (unknown_hold, imu_hold) before it sits")
