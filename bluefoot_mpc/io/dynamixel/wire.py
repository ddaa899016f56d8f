"""One request and its answer on a half-duplex line: deadlines, and which bytes may be believed.

Three things keep a late reply from being taken for the answer to a later
request: whatever waits before a request is thrown away; lengths differ (see
`replies`); and on a line whose bytes take their time, an answer cannot be there
before request and answer have passed.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel.codec import OVERHEAD, Instruction
from bluefoot_mpc.io.dynamixel.errors import EepromRefusedError, LatchedError
from bluefoot_mpc.io.dynamixel.latch import Latch, could_move, eeprom_address
from bluefoot_mpc.io.dynamixel.replies import NOW, Outcome, Replies
from bluefoot_mpc.io.link import Link
from bluefoot_mpc.settings import require_nonnegative, require_positive

BITS_PER_BYTE = 10
_CHUNK = 256
"""Bytes asked of the link at once: more than any reply."""

_MOST_STALE = 16
"""Chunks thrown away one by one; on a line that babbles the rest is discarded unseen."""

_SOUND = 0xFD
"""Low byte of the sum over a whole packet, header and checksum included, where it is sound."""

_LEAST_PATIENCE = 0.4
"""Share of the full patience below which haste never goes."""

_SLACK_FACTOR, _SLACK_MARGIN = 2.0, 5e-4
"""Haste leaves twice the lateness of the slowest recent reply, and 0.5 ms."""


@dataclass(frozen=True, kw_only=True, slots=True)
class BusConfig:
    """How long to wait for servos, and what may be written to them."""

    latency: float = 0.001  # s, most that the adapter holds a reply back; its timer where that is longer
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


class Wire(Replies):
    """Puts requests on a link and waits for their answers.

    Args:
        link: the line.
        clock: the link's.
        config: times.
        latch: checked with every packet.

    Attributes:
        deadline: s, when the wait for the request on its way ends.
        asked_at: s, when the request's last byte left, and the servo took its values.
        byte_time: s of one byte on the line.
        patience: s that a reply may be late.
    """

    def __init__(self, link: Link, clock: Clock, config: BusConfig, latch: Latch) -> None:
        super().__init__(clock, config.late_window, config.latency)
        self.link, self.config, self.latch = link, config, latch
        self.deadline = self.asked_at = 0.0
        self._lock = threading.Lock()
        self._free_at = 0.0
        self._head = b""
        self.tune()

    def tune(self) -> None:
        """Take byte time and latency from the link as it is now."""
        self.byte_time = BITS_PER_BYTE / self.link.baud
        timer = getattr(self.link, "latency_timer_ms", lambda: None)()
        latency = max(self.config.latency, (timer or 0.0) * 1e-3)
        self.patience = latency + self.config.margin + self.config.return_delay
        self.slack = latency
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
        learnt = _SLACK_FACTOR * self.slack + _SLACK_MARGIN
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
            # The time before: who is delayed after writing must not take the reply for too early.
            start = max(self.clock.now(), self._free_at)
            self.link.write(packet)
            self._free_at = start + len(packet) * self.byte_time

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
        stale = self.link.read(_CHUNK, NOW)
        if stale or self._parser.pending:
            self._throw_away(stale)
        self._head = bytes((0xFF, 0xFF, servo, count + 2))
        self.put(packet)
        self.asked_at = self._free_at
        passed = self.asked_at + (count + OVERHEAD) * self.byte_time
        self.expect(servo, count, passed, is_paced=self._is_paced)
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
            and (self._earliest == NOW or self.clock.now() >= self._earliest)
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

    def _throw_away(self, stale: bytes) -> None:
        """What waits before a request cannot be its answer: count it, and forget it."""
        self._servo = -1
        chunks = 0
        while stale and chunks < _MOST_STALE:
            self.statistics.stale_bytes += len(stale)
            self._tally(self._parser.feed(stale))
            stale = self.link.read(_CHUNK, NOW)
            chunks += 1
        self._tally(self._parser.flush())
        if stale:
            self.link.discard()
