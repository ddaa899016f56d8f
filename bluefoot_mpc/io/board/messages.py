"""Messages of the board link, and their bytes. Little endian; docs/board-protocol.md is the reference.

Decoding raises `MessageError` for a wrong length or an impossible value and
nothing else: a frame with a good CRC may still come from other firmware.
"""

from __future__ import annotations

import enum
import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.board.framing import Frame
from bluefoot_mpc.types import N_LEGS

PROTOCOL = 1
"""Version of the protocol; boards and drivers of different versions do not work together."""

GYRO_UNIT = 0.001
"""rad/s a count: ±32.767 rad/s."""
ACCEL_UNIT = 0.005
"""m/s² a count: ±163.8 m/s², a sensor of ±16 g."""
FIELD_UNIT = 0.0001
"""Of the nominal field a count: ±3.28."""
BOARD_TIME_UNIT = 1e-6
"""s a count of the board's clock (32 bits, wraps after 71.6 min)."""
BOARD_TIME_BITS = 32
POWER_MAGIC = 0x424C5546
"""What a request for a code must carry."""
NOT_MEASURED = -32768
"""Count that stands for a value that could not be measured."""


class MessageError(DeviceError):
    """A frame is whole but is not a message of this protocol."""


class Kind(enum.IntEnum):
    """Types of messages: below 0x80 from the board, others to it."""

    HELLO = 0x01
    IMU = 0x02
    SWITCHES = 0x03
    POWER = 0x04
    TIME = 0x05
    CODE = 0x06
    REFUSED = 0x07
    GET_HELLO = 0x81
    HEARTBEAT = 0x82
    GET_TIME = 0x83
    GET_CODE = 0x84
    POWER_ON = 0x85
    POWER_CUT = 0x86


class CutReason(enum.IntEnum):
    """Why the servos' supply is off, or was the last time."""

    NEVER_ON = 0
    COMMAND = 1
    HEARTBEAT = 2
    VOLTAGE = 3
    BUTTON = 4


class Refusal(enum.IntEnum):
    """Why the board does not switch the supply on."""

    MAGIC = 1
    NO_CODE = 2
    LATE = 3
    CODE = 4
    HEARTBEAT = 5
    VOLTAGE = 6


@dataclass(frozen=True, slots=True)
class Hello:
    """The board introduces itself: after its start, and when asked.

    Attributes:
        protocol: version of the protocol.
        firmware: version, major and minor.
        serial: number of the board.
        count: board time of sending.
        started: the board has just started; False where it was asked.
    """

    protocol: int
    firmware: tuple[int, int]
    serial: int
    count: int
    started: bool


@dataclass(frozen=True, slots=True)
class ImuSample:
    """One inertial sample; NaN where the sensor gave none.

    Attributes:
        count: board time of the sample.
        gyro: rad/s, base frame.
        accel: m/s², specific force, base frame.
        magnetometer: of the nominal field, base frame; None where none is new.
        raw: bytes of gyro and accelerometer as they came.
    """

    count: int
    gyro: tuple[float, float, float]
    accel: tuple[float, float, float]
    magnetometer: tuple[float, float, float] | None
    raw: bytes = b""


@dataclass(frozen=True, slots=True)
class Switches:
    """State of the foot switches.

    Attributes:
        count: board time at which they were read.
        closed: FL, FR, RL, RR.
        edges: changes of each so far, modulo 256.
    """

    count: int
    closed: tuple[bool, ...]
    edges: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Power:
    """Battery and supply of the servos.

    Attributes:
        count: board time of the measurement.
        voltage: V of the battery at the board, under load.
        current: A drawn from it.
        temperature: °C of the board.
        on: the supply switch is told to be on.
        live: there is voltage behind the switch.
        cut: why the supply is off, or was the last time.
    """

    count: int
    voltage: float
    current: float
    temperature: float
    on: bool
    live: bool
    cut: CutReason


@dataclass(frozen=True, slots=True)
class TimeReply:
    """Board time at which a request came in.

    Attributes:
        token: that of the request.
        count: board time.
    """

    token: int
    count: int


_HELLO = struct.Struct("<BBBII?")
_IMU = struct.Struct("<I6h")
_FIELD = struct.Struct("<3h")
_SWITCHES = struct.Struct("<IB4B")
_POWER = struct.Struct("<IHhhBB")
_TIME = struct.Struct("<II")
WORD = struct.Struct("<I")
_ON, _LIVE = 1, 2

Message = Hello | ImuSample | Switches | Power | TimeReply | int | Refusal
"""What comes from the board; a code for switching on is a bare number."""


def counts(values: tuple[float, ...], unit: float) -> tuple[int, ...]:
    """Values as counts: rounded, at the ends of the range clipped, NaN as `NOT_MEASURED`."""
    return tuple(
        NOT_MEASURED if math.isnan(value) else max(-32767, min(32767, math.floor(value / unit + 0.5)))
        for value in values
    )


def encode_imu(sample: ImuSample) -> bytes:
    """Payload of an IMU message."""
    numbers = counts(sample.gyro, GYRO_UNIT) + counts(sample.accel, ACCEL_UNIT)
    payload = _IMU.pack(sample.count, *numbers)
    field = sample.magnetometer
    return payload if field is None else payload + _FIELD.pack(*counts(field, FIELD_UNIT))


def encode_switches(switches: Switches) -> bytes:
    """Payload of a switch message."""
    mask = sum(1 << leg for leg, closed in enumerate(switches.closed) if closed)
    return _SWITCHES.pack(switches.count, mask, *switches.edges)


def encode_power(power: Power) -> bytes:
    """Payload of a power message."""
    voltage = 0xFFFF if math.isnan(power.voltage) else max(0, min(0xFFFE, round(power.voltage * 1000.0)))
    flags = _ON * power.on | _LIVE * power.live
    others = counts((power.current,), 0.01) + counts((power.temperature,), 0.1)
    return _POWER.pack(power.count, voltage, *others, flags, power.cut)


def encode_time(reply: TimeReply) -> bytes:
    """Payload of a time message."""
    return _TIME.pack(reply.token, reply.count)


def encode_hello(hello: Hello) -> bytes:
    """Payload of a hello message."""
    return _HELLO.pack(hello.protocol, *hello.firmware, hello.serial, hello.count, hello.started)


def decode(frame: Frame) -> Message:
    """The message in a frame from the board.

    Raises:
        MessageError: unknown type, wrong length, or a value that does not exist.
    """
    decoder = _DECODERS.get(frame.kind)
    if decoder is None:
        raise MessageError(f"message of unknown type 0x{frame.kind:02x}")
    try:
        return decoder(frame.payload)
    except (struct.error, ValueError) as error:
        size = len(frame.payload)
        raise MessageError(f"message of type 0x{frame.kind:02x}, {size} bytes: {error}") from error


def _decode_imu(payload: bytes) -> ImuSample:
    field = None
    inertial = payload
    if len(payload) == _IMU.size + _FIELD.size:
        inertial = payload[: _IMU.size]
        field = _scaled(_FIELD.unpack(payload[_IMU.size :]), FIELD_UNIT)
    count, *numbers = _IMU.unpack(inertial)
    gyro, accel = _scaled(numbers[:3], GYRO_UNIT), _scaled(numbers[3:], ACCEL_UNIT)
    return ImuSample(count, gyro, accel, field, inertial[4:])


def _scaled(numbers: tuple[int, ...] | list[int], unit: float) -> tuple[float, float, float]:
    if NOT_MEASURED in numbers:
        x, y, z = (math.nan if number == NOT_MEASURED else number * unit for number in numbers)
        return x, y, z
    x, y, z = numbers
    return x * unit, y * unit, z * unit


def _decode_switches(payload: bytes) -> Switches:
    count, mask, *edges = _SWITCHES.unpack(payload)
    if mask >> N_LEGS:
        raise ValueError(f"switch mask 0x{mask:02x}")
    return Switches(count, tuple(bool(mask >> leg & 1) for leg in range(N_LEGS)), tuple(edges))


def _decode_power(payload: bytes) -> Power:
    count, voltage, current, temperature, flags, cut = _POWER.unpack(payload)
    if flags > _ON | _LIVE:
        raise ValueError(f"power flags 0x{flags:02x}")
    return Power(
        count,
        math.nan if voltage == 0xFFFF else voltage / 1000.0,
        math.nan if current == NOT_MEASURED else current * 0.01,
        math.nan if temperature == NOT_MEASURED else temperature * 0.1,
        bool(flags & _ON),
        bool(flags & _LIVE),
        CutReason(cut),
    )


def _decode_hello(payload: bytes) -> Hello:
    protocol, major, minor, serial, count, started = _HELLO.unpack(payload)
    return Hello(protocol, (major, minor), serial, count, started)


def _decode_time(payload: bytes) -> TimeReply:
    return TimeReply(*_TIME.unpack(payload))


def _decode_code(payload: bytes) -> int:
    return int(WORD.unpack(payload)[0])


def _decode_refusal(payload: bytes) -> Refusal:
    (reason,) = struct.unpack("<B", payload)
    return Refusal(reason)


_DECODERS: dict[int, Callable[[bytes], Message]] = {
    int(Kind.IMU): _decode_imu,
    int(Kind.SWITCHES): _decode_switches,
    int(Kind.POWER): _decode_power,
    int(Kind.TIME): _decode_time,
    int(Kind.HELLO): _decode_hello,
    int(Kind.CODE): _decode_code,
    int(Kind.REFUSED): _decode_refusal,
}
