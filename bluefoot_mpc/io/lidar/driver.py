"""Driver of the URG-04LX: checks it, lets it measure without end, and begins anew when it falls silent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.lidar.config import LidarConfig
from bluefoot_mpc.io.lidar.errors import LidarError, ScipError
from bluefoot_mpc.io.lidar.geometry import (
    FIRST_STEP,
    FRONT_STEP,
    GREATEST_RANGE,
    LAST_STEP,
    LEAST_RANGE,
    POINTS,
    STEPS_PER_TURN,
    bearings,
)
from bluefoot_mpc.io.lidar.replies import (
    DATA,
    LASER_IS_ON,
    OK,
    Parameters,
    Reply,
    ReplyParser,
    distances_of,
    facts_of,
    is_same_command,
    parameters_of,
    scan_command,
    stamp_of,
)
from bluefoot_mpc.io.lidar.sensor_time import SensorTime
from bluefoot_mpc.io.link import Link, LinkError
from bluefoot_mpc.io.retry import Retry
from bluefoot_mpc.types import LidarScan

_READ = 16384
_BITS_PER_BYTE = 10
_SCAN = scan_command()
_PASSING = {"98", *(str(code) for code in range(21, 50))}
"""Status while the sensor checks itself after a fault, and when it goes on."""


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarStatistics:
    """Counts since the driver was made.

    Attributes:
        scans: good scans.
        bad_scans: scans with a wrong sum, length or character.
        bad_replies: pieces of bytes that were no reply.
        restarts: times that the sensor was set up anew.
        reconnects: times that the port was opened anew.
    """

    scans: int = 0
    bad_scans: int = 0
    bad_replies: int = 0
    restarts: int = 0
    reconnects: int = 0


class Lidar:
    """The host's end of the LIDAR's line; `poll` belongs into every command period.

    Args:
        link: line to the sensor; may be dead already.
        clock: clock that the link was made with.
        config: times.

    Attributes:
        fault: what is wrong; empty while scans come.
        facts: what the sensor said of itself: vendor, product, firmware, serial number.
    """

    def __init__(self, link: Link, clock: Clock, config: LidarConfig | None = None) -> None:
        self._link, self._clock = link, clock
        self._config = config = config or LidarConfig()
        self._parser = ReplyParser()
        self._time = SensorTime(config)
        self._retry = Retry(config.retry_first, config.retry_longest)
        self._bearing = bearings()
        self._bearing.flags.writeable = False
        self._newest: LidarScan | None = None
        self._before: NDArray[np.int64] | None = None
        self._same = 0
        self._counts = {"scans": 0, "bad_scans": 0, "restarts": 0}
        self._closed = False
        self._is_open = True
        self.fault = "not started"
        self.facts: dict[str, str] = {}
        self._begin()

    # -- for the robot ---------------------------------------------------------------

    def start(self) -> None:
        """Wait for the first scan.

        Raises:
            LidarError: it does not come, or the sensor is not a URG-04LX; the message says why.
        """
        end = self._clock.now() + self._config.start_timeout
        while self.fault:
            if self._clock.now() >= end:
                raise LidarError(f"LIDAR {self._link.name}: {self.fault}. Check its cable, supply and port")
            self.poll()
            if self.fault:
                self._clock.sleep_until(self._clock.now() + 0.002)

    def poll(self) -> None:
        """Take in what has arrived and send what is due; returns at once and never raises."""
        if self._closed:
            return
        now = self._clock.now()
        try:
            if not self._is_open:
                self._reopen(now)
                return
            for reply in self._parser.feed(self._link.read(_READ, now)):
                self._take_in(reply, now)
            self._go_on(now)
        except LinkError as error:
            self._lose(str(error), now)

    def take(self) -> LidarScan | None:
        """The newest scan, if it is newer than at the last call."""
        scan, self._newest = self._newest, None
        return scan

    def close(self) -> None:
        """Stop the measurement and give the port back. Idempotent, never raises."""
        if not self._closed and self._is_open:
            try:
                self._link.write(b"QT\n")
            except LinkError:
                self._is_open = False
        self._closed = True
        self._link.close()

    @property
    def statistics(self) -> LidarStatistics:
        """Counts since the driver was made."""
        return LidarStatistics(**self._counts, bad_replies=self._parser.bad, reconnects=self._retry.successes)

    def findings(self) -> tuple[Finding, ...]:
        """The LIDAR's part of a check; a robot can walk without it, so nothing here refuses."""
        part = f"LIDAR {self._link.name}"
        if self.fault:
            mend = "Check its cable, supply and port; without it the robot walks but does not see"
            return (Finding(part=part, text=self.fault, mend=mend, severity=Severity.WARNING),)
        name = f"{self.facts.get('PROD', 'sensor')}, firmware {self.facts.get('FIRM', 'unknown')}"
        return (Finding(part=part, text=f"measures ({name})"),)

    # -- setting up ----------------------------------------------------------------------

    def _begin(self) -> None:
        """Set the sensor up from the beginning: whatever it does now, QT ends it."""
        requests = [b"TM1"] * self._config.clock_requests
        self._todo = [b"QT", b"VV", b"PP", b"TM0", *requests, b"TM2", b"BM", _SCAN]
        # A sensor that still speaks SCIP 1.1 is told to change; one that does not calls it unknown.
        self._prefix = b"SCIP2.0\n"
        self._tries = 0
        self._sent = self._scanned = math.nan
        self._before = None

    def _go_on(self, now: float) -> None:
        config = self._config
        if not self._todo:
            if now - self._scanned > config.silence:
                self._restart(f"no good scan for {now - self._scanned:.1f} s", now)
        elif math.isnan(self._sent):
            self._send(now)
        elif now - self._sent > config.answer:
            if self._tries >= config.tries:
                self._lose(f"no answer to {self._todo[0].decode('ascii')}", now)
            else:
                self._send(now)

    def _send(self, now: float) -> None:
        data = self._prefix + self._todo[0] + b"\n"
        self._prefix = b""
        self._tries += 1
        self._link.write(data)
        self._sent = now + len(data) * _BITS_PER_BYTE / self._link.baud

    def _take_in(self, reply: Reply, now: float) -> None:
        if not self._todo:
            if is_same_command(reply.echo, _SCAN):
                self._on_scan(reply, now)
            return
        if math.isnan(self._sent) or not is_same_command(reply.echo, self._todo[0]) or reply.status == DATA:
            return
        try:
            refusal = self._on_answer(reply)
        except ScipError as error:
            # Damaged on its way: the command is sent again when its time is over.
            self.fault = str(error)
            return
        if refusal:
            self._lose(refusal, now)
            return
        self._todo.pop(0)
        self._tries = 0
        self._sent = math.nan
        self._scanned = now
        if self._todo:
            self._send(now)

    def _on_answer(self, reply: Reply) -> str:
        """Take an answer; gives what is wrong with it, or nothing."""
        command = reply.echo.decode("ascii")
        if reply.status != OK and not (command == "BM" and reply.status == LASER_IS_ON):
            if command in ("TM0", "TM2") and reply.status in ("02", "03"):
                return ""
            return f"the sensor answered {command} with status {reply.status}" + (
                ": its laser is broken" if command == "BM" else ""
            )
        if command == "VV":
            self.facts = facts_of(reply)
        elif command == "PP":
            return _misfit(parameters_of(reply))
        elif command == "TM0":
            self._time.reset()
        elif command == "TM1":
            self._time.compare(stamp_of(reply), self._sent)
        return ""

    # -- measuring -------------------------------------------------------------------------

    def _on_scan(self, reply: Reply, now: float) -> None:
        if reply.status != DATA:
            if reply.status not in (OK, *_PASSING):
                self._restart(f"the sensor reports trouble, status {reply.status}", now)
            return
        try:
            stamp, distances = stamp_of(reply), distances_of(reply, POINTS)
        except ScipError:
            self._counts["bad_scans"] += 1
            return
        time = self._time.sweep_end(stamp, now)
        if time is None:
            self._restart("the sensor's clock has jumped", now)
            return
        self._counts["scans"] += 1
        self._scanned = now
        self._retry.settled()
        is_live = self._is_live(distances)
        self.fault = "" if is_live else "the same scan again and again: the sensor is not measuring"
        outside = (distances < LEAST_RANGE) | (distances > GREATEST_RANGE)
        meters = np.where(outside, np.nan, distances * 0.001)
        self._newest = LidarScan(time=time, bearing=self._bearing, distance=meters, valid=is_live)

    def _is_live(self, distances: NDArray[np.int64]) -> bool:
        """False after several identical scans; nothing but error codes may well be the same each time."""
        before, self._before = self._before, distances
        if before is None or not np.array_equal(before, distances) or int(distances.max()) < LEAST_RANGE:
            self._same = 1
        else:
            self._same += 1
        return self._same < self._config.frozen_scans

    # -- losing and finding again ---------------------------------------------------------------

    def _restart(self, reason: str, now: float) -> None:
        self.fault = reason
        self._counts["restarts"] += 1
        self._begin()
        self._send(now)

    def _lose(self, reason: str, now: float) -> None:
        self.fault = reason
        self._is_open = False
        self._retry.begin(now)

    def _reopen(self, now: float) -> None:
        if self._retry.is_due(now):
            self._link.reopen()
            self._retry.succeeded()
            self._is_open = True
            self._parser.reset()
            self._begin()


def _misfit(found: Parameters) -> str:
    """What of a sensor differs from a URG-04LX; empty where nothing does."""
    wanted = {
        "first step": (found.first_step, FIRST_STEP),
        "last step": (found.last_step, LAST_STEP),
        "front step": (found.front_step, FRONT_STEP),
        "steps a turn": (found.steps_per_turn, STEPS_PER_TURN),
        "least range in mm": (found.least_range, LEAST_RANGE),
        "greatest range in mm": (found.greatest_range, GREATEST_RANGE),
    }
    wrong = [f"{name} {is_} instead of {must}" for name, (is_, must) in wanted.items() if is_ != must]
    return f"{found.model} is not a URG-04LX: {', '.join(wrong)}" if wrong else ""
