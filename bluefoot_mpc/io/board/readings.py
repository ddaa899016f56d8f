"""What the driver of the board hands out, once per command period."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.types import BoolArray, FloatArray, ImuBatch


@dataclass(frozen=True, kw_only=True, slots=True)
class BoardStatistics:
    """Counts since the driver was made.

    Attributes:
        frames: good frames.
        bad_frames: runs of bytes that were no frame (stuffing, length, CRC).
        bad_messages: good frames that were no message of the protocol.
        lost_frames: frames missing by their sequence numbers.
        imu_samples: inertial samples, the invalid ones included.
        imu_invalid: samples among them that were flagged.
        imu_dropped: samples that nobody took in time.
        time_jumps: jumps of the board's clock.
        reconnects: times that the port was opened anew.
        heartbeats: heartbeats sent.
    """

    frames: int = 0
    bad_frames: int = 0
    bad_messages: int = 0
    lost_frames: int = 0
    imu_samples: int = 0
    imu_invalid: int = 0
    imu_dropped: int = 0
    time_jumps: int = 0
    reconnects: int = 0
    heartbeats: int = 0


@dataclass(frozen=True, kw_only=True, slots=True)
class BoardReadings:
    """Newest data of the board; times are those of the host's clock.

    Attributes:
        time: s, when this was put together.
        imu: inertial samples since the last time, oldest first, each with its own validity.
        imu_valid: False while the IMU is silent, frozen or not to be trusted for another reason.
        contact: (4,) foot switches, True = touches.
        contact_time: (4,) s, when the switches were read; NaN before the first time.
        contact_valid: (4,) False where a switch is silent, stuck or chattering.
        voltage: V of the battery under load; NaN while unknown.
        voltage_valid: False where the voltage is old or impossible.
        current: A out of the battery; NaN while unknown.
        temperature: °C of the board; NaN while unknown.
        power_on: True while there is voltage behind the switch of the servos' supply, as far as is known.
        connected: True while good frames arrive.
        faults: what is wrong now, one sentence each; empty where all is well.
        statistics: counts.
    """

    time: float
    imu: ImuBatch
    imu_valid: bool
    contact: BoolArray
    contact_time: FloatArray
    contact_valid: BoolArray
    voltage: float
    voltage_valid: bool
    current: float
    temperature: float
    power_on: bool
    connected: bool
    faults: tuple[str, ...]
    statistics: BoardStatistics
