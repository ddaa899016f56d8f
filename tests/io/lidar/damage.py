"""Scans with all kinds of damage through the parser, and an independent judge of what it lets through."""

from __future__ import annotations

import random
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.io.emulation.lidar_replies import Request, answer, scan_body
from bluefoot_mpc.io.lidar.errors import ScipError
from bluefoot_mpc.io.lidar.replies import ReplyParser, distances_of, is_same_command, stamp_of

ECHO = "MD0044072501000"
REQUEST = Request("MD", 44, 725, 1, 0, 0)


@dataclass
class Count:
    """What became of the scans.

    Attributes:
        accepted: handed out.
        refused: replies found, but refused with a typed error.
        lost: not even a reply.
        wrong_sum: handed out although a sum is wrong: must not be.
        intact_refused: not handed out although nothing was wrong: must not be.
        unseen: handed out with other values than were sent, all sums right: six bits cannot do better.
    """

    accepted: int = 0
    refused: int = 0
    lost: int = 0
    wrong_sum: int = 0
    intact_refused: int = 0
    unseen: int = 0


def damage(data: bytes, chance: random.Random) -> bytes:
    """One kind of damage, or none."""
    changed = bytearray(data)
    at = chance.randrange(len(data))
    match chance.randrange(8):
        case 0 | 1:
            return data
        case 2:
            changed[at] ^= 1 << chance.randrange(8)
        case 3:
            del changed[at : at + chance.choice([1, 2, 3, 66, 132])]
        case 4:
            changed[at:at] = chance.randbytes(chance.choice([1, 2, 70]))
        case 5:
            del changed[at:]
        case 6:
            changed = bytearray(chance.randbytes(chance.randrange(40))) + changed
        case _:
            size = chance.randrange(1, 30)
            changed[at : at + size] = chance.randbytes(size)
    return bytes(changed)


def judge(data: bytes, distances: list[int]) -> bool:
    """True where the line holds exactly these distances with good sums, worked out character by character."""
    for start in range(len(data)):
        if not (data.startswith(ECHO[:-2].encode(), start) and data[start + 15 : start + 20] == b"\n99b\n"):
            continue
        lines = data[start:].split(b"\n\n")[0].split(b"\n")[3:]
        if any((sum(line[:-1]) & 63) + 48 != line[-1] for line in lines if line):
            continue
        text = b"".join(line[:-1] for line in lines)
        values = [
            (a - 48 << 12) + (b - 48 << 6) + c - 48
            for a, b, c in zip(text[0::3], text[1::3], text[2::3], strict=False)
        ]
        if values == distances and len(text) == 2046:
            return True
    return False


def fuzz(scans: int, chance: random.Random) -> Count:
    """Send scans through a parser that is never reset, each with some damage."""
    count, parser = Count(), ReplyParser()
    before = b""
    for number in range(scans):
        sent = np.array([chance.randrange(5601) for _ in range(682)])
        whole = answer(ECHO, "99", scan_body(REQUEST, number, sent))
        line = damage(whole, chance)
        replies = [reply for piece in _pieces(line, chance) for reply in parser.feed(piece)]
        replies = [reply for reply in replies if is_same_command(reply.echo, ECHO.encode())]
        taken = False
        for reply in replies:
            try:
                stamp, distances = stamp_of(reply), distances_of(reply, 682).tolist()
            except ScipError:
                continue
            taken = True
            count.accepted += 1
            count.wrong_sum += not judge(before + line, distances)
            count.unseen += distances != sent.tolist() or stamp != number
        if not taken:
            count.refused += bool(replies)
            count.lost += not replies
            count.intact_refused += line == whole and before.endswith(b"\n\n")
        before = (before + line)[-9000:]
    return count


def _pieces(line: bytes, chance: random.Random) -> list[bytes]:
    at = chance.randrange(len(line) + 1)
    return [line[:at], line[at:]]
