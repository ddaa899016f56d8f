"""Thresholds of the board's driver."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.settings import require_nonnegative, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class BoardConfig:
    """When data of the board is not to be trusted, and how the link is kept alive."""

    imu_silence: float = 0.05  # s without a sample: silent
    imu_frozen: float = 0.10  # s of identical samples: frozen
    gyro_limit: float = 32.0  # rad/s, more is implausible
    accel_limit: float = 160.0  # m/s², more is implausible
    field_limit: float = 3.0  # of the nominal field, more is implausible
    time_ahead: float = 0.05  # s that a stamp may lie after its arrival before the clock has jumped
    switch_silence: float = 0.10  # s without a message of the switches
    stuck_edges: int = 20  # edges of at least two other switches while one never changes
    chatter_edges: int = 30  # edges within chatter_window, more is chatter: a quick trot's bounces make 20
    chatter_window: float = 0.5  # s
    chatter_rest: float = 1.0  # s with few edges until a chattering switch is trusted again
    power_silence: float = 0.2  # s without a message of the battery
    voltage_min: float = 4.0  # V, less is implausible
    voltage_max: float = 15.0  # V, more is implausible
    live_after_cut: float = 0.2  # s that the supply may need to fall after a cut; longer: stuck
    time_request: float = 0.2  # s between two comparisons of the clocks
    time_window: float = 5.0  # s that a comparison counts
    link_silence: float = 0.3  # s without any good frame: the port is opened anew
    retry_first: float = 0.1  # s to the first attempt to open the port again
    retry_longest: float = 2.0  # s between attempts in the end
    answer: float = 0.1  # s to wait for the board's answer when power is switched on
    answer_tries: int = 5  # attempts to switch power on
    buffer: int = 400  # inertial samples kept when nobody takes them

    def __post_init__(self) -> None:
        require_positive(
            imu_silence=self.imu_silence, imu_frozen=self.imu_frozen, gyro_limit=self.gyro_limit,
            accel_limit=self.accel_limit, field_limit=self.field_limit, time_ahead=self.time_ahead,
            switch_silence=self.switch_silence, stuck_edges=self.stuck_edges, buffer=self.buffer,
            chatter_edges=self.chatter_edges, chatter_window=self.chatter_window,
            power_silence=self.power_silence, voltage_max=self.voltage_max,
            live_after_cut=self.live_after_cut, time_request=self.time_request,
            time_window=self.time_window, link_silence=self.link_silence,
            retry_first=self.retry_first, retry_longest=self.retry_longest,
            answer=self.answer, answer_tries=self.answer_tries,
        )  # fmt: skip
        require_nonnegative(voltage_min=self.voltage_min, chatter_rest=self.chatter_rest)
        if self.voltage_min >= self.voltage_max:
            raise ConfigurationError(
                f"voltage_min = {self.voltage_min:g} must be less than voltage_max = {self.voltage_max:g}"
            )
