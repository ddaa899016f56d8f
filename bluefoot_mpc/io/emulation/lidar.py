"""An emulated URG-04LX: SCIP 2.0 byte by byte, in the time that scans and bytes take."""

from __future__ import annotations

import dataclasses
import math
from collections import deque
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bluefoot_mpc.io.emulation.lidar_replies import (
    LASER_IS_OFF,
    PARAMETERS,
    UNKNOWN,
    VERSION,
    Request,
    answer,
    bit_rate_status,
    facts,
    motor_status,
    parse_request,
    scan_body,
    time_line,
)
from bluefoot_mpc.io.emulation.outbox import arrived
from bluefoot_mpc.io.lidar.geometry import SCAN_PERIOD, SWEEP_END
from bluefoot_mpc.settings import require_finite, require_nonnegative, require_positive

_STAMP_MASK = 0xFFFFFF
_LONGEST_COMMAND = 64


class LidarSource(Protocol):
    """What the LIDAR sees: a simulated world, say."""

    def scan(self, time: float) -> ArrayLike:
        """(682,) mm of a sweep that ends at `time` (s), right to left; below 20 they are error codes."""
        ...


@dataclass(frozen=True, kw_only=True, slots=True)
class LidarTimes:
    """The sensor's speed and its clock against the line's."""

    byte_time: float = 1e-6  # s a byte takes; USB carries a scan in 2 ms, a port of 115200 bit/s in 186 ms
    latency: float = 0.0005  # s from a command, or the end of a sweep, to the first byte
    clock_offset: float = 0.0  # s, sensor's clock at time 0
    clock_drift: float = 0.0  # s/s, by how much it runs fast

    def __post_init__(self) -> None:
        require_positive(byte_time=self.byte_time)
        require_nonnegative(latency=self.latency)
        require_finite(clock_offset=self.clock_offset, clock_drift=self.clock_drift)


class EmulatedLidar:
    """The URG-04LX (a `Device`).

    Args:
        source: what it sees.
        times: speeds.
        start: s, time of switching on; the head is at step 0 then.

    Attributes:
        silent: fault: nothing is sent, nothing heard.
        parameters: what PP answers: to be another sensor, change it.
        laser_on: True while it can measure.
        skipped: scans so far that were not sent because the line was busy.
    """

    def __init__(self, source: LidarSource, times: LidarTimes | None = None, start: float = 0.0) -> None:
        self._source, self._times, self._start = source, times or LidarTimes(), start
        self._inbox: deque[tuple[float, bytes]] = deque()
        self._out: deque[tuple[float, bytes]] = deque()
        self._line_free = start
        self._command = b""
        self._turns = 0
        self._skip = 0
        self.silent = False
        self.parameters = PARAMETERS
        self.skipped = 0
        self._clear()

    def _clear(self) -> None:
        self._request: Request | None = None
        self._is_adjusting = False
        self._bit_rate, self._speed = "019200", "00"
        self.laser_on = False

    # -- Device -----------------------------------------------------------------------

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes of which the last arrived at `time` (s); they act when that time has come."""
        self._inbox.append((time, data))

    def due(self) -> float:
        """Time (s) at which the host has the sensor's next byte; infinity where none is on its way."""
        wait = self._times.latency + self._times.byte_time
        soonest = self._out[0][0] + self._times.byte_time if self._out else math.inf
        if self._inbox:
            soonest = min(soonest, self._inbox[0][0] + wait)
        return soonest if self._request is None else min(soonest, self._sweep_end() + wait)

    def transmit(self, time: float) -> bytes:
        """Every byte that has arrived at the host by `time` (s) and was not handed out before."""
        self._advance(time)
        return arrived(self._out, time, self._times.byte_time)

    # -- time --------------------------------------------------------------------------

    def _sweep_end(self) -> float:
        return self._start + self._turns * SCAN_PERIOD + SWEEP_END

    def _advance(self, time: float) -> None:
        while True:
            arrival = self._inbox[0][0] if self._inbox else math.inf
            end = self._sweep_end()
            if min(arrival, end) > time:
                return
            if arrival <= end:
                self._take_in(arrival, self._inbox.popleft()[1])
            else:
                self._sweep(end)
                self._turns += 1

    def _sweep(self, end: float) -> None:
        """A sweep ends; it is sent where one was asked for and the line is free."""
        request = self._request
        if request is None:
            return
        if self._line_free > end + self._times.latency:
            # The sensor has no room for a second scan: a slow line loses every other one.
            self.skipped += 1
            return
        if self._skip > 0:
            self._skip -= 1
            return
        self._skip = request.interval
        stamp = self._stamp(end - SWEEP_END)
        left = max(0, request.count - 1)
        name = f"{request.name}{request.first:04d}{request.last:04d}{request.cluster:02d}{request.interval}"
        self._send(answer(f"{name}{left:02d}", "99", scan_body(request, stamp, self._look(end))), end)
        self._request = dataclasses.replace(request, count=left) if request.count != 1 else None

    def _look(self, end: float) -> NDArray[np.int64]:
        return np.asarray(self._source.scan(end), dtype=np.int64)

    def _stamp(self, time: float) -> int:
        own = (time - self._start) * (1.0 + self._times.clock_drift) + self._times.clock_offset
        return math.floor(own * 1e3 + 1e-6) & _STAMP_MASK

    # -- commands --------------------------------------------------------------------------

    def _take_in(self, time: float, data: bytes) -> None:
        if self.silent:
            return
        *commands, rest = (self._command + data).replace(b"\r", b"\n").split(b"\n")
        self._command = rest[-_LONGEST_COMMAND:]
        for command in commands:
            if command:
                self._obey(command.decode("latin-1"), time)

    def _obey(self, command: str, time: float) -> None:
        if self._is_adjusting and command[:2] not in ("TM", "RS", "QT"):
            self._send(answer(command, "0B"), time)
            return
        handler = {
            "VV": self._version, "PP": self._parameters, "II": self._state, "BM": self._laser,
            "QT": self._quit, "RS": self._reset, "TM": self._adjust, "SS": self._rate, "CR": self._motor,
            "GD": self._once, "GS": self._once, "MD": self._measure, "MS": self._measure, "SC": self._scip,
        }.get(command[:2], self._unknown)  # fmt: skip
        handler(command, time)

    def _unknown(self, command: str, time: float) -> None:
        self._send(answer(command, UNKNOWN), time)

    def _scip(self, command: str, time: float) -> None:
        self._send(answer(command, "00" if command == "SCIP2.0" else UNKNOWN), time)

    def _version(self, command: str, time: float) -> None:
        self._send(answer(command, "00", facts(VERSION)), time)

    def _parameters(self, command: str, time: float) -> None:
        self._send(answer(command, "00", facts(self.parameters)), time)

    def _state(self, command: str, time: float) -> None:
        state = (
            ("MODL", PARAMETERS[0][1]),
            ("LASR", "ON" if self.laser_on else "OFF"),
            ("SCSP", "Initial(600[rpm])"),
            ("MESM", "IDLE" if self._request is None else "Measuring"),
            ("SBPS", "USB"),
            ("TIME", f"{self._stamp(time):06X}"),
            ("STAT", "Sensor works well."),
        )
        self._send(answer(command, "00", facts(state)), time)

    def _laser(self, command: str, time: float) -> None:
        status = "02" if self.laser_on else "00"
        self.laser_on = True
        self._send(answer(command, status), time)

    def _quit(self, command: str, time: float) -> None:
        self._request, self.laser_on = None, False
        self._send(answer(command, "00"), time)

    def _reset(self, command: str, time: float) -> None:
        self._clear()
        self._send(answer(command, "00"), time)

    def _adjust(self, command: str, time: float) -> None:
        code = command[2:3]
        if code not in ("0", "1", "2"):
            status = "01"
        elif code == "0":
            status = "02" if self._is_adjusting else "00"
            self._is_adjusting, self._request, self.laser_on = True, None, False
        elif not self._is_adjusting:
            status = "04" if code == "1" else "03"
        else:
            status = "00"
            self._is_adjusting = code == "1"
        has_time = code == "1" and status == "00"
        self._send(answer(command, status, time_line(self._stamp(time)) if has_time else b""), time)

    def _rate(self, command: str, time: float) -> None:
        status = bit_rate_status(command, self._bit_rate)
        if status == "00":
            self._bit_rate = command[2:]
        self._send(answer(command, status), time)

    def _motor(self, command: str, time: float) -> None:
        status = motor_status(command, self._speed)
        if status == "00":
            self._speed = command[2:]
        self._send(answer(command, status), time)

    def _once(self, command: str, time: float) -> None:
        request = parse_request(command)
        if isinstance(request, str):
            self._send(answer(command, request), time)
        elif not self.laser_on:
            self._send(answer(command, LASER_IS_OFF), time)
        else:
            end = self._sweep_end() - SCAN_PERIOD
            body = scan_body(request, self._stamp(end - SWEEP_END), self._look(end))
            self._send(answer(command, "00", body), time)

    def _measure(self, command: str, time: float) -> None:
        request = parse_request(command)
        if isinstance(request, str):
            self._send(answer(command, request), time)
            return
        self.laser_on = True
        self._request, self._skip = request, 0
        self._send(answer(command, "00"), time)

    def _send(self, data: bytes, time: float) -> None:
        if self.silent:
            return
        begin = max(time + self._times.latency, self._line_free)
        self._line_free = begin + len(data) * self._times.byte_time
        self._out.append((begin, data))
