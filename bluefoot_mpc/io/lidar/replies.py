"""Commands and replies of SCIP 2.0. Pure; source: SCIP 2.0 specification C-42-03320B.

A reply is ``echo LF status sum LF (line LF)* LF``: the empty line ends it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bluefoot_mpc.io.lidar.codec import (
    STAMP_CHARACTERS,
    checksum,
    decode_blocks,
    decode_number,
    decode_values,
    without_sum,
)
from bluefoot_mpc.io.lidar.errors import ScipError
from bluefoot_mpc.io.lidar.geometry import FIRST_STEP, LAST_STEP

OK, DATA = "00", "99"
"""Status of a command that was understood, and of a scan of a continuous measurement."""
LASER_IS_ON = "02"
"""Status with which BM is answered when the laser is on already."""

_STATUS_LENGTH = 3
_LONGEST = 4096
"""Bytes without an end of reply, after which nothing of them can be one: the longest has 2137."""
_ECHO = re.compile(rb"(?:VV|PP|II|BM|QT|RS|TM|SS|CR|GD|GS|MD|MS|SCIP)[0-9.]*\Z")


@dataclass(frozen=True, slots=True)
class Reply:
    """A reply whose status sum holds; its lines are not checked yet.

    Attributes:
        echo: the command, as the sensor repeats it.
        status: two characters.
        lines: further lines, sums included.
    """

    echo: bytes
    status: str
    lines: tuple[bytes, ...]


@dataclass(frozen=True, slots=True)
class Parameters:
    """What the sensor says of itself (PP).

    Attributes:
        model: name.
        least_range: mm.
        greatest_range: mm.
        steps_per_turn: resolution.
        first_step: of the measurement area.
        last_step: of the measurement area.
        front_step: the one that looks forward.
        speed: rpm.
    """

    model: str
    least_range: int
    greatest_range: int
    steps_per_turn: int
    first_step: int
    last_step: int
    front_step: int
    speed: int


def scan_command(
    name: str = "MD", first: int = FIRST_STEP, last: int = LAST_STEP, *, cluster: int = 1, interval: int = 0,
    count: int = 0,
) -> bytes:  # fmt: skip
    """A command to measure, without line feed; 0 as count means for ever.

    Args:
        name: MD, MS (continuous, 3 and 2 characters), GD or GS (the latest scan).
        first: first step.
        last: last step.
        cluster: steps joined to one.
        interval: scans left out between two that are sent; of MD and MS.
        count: scans wanted; of MD and MS.
    """
    base = f"{name}{first:04d}{last:04d}{cluster:02d}"
    return (base if name[0] == "G" else f"{base}{interval:01d}{count:02d}").encode()


def is_same_command(echo: bytes, command: bytes) -> bool:
    """True where a reply belongs to a command: scans repeat it but for the number of scans that remain."""
    if command[:1] == b"M":
        return len(echo) == len(command) and echo[:-2] == command[:-2] and echo[-2:].isdigit()
    return echo == command


class ReplyParser:
    """Replies from bytes as they come, in pieces of any size.

    Attributes:
        bad: pieces so far that were no reply.
    """

    def __init__(self) -> None:
        self._rest = b""
        self.bad = 0

    def reset(self) -> None:
        """Forget what was begun; the count stays."""
        self._rest = b""

    def feed(self, data: bytes) -> list[Reply]:
        """The replies that `data` completes."""
        *whole, rest = (self._rest + data).split(b"\n\n")
        if len(rest) > _LONGEST:
            self.bad += 1
            rest = rest[-1:]
        self._rest = rest
        found: list[Reply] = []
        for piece in whole:
            reply, is_clean = parse_reply(piece)
            self.bad += not is_clean
            if reply is not None:
                found.append(reply)
        return found


def parse_reply(piece: bytes) -> tuple[Reply | None, bool]:
    """The last reply in the bytes before an empty line, and whether nothing else was there.

    A reply that broke off is followed at once by the next one: so the search goes
    from the end, for a status that stands after a command.
    """
    lines = piece.split(b"\n")
    for at in range(len(lines) - 1, 0, -1):
        line = lines[at]
        if len(line) != _STATUS_LENGTH or checksum(line[:-1]) != line[-1] or not line.isalnum():
            continue
        echo = _ECHO.search(lines[at - 1])
        if echo is not None:
            is_clean = at == 1 and echo.start() == 0
            return Reply(echo.group(), line[:-1].decode("ascii"), tuple(lines[at + 1 :])), is_clean
    return None, False


def stamp_of(reply: Reply) -> int:
    """The time stamp in the first line of a reply: ms, 24 bits.

    Raises:
        ScipError: it is missing, or damaged.
    """
    if not reply.lines or len(reply.lines[0]) != STAMP_CHARACTERS + 1:
        raise ScipError(f"no time stamp in the reply to {reply.echo.decode('ascii')}")
    return decode_number(without_sum(reply.lines[0]))


def distances_of(reply: Reply, points: int) -> NDArray[np.int64]:
    """(points,) mm as the sensor sent them, error codes included.

    Raises:
        ScipError: a sum, a length or a character is wrong.
    """
    characters = 3 if reply.echo[1:2] == b"D" else 2
    text = decode_blocks(reply.lines[1:], points * characters)
    return decode_values(text, characters)


def facts_of(reply: Reply) -> dict[str, str]:
    """Names and values of a reply to VV, PP or II, in lines ``NAME:value;sum``.

    Raises:
        ScipError: a line has another form, or its sum is wrong.
    """
    facts: dict[str, str] = {}
    for line in reply.lines:
        text, semicolon, total = line.rpartition(b";")
        name, colon, value = text.partition(b":")
        # The sum leaves the semicolon out.
        if not semicolon or not colon or total != bytes((checksum(text),)):
            raise ScipError(f"damaged line in the reply to {reply.echo.decode('ascii')}")
        facts[name.decode("ascii", "replace")] = value.decode("ascii", "replace")
    return facts


def parameters_of(reply: Reply) -> Parameters:
    """What the sensor says of itself.

    Raises:
        ScipError: something is missing, damaged or no number.
    """
    facts = facts_of(reply)
    names = ("DMIN", "DMAX", "ARES", "AMIN", "AMAX", "AFRT", "SCAN")
    try:
        return Parameters(facts["MODL"], *(int(facts[name]) for name in names))
    except (KeyError, ValueError) as error:
        raise ScipError(f"the sensor's parameters are not complete: {error}") from error
