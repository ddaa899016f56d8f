"""Faults of bytes: pure functions from a reply (or request) to what becomes of it.

A Protocol 1.0 packet is ``FF FF ID LEN ERR P… CHK``; on lines of other devices
the same faults act on whatever piece of bytes passes.
"""

from __future__ import annotations

import math

import numpy as np

from bluefoot_mpc.io.emulation.faults import Fault

_HEADER = b"\xff\xff"

Pieces = list[tuple[float, bytes]]
"""Bytes with the seconds by which they come late."""


def is_packet(data: bytes) -> bool:
    """True for a piece that starts as a packet does."""
    return len(data) >= 6 and data.startswith(_HEADER)


def packet(identity: int, error: int, data: bytes = b"") -> bytes:
    """A sound status packet."""
    body = bytes((identity & 0xFF, len(data) + 2, error & 0xFF)) + data
    return _HEADER + body + bytes((~sum(body) & 0xFF,))


def changed(data: bytes, rng: np.random.Generator, first: int = 0) -> bytes:
    """One byte from index `first` on changed to another value."""
    if len(data) <= first:
        return data
    at = int(rng.integers(first, len(data)))
    flip = int(rng.integers(1, 256))
    return data[:at] + bytes((data[at] ^ flip,)) + data[at + 1 :]


def noise(count: int, rng: np.random.Generator) -> bytes:
    """Random bytes."""
    return rng.integers(0, 256, count, dtype=np.uint8).tobytes()


def spoil(data: bytes, fault: Fault, rng: np.random.Generator) -> Pieces:
    """What arrives instead of a reply under a fault."""
    amount = fault.amount
    if fault.kind == "drop_reply":
        return []
    if fault.kind == "late_reply":
        return [(amount, data)]
    if fault.kind == "split_reply":
        half = max(1, len(data) // 2)
        return [(0.0, data[:half]), (amount, data[half:])]
    return [(0.0, _spoilt(data, fault, rng))]


def _spoilt(data: bytes, fault: Fault, rng: np.random.Generator) -> bytes:
    """Faults that change bytes and not their time."""
    count = int(fault.amount) if math.isfinite(fault.amount) else 0
    match fault.kind:
        case "corrupt_reply":
            data = changed(data, rng)
        case "bad_checksum":
            data = data[:-1] + bytes((data[-1] ^ 0x55,))
        case "truncate_reply":
            data = data[: max(0, len(data) - max(1, count))]
        case "duplicate_reply":
            data = data + data
        case "garbage":
            data = noise(count, rng) + data + noise(count, rng)
        case _ if is_packet(data):
            data = _reframed(data, fault)
    return data


def _reframed(data: bytes, fault: Fault) -> bytes:
    """Faults that need to know the packet's parts."""
    identity, error, parameters = data[2], data[4], data[5:-1]
    match fault.kind:
        case "wrong_length":
            return data[:3] + bytes(((data[3] + int(fault.amount)) & 0xFF,)) + data[4:]
        case "wrong_id":
            other = identity + 1 if fault.amount < 0 else int(fault.amount)
            return packet(other, error, parameters)
        case "short_status":
            return packet(identity, error)
        case _:
            return packet(identity, error | int(fault.amount))
