"""An emulated sensor and power board: its messages byte by byte, its supply switch, and its faults."""

from __future__ import annotations

import math
import struct
from collections import deque

from bluefoot_mpc.io.board.framing import Frame, FrameParser, encode_frame
from bluefoot_mpc.io.board.messages import (
    PROTOCOL,
    WORD,
    CutReason,
    Hello,
    ImuSample,
    Kind,
    Power,
    Refusal,
    Switches,
    TimeReply,
    encode_hello,
    encode_imu,
    encode_power,
    encode_switches,
    encode_time,
)
from bluefoot_mpc.io.emulation.board_parts import BoardFaults, BoardSource, BoardTimes
from bluefoot_mpc.io.emulation.board_supply import SupplySwitch
from bluefoot_mpc.io.emulation.outbox import arrived
from bluefoot_mpc.types import N_LEGS, FloatArray

__all__ = ["BoardFaults", "BoardSource", "BoardTimes", "EmulatedBoard"]

_MICROSECONDS = 1e6
_COUNT_MASK = 0xFFFFFFFF
_NAN3 = (math.nan, math.nan, math.nan)
_SPAN = 0x100


class EmulatedBoard:
    """The board of docs/board-protocol.md (a `Device`).

    Its time passes whenever somebody asks it for bytes, gives it bytes, or calls
    `advance`; the cut after the last heartbeat happens at its exact time.

    Args:
        source: what it senses and switches.
        times: rates.
        start: s, time of switching on.
        seed: of the codes that switching on needs.

    Attributes:
        faults: faults to inject.
        supply: the switch of the servos' supply.
    """

    def __init__(
        self, source: BoardSource, times: BoardTimes | None = None, start: float = 0.0, seed: int = 0
    ) -> None:
        self._source, self._times = source, times or BoardTimes()
        self._parser = FrameParser()
        self._tick_time = self._since = start
        self._inbox: deque[tuple[float, bytes]] = deque()
        self._origin, self._ticks = start, 0
        self._out: deque[tuple[float, bytes]] = deque()
        self._line_free = start
        self._sequence = 0
        self._low_since = math.inf
        self._edges = [0] * N_LEGS
        self._closed: tuple[bool, ...] = (False,) * N_LEGS
        self._held: ImuSample | None = None
        self.faults = BoardFaults()
        self.supply = SupplySwitch(source.set_power, self._times.heartbeat, self._times.code_life, seed)
        self._send(Kind.HELLO, encode_hello(self._hello(start, started=True)), start)

    # -- Device --------------------------------------------------------------------

    @property
    def bad_frames(self) -> int:
        """Runs of bytes so far that were no frame."""
        return self._parser.bad

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes of which the last arrived at `time` (s); they act when that time has come."""
        self._inbox.append((time, data))

    def due(self) -> float:
        """Time (s) at which the host has the board's next byte."""
        byte = 10.0 / self._times.baud
        ahead = self._tick_time + self._times.tick + self._times.latency + byte
        if self._inbox:
            ahead = min(ahead, self._inbox[0][0] + self._times.latency + byte)
        return min(ahead, self._out[0][0] + byte) if self._out else ahead

    def transmit(self, time: float) -> bytes:
        """Every byte that has arrived at the host by `time` (s) and was not handed out before."""
        self.advance(time)
        return arrived(self._out, time, 10.0 / self._times.baud)

    # -- time ------------------------------------------------------------------------

    def advance(self, time: float) -> None:
        """Let the board's time pass until `time` (s)."""
        while True:
            tick = self._origin + (self._ticks + 1) * self._times.tick
            arrival = self._inbox[0][0] if self._inbox else math.inf
            moment = min(tick, arrival, self.supply.deadline)
            if moment > time:
                break
            self._source.advance(moment)
            if moment == arrival:
                self._take_in(moment, self._inbox.popleft()[1])
            elif moment == tick:
                self._ticks += 1
                self._tick_time = tick
                self._look(tick)
            else:
                self.supply.off(CutReason.HEARTBEAT)
        self._source.advance(time)

    def _take_in(self, time: float, data: bytes) -> None:
        if not self.faults.silent:
            for frame in self._parser.feed(data):
                self._obey(frame, time)

    def _look(self, time: float) -> None:
        """One tick of the firmware: read and send."""
        is_full = self._ticks % self._times.power_ticks == 0
        for sample in self._samples():
            self._send(Kind.IMU, encode_imu(sample), time)
        changed = self._read_switches()
        if changed or is_full:
            message = Switches(self._count(time), self._closed, tuple(self._edges))
            self._send(Kind.SWITCHES, encode_switches(message), time)
        if is_full:
            self._watch_voltage(time)
            self._send(Kind.POWER, encode_power(self._power(time)), time)

    def _samples(self) -> list[ImuSample]:
        batch = self._source.samples(self._since)
        if len(batch.time):
            self._since = float(batch.time[-1])
        faults = self.faults
        if faults.imu_silent:
            return []
        found: list[ImuSample] = []
        for row, time in enumerate(batch.time.tolist()):
            sample = ImuSample(
                self._count(time), _three(batch.gyro[row]), _three(batch.accel[row]),
                None if math.isnan(batch.magnetometer[row, 0]) else _three(batch.magnetometer[row]),
            )  # fmt: skip
            if faults.imu_frozen and self._held is not None:
                sample = ImuSample(sample.count, self._held.gyro, self._held.accel, None)
            if faults.imu_nan:
                sample = ImuSample(sample.count, _NAN3, _NAN3, None)
            self._held = sample
            found.append(sample)
        return found

    def _read_switches(self) -> bool:
        states: list[bool] = self._source.switches()[0].tolist()
        for leg, state in self.faults.stuck_switch.items():
            states[leg] = state
        for leg in self.faults.chattering:
            states[leg] = not self._closed[leg]
        closed = tuple(states)
        if closed == self._closed:
            return False
        for leg in range(N_LEGS):
            self._edges[leg] = (self._edges[leg] + (closed[leg] != self._closed[leg])) % _SPAN
        self._closed = closed
        return True

    def _watch_voltage(self, time: float) -> None:
        self._low_since = (
            min(self._low_since, time) if self._source.voltage() < self._times.cut_voltage else math.inf
        )
        if self.supply.on and time - self._low_since >= self._times.cut_delay:
            self.supply.off(CutReason.VOLTAGE)

    # -- orders ------------------------------------------------------------------------

    def _obey(self, frame: Frame, now: float) -> None:
        try:
            self._act(frame, now)
        except struct.error:
            # A payload of the wrong length: the firmware ignores it.
            return

    def _act(self, frame: Frame, now: float) -> None:
        match frame.kind:
            case Kind.HEARTBEAT:
                self.supply.beat(now)
            case Kind.GET_TIME:
                (token,) = WORD.unpack(frame.payload)
                self._send(Kind.TIME, encode_time(TimeReply(token, self._count(now))), now)
            case Kind.GET_HELLO:
                self._send(Kind.HELLO, encode_hello(self._hello(now, started=False)), now)
            case Kind.GET_CODE:
                code = self.supply.code(WORD.unpack(frame.payload)[0], now)
                if isinstance(code, Refusal):
                    self._send(Kind.REFUSED, bytes((code,)), now)
                else:
                    self._send(Kind.CODE, WORD.pack(code), now)
            case Kind.POWER_ON:
                is_low = self._source.voltage() < self._times.cut_voltage
                refusal = self.supply.enable(WORD.unpack(frame.payload)[0], now, is_low)
                if refusal is not None:
                    self._send(Kind.REFUSED, bytes((refusal,)), now)
            case Kind.POWER_CUT:
                self.supply.off(CutReason.COMMAND)

    # -- messages -------------------------------------------------------------------

    def _count(self, time: float) -> int:
        times = self._times
        board = time * (1.0 + times.clock_drift) + times.clock_offset + self.faults.clock_jump
        return round(board * _MICROSECONDS) & _COUNT_MASK

    def _hello(self, time: float, started: bool) -> Hello:
        return Hello(PROTOCOL, (1, 0), 1, self._count(time), started)

    def _power(self, time: float) -> Power:
        return Power(
            self._count(time), self._source.voltage(), self._source.current(), 30.0,
            self.supply.on, self.supply.live, self.supply.cut,
        )  # fmt: skip

    def _send(self, kind: Kind, payload: bytes, time: float) -> None:
        frame = encode_frame(kind, self._sequence, payload)
        self._sequence = (self._sequence + 1) % _SPAN
        if self.faults.silent:
            return
        begin = max(time + self._times.latency, self._line_free)
        self._line_free = begin + len(frame) * 10.0 / self._times.baud
        self._out.append((begin, frame))


def _three(values: FloatArray) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
