"""What the cycle knows of one servo, and the requests it sends to it, encoded once.

Position, full and check reads all begin or end at the present position, and all
have lengths of their own, several for each kind: so a reply that comes late is
never taken for the answer to a later request (see `wire`).
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence

from bluefoot_mpc.io.dynamixel.codec import ErrorBit, read_packet
from bluefoot_mpc.io.dynamixel.table import AX12A
from bluefoot_mpc.io.dynamixel.units import load_from_register, speed_from_register, voltage_from_register

PRESENT = AX12A["present_position"].address
ENABLE = AX12A["torque_enable"].address
_LIMIT_AT = AX12A["torque_limit"].address - ENABLE
_POSITION_AT = PRESENT - ENABLE

SHUTDOWN_ERRORS = ErrorBit.OVERHEATING | ErrorBit.OVERLOAD
"""Errors on which an AX-12A takes its own torque away (its default shutdown mask)."""


class Kind(enum.Enum):
    """What is read of a servo, and the lengths that such a read can have."""

    POSITION = (PRESENT, range(2, 8))
    FULL = (PRESENT, range(8, 14))
    CHECK = (ENABLE, range(14, 27))

    def __init__(self, address: int, lengths: range) -> None:
        self.address = address
        self.lengths = lengths


class ServoState:
    """One servo in the cycle.

    Args:
        servo: its ID.
        joint: 0..15, its place in all arrays.
        part: its name for messages.

    Attributes:
        requests: packets by kind and length.
        counts: newest position, counts as measured; NaN before the first.
        time: s, when the servo measured it.
        fresh: True where it was measured in this cycle.
        put_off: True where this cycle had no time to ask for it; it is asked first in the next one.
        speed, load, voltage, temperature, full_time: of the newest full read; rad/s, fraction, V, °C, s.
        error: error bits of the newest reply.
        admitted: goals may go out to it: it was armed.
        doubtful: it missed a cycle, so its registers must be looked at before it gets another goal.
        suspect: it missed several cycles, and is asked only now and then.
        returned: it is there again with its RAM lost: it needs to be armed anew.
        shut: it reported overheating or overload since it was armed: its torque limit is not written again.
        misses: cycles in a row without a usable reply.
        probe_at: s, when a suspect servo is asked again.
        limit: torque limit that it was sent last; None where unknown.
        limit_repeats: how often the limit is still to be repeated, for nobody acknowledges it.
    """

    __slots__ = (
        "admitted",
        "counts",
        "doubtful",
        "error",
        "fresh",
        "full_time",
        "id",
        "joint",
        "limit",
        "limit_repeats",
        "load",
        "misses",
        "part",
        "probe_at",
        "put_off",
        "requests",
        "returned",
        "shut",
        "speed",
        "suspect",
        "temperature",
        "time",
        "voltage",
    )

    def __init__(self, servo: int, joint: int, part: str) -> None:
        self.id, self.joint, self.part = servo, joint, part
        self.requests = {
            kind: {count: read_packet(servo, kind.address, count) for count in kind.lengths} for kind in Kind
        }
        self.counts = self.time = self.speed = self.load = math.nan
        self.voltage = self.temperature = self.full_time = math.nan
        self.error = self.misses = self.limit_repeats = 0
        self.fresh = self.admitted = self.doubtful = self.suspect = self.returned = self.shut = False
        self.put_off = False
        self.probe_at = 0.0
        self.limit: int | None = None

    @property
    def takes_goals(self) -> bool:
        """Whether a goal may be written to it: where its RAM may be lost, that would switch its torque on."""
        return self.admitted and not (self.doubtful or self.suspect or self.returned)

    def admit(self) -> None:
        """It has been armed."""
        self.admitted = True
        self.doubtful = self.suspect = self.returned = self.shut = False
        self.misses = self.limit_repeats = 0
        self.limit = None

    def take(self, kind: Kind, data: Sequence[int], error: int, time: float) -> bool:
        """Take a reply; True where it shows that the servo has lost its RAM since it was armed."""
        self.error = error
        if error & SHUTDOWN_ERRORS and self.admitted:
            self.shut = True
        self.misses = 0
        at = _POSITION_AT if kind is Kind.CHECK else 0
        self.counts = data[at] | data[at + 1] << 8
        self.time = time
        self.fresh = True
        if kind is Kind.FULL:
            self.speed = speed_from_register(data[2] | data[3] << 8)
            self.load = load_from_register(data[4] | data[5] << 8)
            self.voltage = voltage_from_register(data[6])
            self.temperature = data[7]
            self.full_time = time
        return kind is Kind.CHECK and self._is_lost(data)

    def _is_lost(self, data: Sequence[int]) -> bool:
        self.doubtful = self.suspect = False
        if self.admitted and not self.returned:
            if not data[0]:
                self.returned = True
                return True
            if data[_LIMIT_AT] | data[_LIMIT_AT + 1] << 8 != self.limit:
                self.limit = None  # a write of it did not arrive: to be sent again
        return False
