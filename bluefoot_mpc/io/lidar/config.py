"""How the LIDAR's driver waits, retries and judges."""

from __future__ import annotations

from dataclasses import dataclass

from bluefoot_mpc.settings import require_nonnegative, require_positive


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarConfig:
    """Times of the driver; the sensor itself is fixed: a URG-04LX."""

    answer: float = 0.3  # s to wait for the reply to a command
    tries: int = 3  # times that a command is sent before the port is opened anew
    clock_requests: int = 5  # comparisons of the clocks before measuring
    silence: float = 0.5  # s without a good scan: begin anew
    greatest_lag: float = 0.06  # s from the end of a sweep to its arrival, at most: transfer and one poll
    lag_window: float = 5.0  # s over which the shortest lag is looked for
    clock_jump: float = 1.0  # s between stamp and arrival: the sensor's clock has jumped
    frozen_scans: int = 5  # identical scans in a row: the sensor is not measuring
    retry_first: float = 0.2  # s to the first attempt to open the port again
    retry_longest: float = 2.0  # s between attempts in the end
    start_timeout: float = 3.0  # s that `start` waits for the first scan

    def __post_init__(self) -> None:
        require_positive(
            answer=self.answer, tries=self.tries, clock_requests=self.clock_requests,
            silence=self.silence, lag_window=self.lag_window, clock_jump=self.clock_jump,
            frozen_scans=self.frozen_scans, retry_first=self.retry_first,
            retry_longest=self.retry_longest, start_timeout=self.start_timeout,
        )  # fmt: skip
        require_nonnegative(greatest_lag=self.greatest_lag)
