"""The latch below the bus: while it is closed, nothing that could move or enable a servo reaches the line.

It judges finished packets, so no path through the driver leads around it.
Torque off always passes. Any thread may close it; it opens only by `release`.
"""

from __future__ import annotations

import threading

from bluefoot_mpc.io.dynamixel.codec import Instruction
from bluefoot_mpc.io.dynamixel.table import AX12A, MOTION_END, MOTION_START, RAM_START

_ENABLE = AX12A["torque_enable"].address
_WRITES = frozenset({Instruction.WRITE, Instruction.REG_WRITE})
_HARMLESS = frozenset({Instruction.PING, Instruction.READ})


class Latch:
    """Closed after an emergency stop or a controlled one, open only while the robot is armed or being armed.

    Attributes:
        closed: True while nothing that could move a servo may pass. Threads may read it at any time.
        reason: why it was closed the first time since it was last released.
    """

    def __init__(self, *, closed: bool = False, reason: str = "never armed") -> None:
        self._lock = threading.Lock()
        self.closed = closed
        self.reason = reason if closed else ""

    def close(self, reason: str) -> None:
        """Close it; the first reason stays."""
        with self._lock:
            # First of all: whoever looks without the lock must see it at once.
            already, self.closed = self.closed, True
            if not already:
                self.reason = reason

    def release(self) -> None:
        """Open it: the explicit act of arming again."""
        with self._lock:
            self.closed = False
            self.reason = ""


def could_move(packet: bytes) -> bool:
    """Whether an instruction packet could make a servo move or hold.

    True for torque enable other than 0, for anything that touches goal, speed
    or torque limit (a write to goal position is known to switch torque on), for
    registered writes of these, the action that sets them off, a reset, and
    every instruction that is not known.
    """
    code = packet[4]
    if code in _HARMLESS:
        return False
    if code in _WRITES:
        return _touches(packet[5], packet[6:-1])
    if code == Instruction.SYNC_WRITE and len(packet) > 8:
        start, size = packet[5], packet[6]
        parts = packet[7:-1]
        return any(_touches(start, parts[at + 1 : at + 1 + size]) for at in range(0, len(parts), size + 1))
    return True


def _touches(start: int, data: bytes) -> bool:
    end = start + len(data)
    if start < MOTION_END and end > MOTION_START:
        return True
    return start <= _ENABLE < end and data[_ENABLE - start] != 0


def eeprom_address(packet: bytes) -> int | None:
    """First register of permanent memory that an instruction packet writes; None where it writes none."""
    code = packet[4]
    if code in _WRITES or code == Instruction.SYNC_WRITE:
        return packet[5] if packet[5] < RAM_START else None
    return AX12A["id"].address if code == Instruction.RESET else None
