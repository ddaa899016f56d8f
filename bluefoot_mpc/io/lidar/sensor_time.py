"""The LIDAR's clock on the host's."""

from __future__ import annotations

import math

from bluefoot_mpc.io.device_time import ClockOffset, Counter
from bluefoot_mpc.io.lidar.codec import STAMP_BITS, STAMP_UNIT
from bluefoot_mpc.io.lidar.config import LidarConfig
from bluefoot_mpc.io.lidar.geometry import SWEEP_END


class SensorTime:
    """Host times of sweeps from the sensor's stamps.

    Before measuring the clocks are compared: the sensor says when a request came
    in, and its way there is short and known. While it measures it cannot be
    asked; then the arrivals of the scans hold the drift within bounds: no sweep
    ends after it arrived, and none stays on its way longer than the greatest lag.
    """

    def __init__(self, config: LidarConfig) -> None:
        self._config = config
        self._counter = Counter(STAMP_BITS, STAMP_UNIT)
        self._lag = ClockOffset(config.lag_window)
        self._base = math.nan

    def reset(self) -> None:
        """Forget the comparison, as after the sensor's restart."""
        self._counter.reset()
        self._lag.reset()
        self._base = math.nan

    def compare(self, stamp: int, sent: float) -> None:
        """Take the sensor's time at which a request came in that reached it at `sent` (s) or later."""
        base = sent - self._counter.seconds(stamp)
        if not base <= self._base:
            self._base = base

    def sweep_end(self, stamp: int, arrival: float) -> float | None:
        """Host time (s) of the end of a sweep; None where the sensor's clock has jumped.

        Args:
            stamp: of the scan.
            arrival: s, host time at which it was read.
        """
        end = self._counter.seconds(stamp) + SWEEP_END
        if math.isnan(self._base):
            self._base = arrival - end
        if abs(arrival - end - self._base) > self._config.clock_jump:
            return None
        self._lag.observe(arrival - end, arrival)
        least = self._lag.least
        self._base = min(max(self._base, least - self._config.greatest_lag), least)
        return end + self._base
