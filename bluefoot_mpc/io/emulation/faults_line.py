"""A device with faults: stands between a link and any emulated device and spoils what passes."""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterable

import numpy as np

from bluefoot_mpc.io.emulation.device import Device
from bluefoot_mpc.io.emulation.faults import KINDS, Fault, FaultPlan
from bluefoot_mpc.io.emulation.faults_bytes import changed, is_packet, noise, spoil
from bluefoot_mpc.io.emulation.faults_servo import ServoFaults
from bluefoot_mpc.io.emulation.memory_link import BITS_PER_BYTE
from bluefoot_mpc.io.emulation.servo_line import ServoLine

_BABBLE_TICK = 1e-3
"""s between pieces of babble."""
_SYNC_WRITE = 0x83


class FaultyLine:
    """A `Device` around a device, which does what a plan says.

    Args:
        device: what works.
        plan: faults of this line (see `FaultPlan.on`).
        start: s on the line's clock, zero of the plan's times.

    Attributes:
        device: what works.
        counts: how often each kind of fault has struck, by name.
    """

    def __init__(self, device: Device, plan: FaultPlan, start: float = 0.0) -> None:
        self.device = device
        self.counts: dict[str, int] = {}
        self._start = start
        self._rng = np.random.default_rng(plan.seed)
        of = _by_reach(plan.faults)
        self._reply, self._request, self._line = of["reply"], of["request"], of["line"]
        self._servo: ServoFaults | None = None
        if isinstance(device, ServoLine):
            self._servo = ServoFaults(device, plan.faults, start)
        self._seen: dict[int, int] = {}
        self._events = sorted({t for f in plan.faults for t in _moments(f) if math.isfinite(t)})
        self._waiting: list[tuple[float, int, bytes]] = []
        self._order = 0
        self._held = b""
        self._next_babble = math.inf
        self._act(start)

    @property
    def host_baud(self) -> int:
        """Bit/s that the host talks with."""
        return int(getattr(self.device, "host_baud", 1_000_000))

    @host_baud.setter
    def host_baud(self, baud: int) -> None:
        if hasattr(self.device, "host_baud"):
            self.device.host_baud = baud

    def hung_up(self, time: float) -> bool:
        """True while the adapter is gone."""
        return self._is_on("usb_lost", time)

    def receive(self, data: bytes, time: float) -> None:
        """Take bytes of which the last arrived at `time` (s)."""
        self._act(time)
        if self.hung_up(time):
            return
        if self._is_on("babble", time):
            self._count("babble")  # nobody is heard while somebody shouts
            return
        if self._is_on("stall", time):
            self._held += data
            return
        for fault in self._request:
            if self._strikes(fault, data, time):
                data = b"" if fault.kind == "drop_request" else self._corrupted(data)
        if data:
            self.device.receive(data, time)

    def due(self) -> float:
        """Time (s) at which something reaches the host, or a fault begins or ends."""
        soonest = min(self.device.due(), self._next_babble)
        if self._waiting:
            soonest = min(soonest, self._waiting[0][0])
        return min(soonest, self._start + self._events[0]) if self._events else soonest

    def transmit(self, time: float) -> bytes:
        """Every byte that has arrived at the host by `time` (s) and was not handed out before."""
        self._act(time)
        while (due := self.device.due()) <= time and (reply := self.device.transmit(due)):
            self._pass_on(reply, due)
        self._pass_on(self.device.transmit(time), time)
        data = b""
        while self._waiting and self._waiting[0][0] <= time:
            data += heapq.heappop(self._waiting)[2]
        return data

    def _act(self, time: float) -> None:
        """Begin and end what is due by `time`."""
        events = self._events
        while events and self._start + events[0] <= time:
            moment = self._start + events.pop(0)
            self._babble_until(moment)
            self._turn(moment)
        self._babble_until(time)
        if self._servo is not None:
            self._servo.apply(time - self._start, time)

    def _turn(self, moment: float) -> None:
        """Faults of the line at a moment where a window opens or closes."""
        if self._servo is not None:
            self._servo.apply(moment - self._start, moment)
        if self.hung_up(moment):
            self._waiting.clear()
            self._held = b""
        if self._held and not self._is_on("stall", moment):
            held, self._held = self._held, b""
            self.device.receive(held, moment + len(held) * BITS_PER_BYTE / self.host_baud)
        if not self._is_on("babble", moment):
            self._next_babble = math.inf
        elif math.isinf(self._next_babble):
            self._next_babble = moment

    def _babble_until(self, time: float) -> None:
        while self._next_babble <= time:
            rate = max(fault.amount for fault in self._line if fault.kind == "babble")
            self._push(self._next_babble, noise(max(1, round(rate * _BABBLE_TICK)), self._rng))
            self._next_babble += _BABBLE_TICK

    def _pass_on(self, data: bytes, time: float) -> None:
        """Put a reply into what waits for the host, with all that is wrong with it."""
        if not data or self.hung_up(time):
            return
        pieces = [(0.0, data)]
        for fault in self._reply:
            if self._strikes(fault, data, time):
                pieces = [(d + e, b) for d, p in pieces if p for e, b in spoil(p, fault, self._rng)]
        for delay, piece in pieces:
            self._push(time + delay, piece)

    def _push(self, time: float, data: bytes) -> None:
        """Queue bytes for the host, not before a stall's end and at a tick of the adapter's timer."""
        for fault in self._line:
            if not fault.is_on(time - self._start):
                continue
            if fault.kind == "stall":
                time = self._start + fault.stop
            elif fault.kind == "latency_timer":
                time = self._start + math.ceil((time - self._start) / fault.amount) * fault.amount
        self._order += 1
        heapq.heappush(self._waiting, (time, self._order, data))

    def _strikes(self, fault: Fault, data: bytes, time: float) -> bool:
        """True where a fault acts on this piece."""
        if not fault.is_on(time - self._start) or not data:
            return False
        if fault.servo is not None and not (is_packet(data) and data[2] == fault.servo):
            return False
        if fault.kind == "corrupt_sync_write" and not (is_packet(data) and data[4] == _SYNC_WRITE):
            return False
        if fault.nth:
            self._seen[id(fault)] = seen = self._seen.get(id(fault), 0) + 1
            if seen != fault.nth:
                return False
        if fault.probability < 1.0 and self._rng.random() >= fault.probability:
            return False
        self._count(fault.kind)
        return True

    def _corrupted(self, data: bytes) -> bytes:
        """One byte of what the host sent changed; of its first packet, where it sent packets."""
        size = data[3] + 4 if is_packet(data) else len(data)
        return changed(data[:size], self._rng, first=2 if size > 2 else 0) + data[size:]

    def _is_on(self, kind: str, time: float) -> bool:
        return any(f.kind == kind and f.is_on(time - self._start) for f in self._line)

    def _count(self, kind: str) -> None:
        self.counts[kind] = self.counts.get(kind, 0) + 1


def _moments(fault: Fault) -> tuple[float, float]:
    return fault.start, fault.stop


def _by_reach(faults: Iterable[Fault]) -> dict[str, list[Fault]]:
    groups: dict[str, list[Fault]] = {"reply": [], "request": [], "line": [], "servo": [], "start": []}
    for fault in faults:
        groups[KINDS[fault.kind].acts_on].append(fault)
    return groups
