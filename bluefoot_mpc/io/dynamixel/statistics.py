"""What went wrong on a bus, counted: in total, by servo, and over the last requests."""

from __future__ import annotations

from dataclasses import dataclass, field

WINDOW = 64
"""Requests to a servo that its rolling share of failures looks back on."""

_MASK = (1 << WINDOW) - 1


@dataclass(slots=True)
class ServoStatistics:
    """Counts of one servo.

    Attributes:
        requests: sent, retries included.
        lost: no reply before the deadline.
        corrupt: replies that were garbled, short, or came twice with different values.
        short: of these, well-formed replies without all that was asked for.
        wrong_id: replies of other servos that came while this one was asked.
        late: replies that came after the wait for them was over; none was used.
        duplicates: replies beyond the first one to a request.
        retries: requests sent again.
        refused: requests that the servo answered with a refusal.
    """

    requests: int = 0
    lost: int = 0
    corrupt: int = 0
    short: int = 0
    wrong_id: int = 0
    late: int = 0
    duplicates: int = 0
    retries: int = 0
    refused: int = 0
    _history: int = 0

    def note(self, *, failed: bool) -> None:
        """One request is over."""
        self.requests += 1
        self._history = ((self._history << 1) | failed) & _MASK

    @property
    def recent_failures(self) -> float:
        """Share of the last 64 requests (fewer at the start) without a usable reply."""
        return self._history.bit_count() / min(max(self.requests, 1), WINDOW)


@dataclass(slots=True)
class BusStatistics:
    """Counts of one port.

    Attributes:
        servos: counts by ID.
        bad_checksums: what looked like a packet and had a wrong sum.
        garbage_bytes: bytes that belonged to no packet.
        stale_bytes: bytes that were thrown away before a request because they came too late for the last.
        reopened: how often the port was lost and came back.
    """

    servos: dict[int, ServoStatistics] = field(default_factory=dict)
    bad_checksums: int = 0
    garbage_bytes: int = 0
    stale_bytes: int = 0
    reopened: int = 0

    def of(self, servo: int) -> ServoStatistics:
        """Counts of a servo, made at its first mention."""
        counts = self.servos.get(servo)
        if counts is None:
            counts = self.servos[servo] = ServoStatistics()
        return counts

    @property
    def total(self) -> ServoStatistics:
        """All servos together."""
        names = (
            "requests",
            "lost",
            "corrupt",
            "short",
            "wrong_id",
            "late",
            "duplicates",
            "retries",
            "refused",
        )
        return ServoStatistics(
            **{name: sum(getattr(s, name) for s in self.servos.values()) for name in names}
        )
