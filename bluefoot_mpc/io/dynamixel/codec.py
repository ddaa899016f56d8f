"""Packets of ROBOTIS' Protocol 1.0, pure: bytes from values, and values from any pieces of bytes.

A packet is ``FF FF ID LEN X P… CHK``: X is an instruction or, in an answer, the
error bits; LEN counts X, the parameters and CHK; CHK is the inverted low byte of
the sum from ID to the last parameter (source: ROBOTIS e-manual, Protocol 1.0).
"""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Generic, TypeVar

HEADER = b"\xff\xff"
BROADCAST_ID = 254
"""ID that every servo obeys and none answers."""

LAST_ID = 253
OVERHEAD = 6
"""Bytes of a packet without parameters."""

RECEIVE_BUFFER = 143
"""Bytes of the longest packet that an AX-12A takes (its receive buffer)."""

TABLE_SIZE = 50
"""Bytes of the AX-12A's control table: no answer can have more parameters."""


class Instruction(enum.IntEnum):
    """Instructions that an AX-12A knows; there is neither bulk read nor sync read."""

    PING = 1
    READ = 2
    WRITE = 3
    REG_WRITE = 4
    ACTION = 5
    RESET = 6
    SYNC_WRITE = 0x83


class ErrorBit(enum.IntFlag):
    """Error byte of a status packet; more than one bit may be set."""

    INPUT_VOLTAGE = 1
    ANGLE_LIMIT = 2
    OVERHEATING = 4
    RANGE = 8
    CHECKSUM = 16
    OVERLOAD = 32
    INSTRUCTION = 64


ERROR_WORDS: Mapping[ErrorBit, str] = {
    ErrorBit.INPUT_VOLTAGE: "its supply is outside its voltage limits",
    ErrorBit.ANGLE_LIMIT: "a goal lies outside its angle limits",
    ErrorBit.OVERHEATING: "it is too hot",
    ErrorBit.RANGE: "an instruction's parameter was out of range",
    ErrorBit.CHECKSUM: "an instruction reached it with a bad checksum",
    ErrorBit.OVERLOAD: "its load is more than it can hold",
    ErrorBit.INSTRUCTION: "it was sent an instruction that it does not know, or an action without a write",
}


def error_words(bits: int) -> str:
    """Error bits in words, e.g. ``"it is too hot; its load is more than it can hold"``."""
    known = [words for bit, words in ERROR_WORDS.items() if bits & bit]
    return "; ".join(known) or ("no error" if not bits else f"error byte {bits:#04x}")


@dataclass(frozen=True, slots=True)
class InstructionPacket:
    """What a host sends.

    Attributes:
        id: of the servo, 254 for all.
        instruction: code, not necessarily one of `Instruction`.
        parameters: what follows it.
    """

    id: int
    instruction: int
    parameters: bytes = b""


@dataclass(frozen=True, slots=True)
class StatusPacket:
    """What a servo answers.

    Attributes:
        id: of the servo.
        error: `ErrorBit`s.
        parameters: what was read; empty after a ping or a write.
    """

    id: int
    error: int
    parameters: bytes = b""


class ProblemKind(enum.Enum):
    """What a parser met instead of a packet."""

    GARBAGE = "garbage"
    BAD_LENGTH = "impossible length"
    BAD_CHECKSUM = "bad checksum"


@dataclass(frozen=True, slots=True)
class Problem:
    """Bytes that are no packet.

    Every byte that a parser is fed ends in a packet or in one `GARBAGE`. The
    other kinds quote what looked like a packet; its bytes are searched again,
    for a good one may begin inside.

    Attributes:
        kind: what is wrong.
        data: the bytes.
        id: which servo they seem to be of or for; -1 where that cannot be told.
    """

    kind: ProblemKind
    data: bytes
    id: int = -1


def checksum(body: bytes) -> int:
    """Checksum of the bytes from ID to the last parameter."""
    return ~sum(body) & 0xFF


def _packet(servo: int, code: int, parameters: bytes) -> bytes:
    body = bytes((servo, len(parameters) + 2, code)) + parameters
    return HEADER + body + bytes((~sum(body) & 0xFF,))


def instruction_packet(servo: int, instruction: int, parameters: bytes = b"") -> bytes:
    """Encode what a host sends.

    Raises:
        ValueError: ID above 254, code no byte, or longer than a servo's receive buffer.
    """
    if not 0 <= servo <= BROADCAST_ID:
        raise ValueError(f"servo ID {servo} must lie in 0..254 (254 means all)")
    if len(parameters) + OVERHEAD > RECEIVE_BUFFER:
        raise ValueError(
            f"{len(parameters)} bytes of parameters do not fit a servo's buffer of {RECEIVE_BUFFER} bytes"
        )
    return _packet(servo, instruction, parameters)


def status_packet(servo: int, error: int = 0, parameters: bytes = b"") -> bytes:
    """Encode what a servo answers.

    Raises:
        ValueError: ID above 253, error no byte, or too many parameters.
    """
    if not 0 <= servo <= LAST_ID:
        raise ValueError(f"servo ID {servo} must lie in 0..{LAST_ID}")
    if len(parameters) > 0xFD:
        raise ValueError(f"{len(parameters)} bytes of parameters do not fit one packet")
    return _packet(servo, error, parameters)


def ping_packet(servo: int) -> bytes:
    """Ask whether a servo is there."""
    return instruction_packet(servo, Instruction.PING)


def read_packet(servo: int, address: int, count: int) -> bytes:
    """Ask for `count` bytes of the control table from `address`."""
    return instruction_packet(servo, Instruction.READ, bytes((address, count)))


def write_packet(servo: int, address: int, data: bytes, *, registered: bool = False) -> bytes:
    """Write bytes from `address`, at once or (`registered`) when the action instruction comes."""
    code = Instruction.REG_WRITE if registered else Instruction.WRITE
    return instruction_packet(servo, code, bytes((address,)) + data)


def sync_write_packet(address: int, data: Mapping[int, bytes]) -> bytes:
    """Write as many bytes to each of several servos, in one packet that nobody answers.

    Args:
        address: first register.
        data: bytes by servo ID, all of one length.

    Raises:
        ValueError: nothing to write, lengths that differ, or too long for a servo.
    """
    sizes = {len(part) for part in data.values()}
    if len(sizes) != 1 or 0 in sizes:
        raise ValueError(
            "a sync write needs at least one servo and the same number of bytes (1 or more) for each"
        )
    parts = b"".join(bytes((servo,)) + part for servo, part in data.items())
    return instruction_packet(BROADCAST_ID, Instruction.SYNC_WRITE, bytes((address, sizes.pop())) + parts)


PacketT = TypeVar("PacketT", InstructionPacket, StatusPacket)


class _Parser(Generic[PacketT]):
    """Finds packets in a stream that comes in any pieces.

    Never takes a packet whose checksum is wrong, and never loses a good one
    behind garbage: what looked like a packet and was none is dropped byte by
    byte, not as a whole.
    """

    def __init__(self, make: type[PacketT], last_id: int, most_parameters: int) -> None:
        self._make: type[PacketT] = make
        self._last_id = last_id
        self._longest = most_parameters + 2
        self._buffer = bytearray()

    @property
    def pending(self) -> int:
        """Bytes held back because they may be the beginning of a packet."""
        return len(self._buffer)

    def clear(self) -> None:
        """Forget what is held back."""
        self._buffer.clear()

    def feed(self, data: bytes) -> list[PacketT | Problem]:
        """Take bytes; give the packets and problems that they complete, in order."""
        buffer = self._buffer
        buffer += data
        found: list[PacketT | Problem] = []
        dropped = position = 0
        while True:
            position, wait = self._next_header(position)
            if wait:
                break
            end = position + 4 + buffer[position + 3]
            problem = self._judge(position, end)
            if problem is not None:
                found.append(problem)
                position += 1
            elif end > len(buffer):
                break
            else:
                if position > dropped:
                    found.append(Problem(ProblemKind.GARBAGE, bytes(buffer[dropped:position])))
                parameters = bytes(buffer[position + 5 : end - 1])
                found.append(self._make(buffer[position + 2], buffer[position + 4], parameters))
                dropped = position = end
        if position > dropped:
            found.append(Problem(ProblemKind.GARBAGE, bytes(buffer[dropped:position])))
        del buffer[:position]
        return found

    def flush(self) -> list[PacketT | Problem]:
        """No more bytes will come: what is held back is no packet, but a good one may stand inside."""
        found: list[PacketT | Problem] = []
        while self._buffer:
            first = bytes(self._buffer[:1])
            del self._buffer[:1]
            found.append(Problem(ProblemKind.GARBAGE, first))
            found += self.feed(b"")
        return _joined(found)

    def _next_header(self, position: int) -> tuple[int, bool]:
        """Where the next possible packet begins, and whether more bytes are needed to judge it."""
        buffer = self._buffer
        size = len(buffer)
        while True:
            start = buffer.find(HEADER, position)
            if start < 0:
                is_half = size > position and buffer[-1] == 0xFF
                return (size - 1 if is_half else size), True
            if start + 4 > size and (start + 3 > size or buffer[start + 2] <= self._last_id):
                return start, True
            if buffer[start + 2] <= self._last_id:
                return start, False
            position = start + 1  # a third FF, or an ID that cannot be: the header may begin one byte later

    def _judge(self, start: int, end: int) -> Problem | None:
        buffer = self._buffer
        servo, length = buffer[start + 2], buffer[start + 3]
        if not 2 <= length <= self._longest:
            return Problem(ProblemKind.BAD_LENGTH, bytes(buffer[start : start + 4]), servo)
        if end <= len(buffer) and sum(buffer[start + 2 : end]) & 0xFF != 0xFF:
            return Problem(ProblemKind.BAD_CHECKSUM, bytes(buffer[start:end]), servo)
        return None


def _joined(found: list[PacketT | Problem]) -> list[PacketT | Problem]:
    """The same with neighbouring pieces of garbage as one."""
    joined: list[PacketT | Problem] = []
    for item in found:
        last = joined[-1] if joined else None
        if _is_garbage(item) and _is_garbage(last):
            joined[-1] = Problem(ProblemKind.GARBAGE, last.data + item.data)  # type: ignore[union-attr]
        else:
            joined.append(item)
    return joined


def _is_garbage(item: object) -> bool:
    return isinstance(item, Problem) and item.kind is ProblemKind.GARBAGE


class StatusParser(_Parser[StatusPacket]):
    """Finds answers of servos, for the host.

    Args:
        most_parameters: longest answer that can be; a longer one is taken for garbage.
    """

    def __init__(self, most_parameters: int = TABLE_SIZE) -> None:
        super().__init__(StatusPacket, LAST_ID, most_parameters)


class InstructionParser(_Parser[InstructionPacket]):
    """Finds instructions of a host, for an emulated servo.

    Args:
        most_parameters: longest instruction that a servo's receive buffer takes.
    """

    def __init__(self, most_parameters: int = RECEIVE_BUFFER - OVERHEAD) -> None:
        super().__init__(InstructionPacket, BROADCAST_ID, most_parameters)
