"""Which of the packets on a line answers a request, and what the others mean.

Protocol 1.0 has no numbers in its packets, so a reply that comes late looks
like the answer to a later request. Here lengths tell them apart: as long as a
lost reply may still come, no request expects its length (`Replies.free_count`).
"""

from __future__ import annotations

import enum

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel.codec import ErrorBit, Problem, ProblemKind, StatusPacket, StatusParser
from bluefoot_mpc.io.dynamixel.statistics import BusStatistics

NOW = 0.0
"""A deadline or an earliest time that is always past."""

_SLACK_DECAY = 0.99
"""By how much the slowest recent reply is forgotten with each reply."""

_PAYLOAD_ERRORS = ErrorBit.RANGE | ErrorBit.INSTRUCTION | ErrorBit.CHECKSUM


class Outcome(enum.Enum):
    """How a request stands."""

    WAITING = "waiting"
    OK = "ok"
    LOST = "no reply"
    CORRUPT = "corrupt reply"
    REFUSED = "refused by the servo"


class Replies:
    """Judges what comes after a request.

    Args:
        clock: the line's.
        late_window: s, how long a lost reply may still come.
        slack: s, by how much the slowest reply is expected to be late.

    Attributes:
        data: parameters of the last reply.
        error: `ErrorBit`s of the last reply.
        detail: what was wrong with the last reply, in words.
        doubted: IDs of servos whose last reply was followed by a different one; the reader clears it.
        statistics: counts.
        slack: s, by how much the slowest of the recent replies was late.
    """

    def __init__(self, clock: Clock, late_window: float, slack: float) -> None:
        self.clock = clock
        self.statistics = BusStatistics()
        self.data = b""
        self.error = 0
        self.detail = ""
        self.doubted: list[int] = []
        self.slack = slack
        self._late_window = late_window
        self._parser = StatusParser()
        self._servo = -1
        self._count = self._noise = 0
        self._passed = self._earliest = NOW
        self._last: tuple[int, bytes] = (-1, b"")
        self._expected: dict[int, dict[int, float]] = {}

    def expect(self, servo: int, count: int, passed: float, *, is_paced: bool) -> None:
        """A request goes out.

        Args:
            servo: who has to answer.
            count: parameters that the answer must have.
            passed: s, when request and reply have gone over the line at the earliest.
            is_paced: True where nothing can be faster than that.
        """
        self._servo, self._count, self._noise = servo, count, 0
        self._passed = passed
        self._earliest = passed if is_paced else NOW

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

    def _accept(self, error: int, data: bytes) -> Outcome:
        self.error, self.data = error, data
        self._last = (self._servo, data)
        self.slack = max(self.clock.now() - self._passed, _SLACK_DECAY * self.slack)
        self.statistics.of(self._servo).note(failed=False)
        return Outcome.OK

    def _lose(self) -> Outcome:
        until = self.clock.now() + self._late_window
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

    def _tally(self, found: list[StatusPacket | Problem]) -> None:
        for item in found:
            if isinstance(item, Problem):
                self._count_problem(item)
            else:
                self._explain(item)
