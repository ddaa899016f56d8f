"""One request and its answer on a half-duplex line: deadlines, and which bytes may be believed.

Protocol 1.0 has no numbers in its packets, so a reply that comes late looks
like the answer to a later request. Three things keep it out: whatever waits
before a request is thrown away; a reply must have the length that was asked
for, and as long as a lost reply may still come, no request expects the length
of that one (`Wire.free_count`); and on a line whose bytes take their time, a
reply cannot be there before request and reply have passed.
"""

from __future__ import annotations

import enum
import threading
from dataclasses import dataclass

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel.codec import (
    OVERHEAD,
    ErrorBit,
    Instruction,
    Problem,
    ProblemKind,
    StatusPacket,
    StatusParser,
)
from bluefoot_mpc.io.dynamixel.errors import EepromRefusedError, LatchedError
from bluefoot_mpc.io.dynamixel.latch import Latch, could_move, eeprom_address
from bluefoot_mpc.io.dynamixel.statistics import BusStatistics
from bluefoot_mpc.io.link import Link
from bluefoot_mpc.settings import require_nonnegative, require_positive

BITS_PER_BYTE = 10
_PAST = 0.0
"""A deadline that is always past: what waits is handed out at once."""

_CHUNK = 256
"""Bytes asked of the link at once: more than any reply."""

_MOST_STALE = 16
"""Chunks thrown away one by one; on a line that babbles the rest is discarded unseen."""

_SOUND = 0xFD
"""Low byte of the sum over a whole packet, header and checksum included, where it is sound."""

_LEAST_PATIENCE = 0.4
"""Share of the full patience below which haste never goes."""

_SLACK_FACTOR, _SLACK_MARGIN, _SLACK_DECAY = 2.0, 5e-4, 0.99
"""Haste leaves twice the slowest recent reply and 0.5 ms; "recent" fades by 1 % a reply."""

_PAYLOAD_ERRORS = ErrorBit.RANGE | ErrorBit.INSTRUCTION | ErrorBit.CHECKSUM


@dataclass(frozen=True, kw_only=True, slots=True)
class BusConfig:
    """How long to wait for servos, and what may be written to them."""

    latency: float = (
        0.001  # s, most that the adapter holds a reply back; its latency timer where that is longer
    )
    margin: float = 0.002  # s, for the host's scheduling
    return_delay: float = 0.0  # s, longest return delay of the servos (factory: 500 µs, fits into `margin`)
    late_window: float = 0.15  # s, how long a lost reply may still come
    tries: int = 3  # requests of a single transaction before it counts as failed; the cycle has its own rule
    allow_eeprom: bool = False  # permanent memory may be written: for the commissioning command alone

    def __post_init__(self) -> None:
        require_nonnegative(
            latency=self.latency, return_delay=self.return_delay, late_window=self.late_window
        )
        require_positive(margin=self.margin, tries=self.tries)


class Outcome(enum.Enum):
    """How a request stands."""

    WAITING = "waiting"
    OK = "ok"
    LOST = "no reply"
    CORRUPT = "corrupt reply"
    REFUSED = "refused by the servo"


class Wire:
    """Puts requests on a link and finds their answers.

    Args:
        link: the line.
        clock: the link's.
        config: times.
        latch: checked with every packet.

    Attributes:
        data: parameters of the last reply.
        error: `ErrorBit`s of the last reply.
        detail: what was wrong with the last reply, in words.
        deadline: s, when the wait for the request on its way ends.
        asked_at: s, when the request's last byte left, and the servo took its values.
        doubted: IDs of servos whose last reply was followed by a different one; the reader clears it.
        statistics: counts.
    """

    def __init__(self, link: Link, clock: Clock, config: BusConfig, latch: Latch) -> None:
        self.link, self.clock, self.config, self.latch = link, clock, config, latch
        self.statistics = BusStatistics()
        self.data = b""
        self.error = 0
        self.detail = ""
        self.deadline = self.asked_at = 0.0
        self.doubted: list[int] = []
        self._lock = threading.Lock()
        self._parser = StatusParser()
        self._free_at = self._earliest = self._passed = 0.0
        self._servo = -1
        self._count = self._noise = 0
        self._head = b""
        self._last: tuple[int, bytes] = (-1, b"")
        self._expected: dict[int, dict[int, float]] = {}
        self.tune()

    def tune(self) -> None:
        """Take byte time and latency from the link as it is now."""
        self.byte_time = BITS_PER_BYTE / self.link.baud
        timer = getattr(self.link, "latency_timer_ms", lambda: None)()
        latency = max(self.config.latency, (timer or 0.0) * 1e-3)
        self.patience = latency + self.config.margin + self.config.return_delay
        self._slack = latency
        self._is_paced = bool(getattr(self.link, "is_paced", False))

    def timeout(self, request: int, count: int) -> float:
        """Seconds that a lost reply costs at most: bytes of the request, parameters of the reply."""
        return (request + OVERHEAD + count) * self.byte_time + self.patience

    @property
    def haste(self) -> float:
        """How much sooner than usual (s, 0 or below) a request may be given up that will be repeated.

        Learnt from replies: where all come at once, waiting long for a lost one
        only costs time. The repetition waits in full, and so learns of slower
        replies.
        """
        learnt = _SLACK_FACTOR * self._slack + _SLACK_MARGIN
        return min(0.0, max(learnt, _LEAST_PATIENCE * self.patience) - self.patience)

    def put(self, packet: bytes) -> None:
        """Put a packet on the line, unless the latch or the guard of the EEPROM refuses it.

        Raises:
            LatchedError: it could move a servo, and the latch is closed.
            EepromRefusedError: it would write permanent memory.
            LinkLostError: the line is gone.
        """
        # Under one lock, so that after `Latch.close` and one more packet nothing that moves can follow.
        with self._lock:
            if packet[4] > Instruction.READ:
                if self.latch.closed and could_move(packet):
                    raise LatchedError(self.link.name, self.latch.reason)
                address = eeprom_address(packet)
                if address is not None and not self.config.allow_eeprom:
                    raise EepromRefusedError(self.link.name, address)
            self.link.write(packet)
            self._free_at = max(self.clock.now(), self._free_at) + len(packet) * self.byte_time

    def begin(self, packet: bytes, servo: int, count: int, patience: float = 0.0) -> None:
        """Send a request.

        Args:
            packet: the instruction.
            servo: who has to answer.
            count: parameters that the answer must have.
            patience: s to wait longer than usual, or shorter.

        Raises:
            LatchedError, EepromRefusedError, LinkLostError: as `put`.
        """
        stale = self.link.read(_CHUNK, _PAST)
        if stale or self._parser.pending:
            self._throw_away(stale)
        self._servo, self._count, self._noise = servo, count, 0
        self._head = bytes((0xFF, 0xFF, servo, count + 2))
        self.put(packet)
        self.asked_at = self._free_at
        passed = self.asked_at + (count + OVERHEAD) * self.byte_time
        self._passed = passed
        self._earliest = passed if self._is_paced else _PAST
        self.deadline = passed + self.patience + patience

    def poll(self, until: float) -> Outcome:
        """Wait for the answer.

        Args:
            until: s, not longer than that; `deadline` is heeded anyway.

        Raises:
            LinkLostError: the line is gone.
        """
        data = self.link.read(_CHUNK, min(until, self.deadline))
        if (
            self._count  # bare acknowledgements may carry a refusal: below
            and len(data) == self._count + OVERHEAD
            and data[:4] == self._head
            and sum(data) & 0xFF == _SOUND
            and not self._parser.pending
            and (self._earliest == _PAST or self.clock.now() >= self._earliest)
        ):
            return self._accept(data[4], data[5:-1])
        if data:
            outcome = self._judge(self._parser.feed(data))
            if outcome is not Outcome.WAITING:
                return outcome
        if self.clock.now() < self.deadline:
            return Outcome.WAITING
        # Something that looks like the beginning of a longer packet may hide the answer.
        outcome = self._judge(self._parser.flush())
        return self._lose() if outcome is Outcome.WAITING else outcome

    def wait(self) -> Outcome:
        """Poll until the request is answered or given up."""
        while (outcome := self.poll(self.deadline)) is Outcome.WAITING:
            pass
        return outcome

    def free_count(self, servo: int, counts: range) -> int | None:
        """The first of several lengths that no reply still on its way can have; None where there is none."""
        expected = self._expected.get(servo)
        if not expected:
            return counts[0]
        now = self.clock.now()
        for count in [count for count, until in expected.items() if until <= now]:
            del expected[count]
        return next((count for count in counts if count not in expected), None)

    def quiet_at(self, servo: int) -> float:
        """When no reply of a servo can be on its way any more, s."""
        return max(self._expected.get(servo, {}).values(), default=0.0)

    def reopen(self) -> None:
        """Open the line again after it was lost.

        Raises:
            LinkError: it is still gone.
        """
        self.link.reopen()
        self._parser.clear()
        self._free_at = 0.0
        self.statistics.reopened += 1
        self.tune()

    def _accept(self, error: int, data: bytes) -> Outcome:
        self.error, self.data = error, data
        self._last = (self._servo, data)
        self._slack = max(self.clock.now() - self._passed, _SLACK_DECAY * self._slack)
        self.statistics.of(self._servo).note(failed=False)
        return Outcome.OK

    def _lose(self) -> Outcome:
        until = self.clock.now() + self.config.late_window
        self._expected.setdefault(self._servo, {})[self._count] = until
        if self._noise:
            return self._spoil(f"{self._noise} unreadable bytes")
        counts = self.statistics.of(self._servo)
        counts.note(failed=True)
        counts.lost += 1
        return Outcome.LOST

    def _spoil(self, detail: str) -> Outcome:
        counts = self.statistics.of(self._servo)
        counts.note(failed=True)
        counts.corrupt += 1
        self.detail = detail
        return Outcome.CORRUPT

    def _judge(self, found: list[StatusPacket | Problem]) -> Outcome:
        """What the packets and problems that have come mean for the request."""
        answers: list[StatusPacket] = []
        spoilt = ""
        for item in found:
            if isinstance(item, Problem):
                self._count_problem(item)
                if item.kind is ProblemKind.BAD_CHECKSUM and item.id == self._servo:
                    spoilt = "bad checksum"
            elif self._is_answer(item):
                answers.append(item)
            else:
                spoilt = self._explain(item) or spoilt
        if answers:
            return self._choose(answers)
        if spoilt and not self._parser.pending:
            return self._spoil(spoilt)
        return Outcome.WAITING

    def _is_answer(self, packet: StatusPacket) -> bool:
        if packet.id != self._servo or self.clock.now() < self._earliest:
            return False
        return len(packet.parameters) == self._count or self._is_refusal(packet)

    def _is_refusal(self, packet: StatusPacket) -> bool:
        return bool(packet.error & _PAYLOAD_ERRORS) and not packet.parameters

    def _choose(self, answers: list[StatusPacket]) -> Outcome:
        counts = self.statistics.of(self._servo)
        counts.duplicates += len(answers) - 1
        answer = answers[0]
        if any(other.parameters != answer.parameters for other in answers):
            return self._spoil("two different replies to one request")
        self.error = answer.error
        if answer.error & ErrorBit.CHECKSUM:
            return self._spoil("the request reached the servo with a bad checksum")
        if self._is_refusal(answer):
            counts.note(failed=False)
            counts.refused += 1
            return Outcome.REFUSED
        return self._accept(answer.error, answer.parameters)

    def _explain(self, packet: StatusPacket) -> str:
        """Count a packet that does not answer the request; words where it spoils it."""
        count = len(packet.parameters)
        counts = self.statistics.of(packet.id)
        expected = self._expected.get(packet.id)
        if expected and expected.pop(count, None) is not None:
            counts.late += 1
            return ""
        if packet.id == self._last[0] and count == len(self._last[1]):
            counts.duplicates += 1
            if packet.parameters != self._last[1]:
                self.doubted.append(packet.id)
            return ""
        if packet.id != self._servo:
            if self._servo >= 0:
                self.statistics.of(self._servo).wrong_id += 1
            return ""
        counts.short += 1
        return f"{count} bytes instead of {self._count}"

    def _count_problem(self, problem: Problem) -> None:
        if problem.kind is ProblemKind.GARBAGE:
            self.statistics.garbage_bytes += len(problem.data)
            self._noise += len(problem.data)
        elif problem.kind is ProblemKind.BAD_CHECKSUM:
            self.statistics.bad_checksums += 1

    def _throw_away(self, stale: bytes) -> None:
        """What waits before a request cannot be its answer: count it, and forget it."""
        self._servo = -1
        chunks = 0
        while stale and chunks < _MOST_STALE:
            self.statistics.stale_bytes += len(stale)
            self._tally(self._parser.feed(stale))
            stale = self.link.read(_CHUNK, _PAST)
            chunks += 1
        self._tally(self._parser.flush())
        if stale:
            self.link.discard()

    def _tally(self, found: list[StatusPacket | Problem]) -> None:
        for item in found:
            if isinstance(item, Problem):
                self._count_problem(item)
            else:
                self._explain(item)
