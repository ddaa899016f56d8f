"""Single transactions with servos on a port: they succeed, or raise what names servo, port and mend.

For setting up and checking; the fifty cycles a second of a running robot go
through `cycle.BusCycle`. One thread owns a bus; only `broadcast` (an emergency
stop) may come from another.
"""

from __future__ import annotations

import contextlib
from collections.abc import Mapping

from bluefoot_mpc.io.clock import Clock
from bluefoot_mpc.io.dynamixel.codec import (
    BROADCAST_ID,
    ErrorBit,
    Instruction,
    instruction_packet,
    ping_packet,
    read_packet,
    sync_write_packet,
    write_packet,
)
from bluefoot_mpc.io.dynamixel.errors import CorruptReplyError, NoReplyError, ServoFaultError
from bluefoot_mpc.io.dynamixel.latch import Latch
from bluefoot_mpc.io.dynamixel.replies import Outcome
from bluefoot_mpc.io.dynamixel.statistics import BusStatistics
from bluefoot_mpc.io.dynamixel.table import AX12A, RAM_START, Register
from bluefoot_mpc.io.dynamixel.wire import BusConfig, Wire
from bluefoot_mpc.io.link import Link

__all__ = ["BusConfig", "ServoBus"]

_REFUSED = ErrorBit.RANGE | ErrorBit.INSTRUCTION | ErrorBit.ANGLE_LIMIT

_SPARE_LENGTHS = 6
"""Lengths that a repeated read can have, so that it is told from the replies before it."""

EEPROM_PATIENCE = 0.05
"""Seconds more that a servo may take to acknowledge a write to its permanent memory (estimate)."""


class ServoBus:
    """Servos on one port.

    Args:
        link: the port.
        clock: the link's.
        config: times, and whether permanent memory may be written.
        latch: shared by all ports of a robot; one of its own, open, where not given.

    Attributes:
        link: the port.
        wire: requests and replies, for the cycle.
        errors: error bits of each servo's last reply, by ID.
    """

    def __init__(
        self, link: Link, clock: Clock, config: BusConfig | None = None, latch: Latch | None = None
    ) -> None:
        self.link = link
        self.clock = clock
        self.config = config or BusConfig()
        self.wire = Wire(link, clock, self.config, latch or Latch())
        self.errors: dict[int, int] = {}
        self._unanswered: dict[int, bytes] = {}

    @property
    def name(self) -> str:
        """Name of the port."""
        return self.link.name

    @property
    def latch(self) -> Latch:
        """What refuses every packet that could move a servo while it is closed."""
        return self.wire.latch

    @property
    def statistics(self) -> BusStatistics:
        """Counts of what went wrong."""
        return self.wire.statistics

    def close(self) -> None:
        """Give the port back. Idempotent, never raises."""
        self.link.close()

    def ping(self, servo: int, *, tries: int | None = None, patience: float = 0.0) -> ErrorBit:
        """Ask whether a servo is there; gives its error bits.

        Args:
            servo: ID.
            tries: requests before giving up; as configured where not given.
            patience: s to wait longer than usual for each reply.

        Raises:
            NoReplyError: nobody answers.
            CorruptReplyError: what comes is garbled: two servos may share the ID.
        """
        self._transact(servo, ping_packet(servo), tries, patience)
        return ErrorBit(self.errors[servo])

    def read(self, servo: int, register: Register | str) -> int:
        """A register's value.

        Raises:
            NoReplyError, CorruptReplyError, ServoFaultError: it cannot be had.
        """
        entry = _register(register)
        return entry.decode(self.read_block(servo, entry.address, entry.size))

    def read_block(
        self, servo: int, address: int, count: int, *, tries: int | None = None, patience: float = 0.0
    ) -> bytes:
        """Bytes of the control table.

        A repeated read asks for a byte more each time, so that a late reply to
        the one before cannot be taken for its own.

        Args:
            servo: ID.
            address: first register.
            count: bytes.
            tries: requests before giving up; as configured where not given.
            patience: s to wait longer than usual for each reply.

        Raises:
            NoReplyError, CorruptReplyError, ServoFaultError: they cannot be had.
        """
        outcome = Outcome.LOST
        most = min(count + _SPARE_LENGTHS, AX12A.size - address)
        lengths = range(count, max(most, count) + 1)
        budget = tries or self.config.tries
        for attempt in range(budget):
            self.statistics.of(servo).retries += attempt > 0
            length = self.wire.free_count(servo, lengths)
            if length is None:
                self._wait_for_late_replies(servo)
                length = count
            self.wire.begin(read_packet(servo, address, length), servo, length, patience)
            outcome = self._finish(servo)
            if outcome in {Outcome.OK, Outcome.REFUSED}:
                break
        self._raise_unless_ok(outcome, servo, budget)
        return self.wire.data[:count]

    def write(self, servo: int, register: Register | str, value: int, *, acknowledged: bool = True) -> None:
        """Write a register and wait for the servo's word that it did.

        Args:
            servo: ID.
            register: which.
            value: counts.
            acknowledged: False for a servo whose status return level forbids it to answer.

        Raises:
            ValueError: outside the register's range.
            LatchedError: it could move the servo, and the latch is closed.
            EepromRefusedError: permanent memory, which this bus may not write.
            NoReplyError, CorruptReplyError: it is not known whether the servo did.
            ServoFaultError: it refused.
        """
        entry = _register(register)
        packet = write_packet(servo, entry.address, entry.encode(value))
        if not acknowledged:
            self.wire.put(packet)
            return
        patience = EEPROM_PATIENCE if entry.address < RAM_START else 0.0
        self._transact(servo, packet, None, patience, _REFUSED)

    def write_verified(self, servo: int, register: Register | str, value: int) -> None:
        """Write a register and read it back: right even where the acknowledgement is lost or never sent.

        Raises:
            NoReplyError, CorruptReplyError: it cannot be read back.
            ServoFaultError: the servo refused, or holds another value.
        """
        entry = _register(register)
        # A lost acknowledgement means little: what counts is what the servo holds.
        with contextlib.suppress(NoReplyError, CorruptReplyError):
            self.write(servo, entry, value)
        found = self.read(servo, entry)
        if found != value:
            raise ServoFaultError(
                servo, self.name, self.errors[servo], f"{entry.name} holds {found} after {value} was written"
            )

    def reg_write(self, servo: int, register: Register | str, value: int) -> None:
        """Have a servo keep a value until `action`.

        Raises:
            LatchedError, EepromRefusedError, NoReplyError, CorruptReplyError, ServoFaultError: as `write`.
        """
        entry = _register(register)
        packet = write_packet(servo, entry.address, entry.encode(value), registered=True)
        self._transact(servo, packet, None, 0.0, _REFUSED)

    def action(self, servo: int = BROADCAST_ID) -> None:
        """Let the values of `reg_write` act; all servos at once where no ID is given.

        Raises:
            LatchedError: the latch is closed.
            NoReplyError, CorruptReplyError, ServoFaultError: as `write`, for a single servo.
        """
        packet = instruction_packet(servo, Instruction.ACTION)
        if servo == BROADCAST_ID:
            self.wire.put(packet)
        else:
            self._transact(servo, packet, None, 0.0, _REFUSED)

    def sync_write(self, address: int, data: Mapping[int, bytes]) -> None:
        """Write as many bytes to each of several servos at once; nobody answers.

        Args:
            address: first register.
            data: bytes by ID, all of one length.

        Raises:
            ValueError: lengths differ, or it is too long for a servo's buffer (143 bytes).
            LatchedError, EepromRefusedError: as `write`.
        """
        self.wire.put(sync_write_packet(address, data))

    def broadcast(self, register: Register | str, value: int) -> None:
        """Write a register of every servo; nobody answers. From any thread.

        Raises:
            ValueError, LatchedError, EepromRefusedError: as `write`.
        """
        entry = _register(register)
        self.wire.put(write_packet(BROADCAST_ID, entry.address, entry.encode(value)))

    def _transact(
        self, servo: int, packet: bytes, tries: int | None, patience: float, refusal: int = 0
    ) -> None:
        """Send until a bare acknowledgement comes; a late one to the same packet does as well."""
        outcome = Outcome.LOST
        budget = tries or self.config.tries
        if self._unanswered.get(servo, packet) != packet and self.wire.free_count(servo, range(1)) != 0:
            self._wait_for_late_replies(servo)
        for attempt in range(budget):
            self.statistics.of(servo).retries += attempt > 0
            self.wire.begin(packet, servo, 0, patience)
            outcome = self._finish(servo)
            if outcome in {Outcome.OK, Outcome.REFUSED}:
                break
        if outcome is Outcome.LOST:
            self._unanswered[servo] = packet
        else:
            self._unanswered.pop(servo, None)
        self._raise_unless_ok(outcome, servo, budget, refusal)

    def _finish(self, servo: int) -> Outcome:
        outcome = self.wire.wait()
        if outcome in {Outcome.OK, Outcome.REFUSED}:
            self.errors[servo] = self.wire.error
        return outcome

    def _wait_for_late_replies(self, servo: int) -> None:
        self.clock.sleep_until(self.wire.quiet_at(servo))

    def _raise_unless_ok(self, outcome: Outcome, servo: int, tries: int, refusal: int = 0) -> None:
        if outcome is Outcome.LOST:
            raise NoReplyError(servo, self.name, tries)
        if outcome is Outcome.CORRUPT:
            raise CorruptReplyError(servo, self.name, self.wire.detail)
        if outcome is Outcome.REFUSED or self.wire.error & refusal:
            raise ServoFaultError(servo, self.name, self.wire.error)


def _register(register: Register | str) -> Register:
    return AX12A[register] if isinstance(register, str) else register
