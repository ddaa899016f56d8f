"""Bytes of an emulated device that are on their way to the host."""

from __future__ import annotations

import math
from collections import deque


def arrived(out: deque[tuple[float, bytes]], time: float, byte_time: float) -> bytes:
    """Take the bytes that have arrived by `time` (s) off what is on its way.

    Args:
        out: when the first byte of each piece starts (s), and the piece; what is left stays in it.
        time: s.
        byte_time: s that a byte takes.
    """
    found = bytearray()
    while out:
        begin, data = out[0]
        count = min(len(data), math.floor((time - begin) / byte_time + 1e-6))
        if count <= 0:
            break
        found += data[:count]
        out.popleft()
        if count < len(data):
            out.appendleft((begin + count * byte_time, data[count:]))
            break
    return bytes(found)
