"""Driver of the sensor and power board: never waits, and reconnects by itself."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable

import numpy as np

from bluefoot_mpc.io.board.board_time import BoardTime
from bluefoot_mpc.io.board.config import BoardConfig
from bluefoot_mpc.io.board.framing import FrameParser, encode_frame
from bluefoot_mpc.io.board.imu_watch import ImuWatch
from bluefoot_mpc.io.board.messages import (
    PROTOCOL,
    WORD,
    Hello,
    ImuSample,
    Kind,
    Message,
    MessageError,
    Power,
    Refusal,
    Switches,
    TimeReply,
    decode,
)
from bluefoot_mpc.io.board.power_control import Order, PowerControl
from bluefoot_mpc.io.board.readings import BoardReadings, BoardStatistics
from bluefoot_mpc.io.board.switch_watch import SwitchWatch
from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.findings import Finding, Severity
from bluefoot_mpc.io.link import Link, LinkError
from bluefoot_mpc.io.retry import Retry
from bluefoot_mpc.types import N_LEGS

_READ = 4096
_BITS_PER_BYTE = 10
_TIME_REQUEST_BYTES = 10
"""Bytes of a request on the line: type, sequence, token, CRC, stuffing, end."""


class SensorBoard:
    """The host's end of the board link.

    `poll` and `beat` belong into every command period, on the thread that owns
    the link; `cut` alone may be called from any thread.

    Args:
        link: line to the board; may be dead already.
        clock: clock that the link was made with.
        config: thresholds.
    """

    def __init__(self, link: Link, clock: Clock, config: BoardConfig | None = None) -> None:
        self._link, self._clock = link, clock
        self._config = config = config or BoardConfig()
        self._parser = FrameParser()
        self._time = BoardTime(config)
        self._imu = ImuWatch(config)
        self._switches = SwitchWatch(config)
        self._power = PowerControl(config)
        self._retry = Retry(config.retry_first, config.retry_longest)
        self._lock = threading.Lock()
        self._sequence = 0
        self._heartbeats = 0
        self._bad_messages = 0
        self._heard = clock.now()
        self._lost: str = ""
        self._closed = False
        self.hello: Hello | None = None

    # -- every command period ---------------------------------------------------

    def poll(self) -> None:
        """Take in what has arrived and send what is due; returns at once and never raises."""
        if self._closed:
            return
        now = self._clock.now()
        if self._lost:
            self._reconnect(now)
            return
        try:
            data = self._link.read(_READ, now)
        except LinkError as error:
            self._lose(str(error), now)
            return
        for frame in self._parser.feed(data):
            self._heard = now
            self._retry.settled()
            try:
                self._dispatch(decode(frame), now)
            except MessageError:
                self._bad_messages += 1
        if now - self._heard > self._config.link_silence:
            self._lose(f"nothing understandable for {now - self._heard:.1f} s", now)
            return
        self._send_due(now)

    def beat(self) -> None:
        """Send a heartbeat: without it the board cuts the servos' power. After a cut none is sent."""
        if not self._power.is_cut and self._send([(Kind.HEARTBEAT, b"")]):
            self._heartbeats += 1

    def take(self) -> BoardReadings:
        """Newest data, and all inertial samples since the last time."""
        now = self._clock.now()
        imu_fault = self._imu.fault(now)
        contact_valid, switch_faults = self._switches.judge(now)
        report, config = self._power.report, self._config
        voltage = math.nan if report is None else report.voltage
        is_fresh = now - self._power.heard <= config.power_silence
        return BoardReadings(
            time=now,
            imu=self._imu.take(),
            imu_valid=not imu_fault,
            contact=self._switches.closed,
            contact_time=np.full(N_LEGS, self._switches.time),
            contact_valid=contact_valid,
            voltage=voltage,
            voltage_valid=is_fresh and config.voltage_min <= voltage <= config.voltage_max,
            current=math.nan if report is None else report.current,
            temperature=math.nan if report is None else report.temperature,
            power_on=self._power.power_on,
            connected=not self._lost,
            faults=self._faults(now, imu_fault, switch_faults),
            statistics=self.statistics,
        )

    # -- power ------------------------------------------------------------------

    def power(self, on: bool) -> None:
        """Ask for the servos' power, or switch it off; what came of it is in the readings.

        On takes a few calls of `poll`, and heartbeats.
        """
        if not on:
            self.cut()
            return
        with self._lock:
            orders = self._power.want_on(self._clock.now())
        self._send(orders)

    def cut(self) -> None:
        """Cut the servos' power at once, from any thread; repeated until the board says that it is off."""
        with self._lock:
            orders = self._power.cut(self._clock.now())
        # A board that is not heard may still hear.
        self._send(orders, even_if_lost=True)

    @property
    def is_cut(self) -> bool:
        """True from a cut until power is asked for again."""
        return self._power.is_cut

    def wait_power(
        self, on: bool, timeout: float = 1.0, meanwhile: Callable[[], object] = lambda: None
    ) -> bool:
        """Poll and beat until the power is as asked for; False where it is not in time or was refused.

        Args:
            on: what was asked for with `power`.
            timeout: s.
            meanwhile: called every 5 ms.
        """
        end = self._clock.now() + timeout
        while self._clock.now() < end:
            self.poll()
            self.beat()
            meanwhile()
            if self._power.power_on == on or (on and self._power.refused):
                break
            self._clock.sleep_until(self._clock.now() + 0.005)
        return self._power.power_on == on

    # -- for checks --------------------------------------------------------------

    @property
    def statistics(self) -> BoardStatistics:
        """Counts since the driver was made."""
        return BoardStatistics(
            frames=self._parser.frames,
            bad_frames=self._parser.bad,
            bad_messages=self._bad_messages,
            lost_frames=self._parser.lost,
            imu_samples=self._imu.samples,
            imu_invalid=self._imu.invalid,
            imu_dropped=self._imu.dropped,
            time_jumps=self._time.jumps,
            reconnects=self._retry.successes,
            heartbeats=self._heartbeats,
        )

    def findings(self) -> tuple[Finding, ...]:
        """The board's part of a check before arming; takes no samples. `poll` must have run for 0.2 s."""
        now = self._clock.now()
        part = f"board {self._link.name}"
        faults = self._faults(now, self._imu.fault(now), self._switches.judge(now)[1])
        if faults:
            mend = "Check the board's cable, supply and firmware (docs/board-protocol.md)"
            return tuple(
                Finding(part=part, text=fault, mend=mend, severity=Severity.REFUSAL) for fault in faults
            )
        hello = self.hello
        version = "" if hello is None else f", firmware {hello.firmware[0]}.{hello.firmware[1]}"
        voltage = math.nan if self._power.report is None else self._power.report.voltage
        return (Finding(part=part, text=f"answers, battery {voltage:.2f} V{version}"),)

    def close(self) -> None:
        """Give the port back. The board cuts the servos' power when heartbeats stay away. Idempotent."""
        self._closed = True
        self._link.close()

    # -- inside --------------------------------------------------------------------

    def _dispatch(self, message: Message, now: float) -> None:
        match message:
            case ImuSample():
                self._imu.add(message, self._time.stamp(message.count, now), now)
            case Switches():
                self._switches.add(message, self._time.host_time(message.count, now), now)
            case Power():
                self._power.on_report(message, now)
            case TimeReply():
                self._time.answer(message.token, message.count)
            case Refusal():
                self._power.on_refusal(message)
            case Hello():
                self.hello = message
                if message.started:
                    self._time.reset()
                    self._switches.restart()
            case int():
                self._send(self._power.on_code(message))

    def _send_due(self, now: float) -> None:
        orders = self._power.orders(now)
        token = self._time.request(now, _TIME_REQUEST_BYTES * _BITS_PER_BYTE / self._link.baud)
        if token is not None:
            # First in the queue, so that its way to the board takes as long as is thought.
            orders.insert(0, (Kind.GET_TIME, WORD.pack(token)))
            if self.hello is None:
                orders.append((Kind.GET_HELLO, b""))
        self._send(orders)

    def _send(self, orders: list[Order] | tuple[Order, ...], even_if_lost: bool = False) -> bool:
        if not orders or self._closed or (self._lost and not even_if_lost):
            return False
        with self._lock:
            data = b""
            for kind, payload in orders:
                data += encode_frame(kind, self._sequence, payload)
                self._sequence = (self._sequence + 1) & 0xFF
            try:
                self._link.write(data)
            except LinkError as error:
                self._lose(str(error), self._clock.now())
                return False
        return True

    def _lose(self, reason: str, now: float) -> None:
        self._lost = reason
        self._retry.begin(now)

    def _reconnect(self, now: float) -> None:
        if not self._retry.is_due(now):
            return
        try:
            self._link.reopen()
        except LinkError as error:
            self._lost = str(error)
            self._retry.begin(now)
            return
        self._retry.succeeded()
        self._lost = ""
        self._heard = now
        self._parser.reset()
        self._time.reset()
        self._switches.restart()

    def _faults(self, now: float, imu: str, switches: tuple[str, ...]) -> tuple[str, ...]:
        is_fresh = now - self._power.heard <= self._config.power_silence
        return (
            *((f"board link {self._link.name}: {self._lost}",) if self._lost else ()),
            *((imu,) if imu else ()),
            *switches,
            *(() if is_fresh else ("battery voltage: nothing heard from the board",)),
            *self._power.faults(now),
            *self._version_fault(),
        )

    def _version_fault(self) -> tuple[str, ...]:
        hello = self.hello
        if hello is None or hello.protocol == PROTOCOL:
            return ()
        return (
            f"the board speaks version {hello.protocol} of its protocol, this program {PROTOCOL}: "
            f"update the board's firmware",
        )
