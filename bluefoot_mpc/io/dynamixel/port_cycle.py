"""The cycle of one port: which request comes next, and what a missing reply means."""

from __future__ import annotations

import logging
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import BROADCAST_ID, HEADER, Instruction
from bluefoot_mpc.io.dynamixel.errors import LatchedError
from bluefoot_mpc.io.dynamixel.replies import Outcome
from bluefoot_mpc.io.dynamixel.servo_state import Kind, ServoState
from bluefoot_mpc.io.dynamixel.table import MOTION_START
from bluefoot_mpc.io.link import LinkError, LinkLostError
from bluefoot_mpc.settings import require_nonnegative, require_positive

log = logging.getLogger(__name__)

_BLEND = 0.05
"""Weight of the newest transaction in the typical time of one."""

_LONG_GONE = 2
"""Cycles without a reply after which a servo's return is news for the others."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CycleConfig:
    """How the cycle deals with servos that do not answer."""

    misses: int = 5  # cycles in a row without a reply after which a servo is left out
    first_probe: float = 0.2  # s until one that is left out is asked again; 0.5 s of silence is a fault
    probe_period: float = 1.0  # s between questions after that
    reopen_period: float = 0.1  # s between attempts to open a lost port again
    limit_repeats: int = 2  # how often a new torque limit is sent once more: nobody acknowledges it

    def __post_init__(self) -> None:
        require_positive(
            misses=self.misses, first_probe=self.first_probe, probe_period=self.probe_period,
            reopen_period=self.reopen_period,
        )  # fmt: skip
        require_nonnegative(limit_repeats=self.limit_repeats)


class PortCycle:
    """Servos of one port, one request after another.

    Args:
        bus: the port.
        servos: that hang on it.
        config: limits.

    Attributes:
        is_lost: True while the port itself is gone.
    """

    def __init__(self, bus: ServoBus, servos: Sequence[ServoState], config: CycleConfig) -> None:
        self.bus = bus
        self.wire = bus.wire
        self.servos = list(servos)
        self.is_lost = False
        self._config = config
        self._clock = bus.clock
        self._by_id = {servo.id: servo for servo in servos}
        self._jobs: list[tuple[ServoState, Kind, bool]] = []
        self._at = 0
        self._turn = 0
        self._cut_off: dict[tuple[int, bool], int] = {}
        self._begun = 0.0
        self._is_short = False
        self._typical = self.wire.timeout(8, 2) - self.wire.patience
        self._reopen_at = 0.0
        self._structs: dict[tuple[int, bool], struct.Struct] = {}

    # Writing.

    def write(self, goals: Sequence[int], speeds: Sequence[int], limits: Sequence[int] | None) -> bool:
        """Sync-write the servos that take goals; False where nothing went out.

        Args:
            goals: (16,) counts.
            speeds: (16,) counts.
            limits: (16,) counts, or None to leave them as they are.
        """
        taking = [servo for servo in self.servos if servo.takes_goals]
        if not taking or self.is_lost:
            return False
        try:
            if limits is None or not any(_needs_limit(servo, limits) for servo in taking):
                self.wire.put(self._packet(taking, goals, speeds, None))
                return True
            # A limit written to a servo that shut itself off would switch it on again.
            sound = [servo for servo in taking if not servo.shut]
            shut = [servo for servo in taking if servo.shut]
            if sound:
                self.wire.put(self._packet(sound, goals, speeds, limits))
                self._note_limits(sound, limits)
            if shut:
                self.wire.put(self._packet(shut, goals, speeds, None))
        except LatchedError:
            return False
        except LinkLostError as error:
            self.lose(error)
            return False
        return True

    def _note_limits(self, servos: Sequence[ServoState], limits: Sequence[int]) -> None:
        for servo in servos:
            limit = limits[servo.joint]
            if servo.limit != limit:
                servo.limit, servo.limit_repeats = limit, self._config.limit_repeats
            else:
                servo.limit_repeats = max(servo.limit_repeats - 1, 0)

    def _packet(
        self,
        servos: Sequence[ServoState],
        goals: Sequence[int],
        speeds: Sequence[int],
        limits: Sequence[int] | None,
    ) -> bytes:
        """A sync write of goal and speed, and of the torque limit where given."""
        values = [BROADCAST_ID, 0, Instruction.SYNC_WRITE, MOTION_START, 4 if limits is None else 6]
        if limits is None:
            for servo in servos:
                values += (servo.id, goals[servo.joint], speeds[servo.joint])
        else:
            for servo in servos:
                values += (servo.id, goals[servo.joint], speeds[servo.joint], limits[servo.joint])
        layout = self._layout(len(servos), limits is not None)
        values[1] = layout.size - 1
        body = layout.pack(*values)
        return HEADER + body + bytes((~sum(body) & 0xFF,))

    def _layout(self, n: int, has_limits: bool) -> struct.Struct:
        layout = self._structs.get((n, has_limits))
        if layout is None:
            layout = struct.Struct("<5B" + ("BHHH" if has_limits else "BHH") * n)
            self._structs[n, has_limits] = layout
        return layout

    # Reading.

    def open(self) -> None:
        """Begin a cycle: what was cut off, healthy servos, those in doubt, one full read, one probe."""
        now = self._clock.now()
        servos = self.servos
        for servo in servos:
            servo.fresh = servo.put_off = False
        self._jobs.clear()
        self._at = 0
        if self.is_lost and not self._reopen(now):
            return
        asked = [servo for servo in servos if not servo.suspect]
        jobs = [(servo, Kind.POSITION, False) for servo in asked if not servo.doubtful]
        jobs += [(servo, Kind.CHECK, False) for servo in asked if servo.doubtful]
        healthy = [servo for servo in servos if not (servo.suspect or servo.doubtful)]
        if healthy:
            jobs.append((healthy[self._turn % len(healthy)], Kind.FULL, False))
        probe = min((s for s in servos if s.suspect), key=lambda servo: servo.probe_at, default=None)
        # Where nobody answers, the cause is common to all, and one answer tells that it is over.
        if probe is not None and (probe.probe_at <= now or not asked):
            probe.probe_at = now + self._config.probe_period
            jobs.append((probe, Kind.CHECK, True))
        if self._cut_off:
            late = self._cut_off
            jobs.sort(key=lambda job: late.get((job[0].id, job[1] is Kind.FULL), len(late)))
            self._cut_off = {}
        self._jobs = jobs

    def start_next(self, deadline: float) -> bool:
        """Send the next request; False where the cycle of this port is over.

        Raises:
            LinkLostError: the port is gone.
        """
        begun = False
        while self._at < len(self._jobs) and not begun:
            servo, kind, is_last = self._jobs[self._at]
            self._begun = self._clock.now()
            count = self.wire.free_count(servo.id, kind.lengths)
            if self._begun + self._needed(count) > deadline:
                for left, which, _ in self._jobs[self._at :]:
                    self._put_off(left, which)
                break
            self._at += 1
            if count is None:
                self._miss(servo)
                continue
            haste = 0.0 if is_last or servo.misses else self.wire.haste
            # Nor longer than the cycle: what comes after its end is told from later replies by its length.
            left_over = deadline - self._begun - self.wire.timeout(8, count)
            self._is_short = left_over < haste
            self.wire.begin(servo.requests[kind][count], servo.id, count, min(haste, left_over))
            begun = True
        if self.wire.doubted:
            self._withdraw()
        return begun

    def _needed(self, count: int | None) -> float:
        """Seconds that a reply with so many parameters takes: what comes next must not talk over its end."""
        on_the_line = 0.0 if count is None else self.wire.timeout(8, count) - self.wire.patience
        return max(self._typical, on_the_line)

    def _put_off(self, servo: ServoState, kind: Kind) -> None:
        """Ask it first in the next cycle."""
        servo.put_off = servo.put_off or kind is not Kind.FULL
        self._cut_off.setdefault((servo.id, kind is Kind.FULL), len(self._cut_off))

    def finish(self, outcome: Outcome, deadline: float) -> None:
        """Take the outcome of the request that was sent last."""
        servo, kind, is_retry = self._jobs[self._at - 1]
        wire = self.wire
        self._turn += kind is Kind.FULL
        if outcome is Outcome.OK:
            self._typical += _BLEND * (self._clock.now() - self._begun - self._typical)
            self._hear(servo, kind)
            return
        if outcome is Outcome.REFUSED:
            servo.error = wire.error
        if kind is Kind.FULL:
            return  # its position is known already
        if self._is_short and outcome is Outcome.LOST:
            servo.doubtful = True
            self._put_off(servo, kind)
            return
        now = self._clock.now()
        left = len(self._jobs) - self._at
        patience = wire.timeout(8, Kind.CHECK.lengths[-1])
        if is_retry or servo.misses > 1 or now + left * self._typical + patience > deadline:
            self._miss(servo)
            return
        wire.statistics.of(servo.id).retries += 1
        # The second question asks for more: whether the servo still has what it was told.
        self._jobs.insert(self._at, (servo, Kind.CHECK, True))

    def lose(self, error: LinkError) -> None:
        """The port is gone: nothing is known of its servos until it is back."""
        log.warning("servo bus: %s", error)
        self.is_lost = True
        self._jobs.clear()
        self._at = 0
        self._reopen_at = self._clock.now() + self._config.reopen_period
        for servo in self.servos:
            servo.doubtful = True

    def _reopen(self, now: float) -> bool:
        if now < self._reopen_at:
            return False
        try:
            self.wire.reopen()
        except LinkError:
            self._reopen_at = now + self._config.reopen_period
            return False
        log.warning("servo bus: %s is back", self.bus.name)
        self.is_lost = False
        return True

    def _hear(self, servo: ServoState, kind: Kind) -> None:
        was_suspect, missed = servo.suspect, servo.misses
        has_lost_ram = servo.take(kind, self.wire.data, self.wire.error, self.wire.asked_at)
        if has_lost_ram:
            log.warning(
                "%s is back without torque (it lost power): goals are withheld until it is armed", servo.part
            )
        elif was_suspect:
            log.warning("%s answers again", servo.part)
        if missed > _LONG_GONE:
            self._hope(self._clock.now())

    def _hope(self, now: float) -> None:
        """A servo is back: what kept it away may have kept others away, so they are asked soon."""
        silent = [servo for servo in self.servos if servo.suspect]
        for servo in silent:
            servo.probe_at = min(servo.probe_at, now)
        if len(silent) == len(self.servos) - 1:
            for servo in silent:
                servo.suspect = False  # still in doubt, and left out again at the next miss

    def _miss(self, servo: ServoState) -> None:
        servo.misses += 1
        servo.doubtful = True
        if servo.misses >= self._config.misses and not servo.suspect:
            servo.suspect = True
            servo.probe_at = self._clock.now() + self._config.first_probe
            log.warning(
                "%s has not answered %d times in a row: left out. Check its cable", servo.part, servo.misses
            )

    def _withdraw(self) -> None:
        """Readings that were followed by a different reply: nobody knows which one was the answer."""
        for servo in self.wire.doubted:
            if servo in self._by_id:
                self._by_id[servo].fresh = False
        self.wire.doubted.clear()


def _needs_limit(servo: ServoState, limits: Sequence[int]) -> bool:
    return not servo.shut and (servo.limit != limits[servo.joint] or servo.limit_repeats > 0)
