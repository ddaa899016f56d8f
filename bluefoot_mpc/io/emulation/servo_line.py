"""Emulated AX-12A servos on one half-duplex line: who hears, who answers when, and who talks over whom.

Source: ROBOTIS' Protocol 1.0 and AX-12A e-manual. All servos hear the same
bytes, so they are parsed once for all that listen at the host's baud rate; the
others make nothing of them and stay silent. A reply starts one return delay
after its request's end and reaches the host as a whole, as a USB adapter hands
it on. Where the manual is silent:

- More than 143 bytes cannot be a packet: they are dropped and a header is looked for anew.
- A packet with a wrong sum is answered with a checksum error by the servo with its ID.
- Two that talk at once: host's bytes are lost, servos' bytes arrive garbled.
- Two servos with one ID answer at once; what arrives is neither's.
"""

from __future__ import annotations

import math
from collections import Counter, deque
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.emulation.ax12a import EmulatedServo
from bluefoot_mpc.io.emulation.ax12a_table import BROADCAST, CHECKSUM, PING, READ, RETURN_DELAY, SYNC_WRITE
from bluefoot_mpc.io.emulation.shafts import Shafts

RECEIVE_BUFFER = 143
"""Bytes, the longest packet that a servo takes."""
BYTE_TIMEOUT = 0.1
"""s between bytes after which what came before is forgotten."""
BAUD_TOLERANCE = 0.03
"""Share by which two baud rates may differ and still be understood."""
DELAY_UNIT = 2e-6
"""s of one count of the return-delay register."""

_HEADER = b"\xff\xff"


@dataclass(slots=True)
class _Burst:
    """Bytes of a servo on the line: when they start and end (s)."""

    start: float
    end: float
    data: bytes


class ServoLine:
    """Servos on a line: a `Device`.

    Args:
        shafts: the joints; servo `i` turns joint `i`.
        ids: of the servos at the start, all different.
        baud: bit/s of servos and host at the start; the host's can be changed by `host_baud`.

    Attributes:
        all: the servos by joint.
        servos: the servos by the ID that they had at the start.
        host_baud: bit/s that the host talks with.
        violation_kinds: protocol violations seen, how often by kind: ``"collision"``, ``"checksum"``,
            ``"length"``, ``"garbage"``, ``"timeout"``, ``"overlap"`` (of replies).
        shafts: the joints.
        is_switch_stuck: the power switch does nothing.
        requests: instruction packets understood, by instruction.
    """

    def __init__(self, shafts: Shafts, ids: Sequence[int], baud: int = 1_000_000) -> None:
        _check_ids(ids)
        self.host_baud = baud
        self.violation_kinds: Counter[str] = Counter()
        self.requests: Counter[int] = Counter()
        self.shafts = shafts
        self.is_switch_stuck = False
        register = baud_register(baud)
        self.all = tuple(EmulatedServo(shafts, i, n, register, self._rewire) for i, n in enumerate(ids))
        self.servos = dict(zip(ids, self.all, strict=True))
        self._is_powered = True
        self._heard_by: dict[int, list[EmulatedServo]] | None = None
        self._heard_baud = baud
        self._buffer = b""
        self._last_byte = -math.inf
        self._bursts: deque[_Burst] = deque()

    # The line.

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes from the host of which the last arrived at `time` (s)."""
        if not data:
            return
        self.shafts.advance(time)
        byte_time = 10.0 / self.host_baud
        start = time - len(data) * byte_time
        if start - self._last_byte > BYTE_TIMEOUT and self._buffer:
            self.violation_kinds["timeout"] += 1
            self._buffer = b""
        self._last_byte = time
        if self._bursts and self._collide(start, time, byte_time):
            self._buffer = b""
            return
        whole = self._buffer + data if self._buffer else data
        self._buffer = b""
        self._parse(whole, time, byte_time)

    def due(self) -> float:
        """Time (s) at which the host has the next reply; infinity where none is on its way."""
        return self._bursts[0].end if self._bursts else math.inf

    def transmit(self, time: float) -> bytes:
        """Every reply that has arrived at the host by `time` (s) and was not handed out before."""
        # Time passes for the shafts also while the host only listens, or is silent for an hour.
        self.shafts.advance(time)
        bursts = self._bursts
        data = b""
        while bursts and bursts[0].end <= time:
            data += bursts.popleft().data
        return data

    # Supply and plugs.

    @property
    def is_powered(self) -> bool:
        """The servos' supply."""
        return self._is_powered

    @property
    def violations(self) -> int:
        """Protocol violations seen, of all kinds."""
        return self.violation_kinds.total()

    @property
    def eeprom_writes(self) -> int:
        """Instructions that wrote to the EEPROM of any servo."""
        return sum(servo.eeprom_writes for servo in self.all)

    @property
    def goal_writes_while_off(self) -> int:
        """Goals that switched the torque of a servo on."""
        return sum(servo.goal_writes_while_off for servo in self.all)

    def power(self, on: bool, time: float) -> None:
        """Switch the servos' supply at `time` (s): off is limp and deaf, and the RAM is lost."""
        if on == self._is_powered or self.is_switch_stuck:
            return
        self.shafts.advance(time)
        self._is_powered = on
        for servo in self.all:
            self._supply(servo, time)

    def plug(self, servo: EmulatedServo, is_plugged: bool, time: float) -> None:
        """Unplug a servo from line and supply, or plug it in again, at `time` (s)."""
        if is_plugged == servo.is_plugged:
            return
        self.shafts.advance(time)
        servo.is_plugged = is_plugged
        self._supply(servo, time)

    def _supply(self, servo: EmulatedServo, time: float) -> None:
        if self._is_powered and servo.is_plugged:
            servo.power_up(time)
        else:
            servo.power_down()

    # Packets.

    def _parse(self, data: bytes, time: float, byte_time: float) -> None:
        """Find the packets in `data`, whose last byte arrived at `time`; keep an unfinished rest."""
        at, size = 0, len(data)
        while at < size:
            at = self._to_header(data, at)
            if size - at < 4:
                break
            length = data[at + 3]
            end = at + 4 + length
            if length < 2 or end - at > RECEIVE_BUFFER:
                self.violation_kinds["length"] += 1
                at += 2
                continue
            if end > size:
                break
            self._packet(data[at:end], time - (size - end) * byte_time)
            at = end
        self._buffer = data[at:]

    def _to_header(self, data: bytes, at: int) -> int:
        """Where the next header starts, or where an unfinished one may."""
        start = at
        while True:
            at = data.find(_HEADER, at)
            if at < 0:
                at = len(data) - 1 if data[-1] == 0xFF else len(data)
                break
            if data[at + 2 : at + 3] != b"\xff":
                break
            at += 1
        if at > start:
            self.violation_kinds["garbage"] += 1
        return at

    def _packet(self, packet: bytes, end: float) -> None:
        """Let the servos that a whole packet is for act on it; `end` is its last byte's time (s)."""
        identity, instruction = packet[2], packet[4]
        heard_by = self._listeners()
        is_sound = not (sum(packet[2:]) + 1) & 0xFF
        if not is_sound:
            self.violation_kinds["checksum"] += 1
            self._answer([(s, s.complain(CHECKSUM, end)) for s in self._of(identity, end)], end)
            return
        self.requests[instruction] += 1
        data = packet[5:-1]
        if instruction == SYNC_WRITE and identity == BROADCAST:
            self._sync_write(data, end)
            return
        if identity == BROADCAST:
            if instruction not in (PING, READ):
                for servo in [s for group in heard_by.values() for s in group]:
                    if servo.hears(end):
                        servo.execute(instruction, data, end)
            return
        self._answer([(s, s.execute(instruction, data, end)) for s in self._of(identity, end)], end)

    def _sync_write(self, data: bytes, end: float) -> None:
        width = data[1] + 1 if len(data) > 1 else 0
        if width < 2 or (len(data) - 2) % width:
            self.violation_kinds["length"] += 1
            return
        address = data[0]
        for at in range(2, len(data), width):
            for servo in self._of(data[at], end):
                servo.store(address, data[at + 1 : at + width], end)

    def _of(self, identity: int, time: float) -> list[EmulatedServo]:
        """Servos with an ID that hear what comes now."""
        group = self._listeners().get(identity)
        return [servo for servo in group if servo.hears(time)] if group else []

    def _listeners(self) -> dict[int, list[EmulatedServo]]:
        """Servos at the host's baud rate, by ID."""
        if self._heard_by is None or self._heard_baud != self.host_baud:
            self._heard_baud = self.host_baud
            self._heard_by = {}
            for servo in self.all:
                if abs(servo.baud - self.host_baud) <= BAUD_TOLERANCE * self.host_baud:
                    self._heard_by.setdefault(servo.identity, []).append(servo)
        return self._heard_by

    def _rewire(self) -> None:
        self._heard_by = None

    # Replies.

    def _answer(self, replies: Sequence[tuple[EmulatedServo, bytes | None]], end: float) -> None:
        """Put replies to a packet that ended at `end` (s) on the line."""
        for servo, data in replies:
            if data is None:
                continue
            start = end + servo.registers[RETURN_DELAY] * DELAY_UNIT
            self._enqueue(_Burst(start, start + len(data) * 10.0 / servo.baud, data))

    def _enqueue(self, burst: _Burst) -> None:
        """Put a reply on the line, mixed with one that is there at the same time."""
        bursts = self._bursts
        if bursts and burst.start < bursts[-1].end:
            for other in [other for other in bursts if burst.start < other.end and other.start < burst.end]:
                self.violation_kinds["overlap"] += 1
                bursts.remove(other)
                data = _mixed(other.data, burst.data)
                burst = _Burst(min(burst.start, other.start), max(burst.end, other.end), data)
            bursts.append(burst)
            self._bursts = deque(sorted(bursts, key=lambda entry: entry.end))
        else:
            bursts.append(burst)

    def _collide(self, start: float, end: float, byte_time: float) -> bool:
        """Garble the replies that the host talks over between `start` and `end` (s); True where it did."""
        is_hit = False
        for burst in self._bursts:
            # Half a byte of tolerance: a host may start the moment the last byte is in.
            if start < burst.end - 0.5 * byte_time and end > burst.start + 0.5 * byte_time:
                is_hit = True
                first = max(0, math.floor((start - burst.start) / byte_time))
                last = math.ceil((end - burst.start) / byte_time)
                data = bytearray(burst.data)
                data[first:last] = bytes(byte & 0x55 for byte in data[first:last])
                burst.data = bytes(data)
        self.violation_kinds["collision"] += is_hit
        return is_hit


def _mixed(first: bytes, second: bytes) -> bytes:
    """What arrives of two replies at once: the line is low where either is, one bit apart."""
    size = max(len(first), len(second))
    pairs = zip(first.ljust(size, b"\xff"), second.ljust(size, b"\xff"), strict=True)
    return bytes(a & (b >> 1 | 0x80) for a, b in pairs)


def baud_register(baud: int) -> int:
    """Value of register 4 for a rate (bit/s).

    Raises:
        ConfigurationError: no servo talks at it.
    """
    register = round(2_000_000 / baud) - 1 if baud > 0 else -1
    if not 0 <= register <= 254 or abs(2_000_000 / (register + 1) - baud) > BAUD_TOLERANCE * baud:
        raise ConfigurationError(
            f"no AX-12A talks at {baud} bit/s; rates are 2000000/(1..255), for example 1000000, 500000, "
            "115200, 57600"
        )
    return register


def _check_ids(ids: Sequence[int]) -> None:
    if not ids:
        raise ConfigurationError("a line without servos: give at least one ID")
    wrong = [identity for identity in ids if not 0 <= identity <= 253]
    if wrong:
        raise ConfigurationError(f"servo ID {wrong[0]} must lie in 0..253")
    twice = [identity for identity, count in Counter(ids).items() if count > 1]
    if twice:
        raise ConfigurationError(f"servo ID {twice[0]} is given twice; IDs must differ")
