"""What an emulated URG-04LX answers: SCIP 2.0 as in the specification C-42-03320B."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.io.lidar.codec import (
    STAMP_CHARACTERS,
    encode_blocks,
    encode_number,
    encode_values,
    with_sum,
)
from bluefoot_mpc.io.lidar.geometry import (
    FIRST_STEP,
    FRONT_STEP,
    GREATEST_RANGE,
    LAST_STEP,
    LEAST_RANGE,
    STEPS_PER_TURN,
)

UNKNOWN = "0E"
LASER_IS_OFF = "10"
_SHORT_LIMIT = 4095
_BIT_RATES = ("019200", "038400", "057600", "115200", "250000", "500000", "750000")
_SPEEDS = (*(f"{n:02d}" for n in range(11)), "99")

VERSION = (
    ("VEND", "Hokuyo Automatic Co.,Ltd."),
    ("PROD", "SOKUIKI Sensor URG-04LX"),
    ("FIRM", "3.3.00(16/Apr./2008)"),
    ("PROT", "SCIP 2.0"),
    ("SERI", "H0000001"),
)
PARAMETERS = (
    ("MODL", "URG-04LX(Hokuyo Automatic Co.,Ltd.)"),
    ("DMIN", str(LEAST_RANGE)),
    ("DMAX", str(GREATEST_RANGE)),
    ("ARES", str(STEPS_PER_TURN)),
    ("AMIN", str(FIRST_STEP)),
    ("AMAX", str(LAST_STEP)),
    ("AFRT", str(FRONT_STEP)),
    ("SCAN", "600"),
)


@dataclass(frozen=True, slots=True)
class Request:
    """A command to measure.

    Attributes:
        name: MD, MS, GD or GS.
        first: first step.
        last: last step.
        cluster: steps joined to one, by their smallest distance.
        interval: scans left out between two that are sent.
        count: scans wanted; 0 for ever.
    """

    name: str
    first: int
    last: int
    cluster: int
    interval: int
    count: int


def answer(command: str, status: str, body: bytes = b"") -> bytes:
    """A reply: echo, status with sum, body, empty line."""
    return command.encode("latin-1") + b"\n" + with_sum(status.encode()) + b"\n" + body + b"\n"


def facts(pairs: tuple[tuple[str, str], ...]) -> bytes:
    """Lines ``NAME:value;sum``; the sum leaves the semicolon out."""
    lines = (with_sum(f"{name}:{value}".encode()) for name, value in pairs)
    return b"".join(line[:-1] + b";" + line[-1:] + b"\n" for line in lines)


def time_line(stamp: int) -> bytes:
    """A time stamp with its sum."""
    return with_sum(encode_number(stamp, STAMP_CHARACTERS)) + b"\n"


def scan_body(request: Request, stamp: int, distances: NDArray[np.int64]) -> bytes:
    """Time stamp and data of a scan.

    Args:
        request: what was asked for.
        stamp: ms, 24 bits.
        distances: (682,) mm of steps 44..725, error codes included.
    """
    steps = np.zeros(STEPS_PER_TURN, dtype=np.int64)
    steps[FIRST_STEP : LAST_STEP + 1] = distances
    wanted = steps[request.first : request.last + 1]
    if request.cluster > 1:
        wanted = np.minimum.reduceat(wanted, np.arange(0, len(wanted), request.cluster))
    if request.name[1] == "S":
        return time_line(stamp) + encode_blocks(encode_values(np.minimum(wanted, _SHORT_LIMIT), 2))
    return time_line(stamp) + encode_blocks(encode_values(wanted, 3))


def parse_request(command: str) -> Request | str:
    """A command to measure, or the status with which it is refused."""
    name = command[:2]
    is_once = name[0] == "G"
    fields = [("01", command[2:6]), ("02", command[6:10]), ("03", command[10:12])]
    if not is_once:
        fields += [("06", command[12:13]), ("07", command[13:15])]
    for status, text in fields:
        if not (text.isascii() and text.isdigit()):
            return status
    first, last, cluster, *rest = (int(text) for _, text in fields)
    if last > LAST_STEP:
        return "04"
    if last < first:
        return "05"
    if len(command) != sum(len(text) for _, text in fields) + 2:
        return "0C"
    return Request(name, first, last, cluster, *(rest or (0, 1)))


def bit_rate_status(command: str, current: str) -> str:
    """Status of SS."""
    rate = command[2:]
    if not rate.isdigit():
        return "01"
    if rate not in _BIT_RATES:
        return "02"
    return "03" if rate == current else "00"


def motor_status(command: str, current: str) -> str:
    """Status of CR."""
    speed = command[2:]
    if not speed.isdigit():
        return "01"
    if speed not in _SPEEDS:
        return "02"
    return "03" if speed == current else "00"
