"""Inertial samples on their way from the board: stamped, judged, and gathered into a batch."""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.messages import ImuSample
from bluefoot_mpc.types import ImuBatch

_NO_FIELD = (math.nan, math.nan, math.nan)


class ImuWatch:
    """Judges every sample and says what is wrong with the sensor.

    Attributes:
        samples: so far.
        invalid: samples among them that were flagged.
        dropped: samples that nobody took in time.
    """

    def __init__(self, config: BoardConfig) -> None:
        self._config = config
        self._rows: list[tuple[float, ...]] = []
        self._valid: list[bool] = []
        self._raw = b""
        self._same_since = -math.inf
        self._last = -math.inf
        self._fault = ""
        self.samples = 0
        self.invalid = 0
        self.dropped = 0

    def add(self, sample: ImuSample, time: float, arrival: float) -> None:
        """Take a sample.

        Args:
            sample: what the board measured.
            time: s, host time of the sample; NaN where it is not known.
            arrival: s, host time at which it was read.
        """
        self._fault = self._judge(sample, time)
        valid = not self._fault
        field = sample.magnetometer
        stamp = arrival if math.isnan(time) else time
        self._rows.append((stamp, *sample.gyro, *sample.accel, *(_NO_FIELD if field is None else field)))
        self._valid.append(valid)
        self.samples += 1
        self.invalid += not valid
        self._last = arrival
        if len(self._rows) > self._config.buffer:
            del self._rows[0], self._valid[0]
            self.dropped += 1

    def _judge(self, sample: ImuSample, time: float) -> str:
        config = self._config
        if math.isnan(time):
            return "its time is not known (clock jumped, or not compared yet)"
        if sample.raw != self._raw:
            self._raw, self._same_since = sample.raw, time
        # One comparison serves both: nothing about a NaN is true.
        if not all(abs(value) <= config.gyro_limit for value in sample.gyro):
            return f"impossible angular velocity {_text(sample.gyro)} rad/s"
        if not all(abs(value) <= config.accel_limit for value in sample.accel):
            return f"impossible acceleration {_text(sample.accel)} m/s²"
        field = sample.magnetometer
        if field is not None and not all(abs(value) <= config.field_limit for value in field):
            return f"impossible magnetic field {_text(field)} of the nominal one"
        if time - self._same_since > config.imu_frozen:
            return f"frozen, the same numbers for {(time - self._same_since) * 1e3:.0f} ms"
        return ""

    def fault(self, now: float) -> str:
        """What is wrong with the IMU now; empty where nothing is."""
        age = now - self._last
        if age > self._config.imu_silence:
            since = f"for {age * 1e3:.0f} ms" if math.isfinite(age) else "yet"
            return f"IMU: no sample {since}"
        return f"IMU: {self._fault}" if self._fault else ""

    def take(self) -> ImuBatch:
        """All samples since the last time, oldest first."""
        rows = np.array(self._rows, dtype=np.float64).reshape(-1, 10)
        valid = np.array(self._valid, dtype=np.bool_)
        self._rows.clear()
        self._valid.clear()
        return ImuBatch(
            time=rows[:, 0], gyro=rows[:, 1:4], accel=rows[:, 4:7], magnetometer=rows[:, 7:10], valid=valid
        )


def _text(values: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in values) + ")"
