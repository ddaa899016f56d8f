import math

import pytest

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.faults import Fault, FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.link import LinkError, LinkLostError
from tests.io.emulation.bench import PING, Bench, packet, status


class Parrot:
    """Says every byte back, 1 ms after it came."""

    def __init__(self):
        self.said = []
        self.heard = []

    def receive(self, data, time):
        self.heard.append((time, data))
        self.said.append((time + 1e-3, data))

    def due(self):
        return self.said[0][0] if self.said else math.inf

    def transmit(self, time):
        ready = b"".join(data for when, data in self.said if when <= time)
        self.said = [entry for entry in self.said if entry[0] > time]
        return ready


@pytest.fixture
def clock():
    return VirtualClock(5.0)


def test_a_write_occupies_the_line_and_not_the_clock(clock):
    parrot = Parrot()
    link = MemoryLink(parrot, clock, baud=100_000)
    link.write(bytes(10))
    link.write(bytes(20))
    assert clock.now() == 5.0
    assert [time for time, _ in parrot.heard] == pytest.approx([5.001, 5.003])


def test_a_read_waits_for_bytes_or_for_the_deadline(clock):
    link = MemoryLink(Parrot(), clock, baud=100_000)
    link.write(b"0123456789")
    assert link.read(100, 5.0015) == b""
    assert clock.now() == 5.0015
    assert link.read(4, 6.0) == b"0123"
    assert clock.now() == pytest.approx(5.002)
    assert link.read(100, 0.0) == b"456789"  # what waits is given even when the deadline is past
    assert clock.now() == pytest.approx(5.002)


def test_discard_forgets_what_has_arrived(clock):
    link = MemoryLink(Parrot(), clock, baud=100_000)
    link.write(b"0123456789")
    link.read(4, 6.0)
    link.write(b"ab")
    link.discard()
    assert link.read(100, 6.0) == b"ab"  # it was still on its way


def test_links_share_a_clock(clock):
    first, second = MemoryLink(Parrot(), clock), MemoryLink(Parrot(), clock)
    first.write(b"a")
    second.write(b"b")
    assert first.read(1, 5.5) == b"a"
    assert second.read(1, 0.0) == b"b"
    assert first.read(1, 5.5) == b""
    assert clock.now() == 5.5


def test_a_closed_link_is_lost_until_it_is_opened_anew(clock):
    link = MemoryLink(Parrot(), clock)
    link.close()
    link.close()
    with pytest.raises(LinkLostError, match="closed"):
        link.write(b"a")
    with pytest.raises(LinkLostError, match="closed"):
        link.read(1, 6.0)
    link.discard()
    link.reopen()
    link.write(b"a")
    assert link.read(1, 6.0) == b"a"


def test_a_lost_adapter_shows_when_it_happens_and_comes_back():
    bench = Bench()
    plan = FaultPlan(faults=(Fault(kind="usb_lost", start=1.0),))
    link = MemoryLink(FaultyLine(bench.line, plan), bench.clock, name="port")
    link.write(packet(1, PING))
    assert link.read(6, 0.5) == status(1)
    with pytest.raises(LinkLostError, match="port is gone"):
        link.read(6, 5.0)
    assert bench.clock.now() == 1.0
    with pytest.raises(LinkLostError):
        link.write(b"")
    with pytest.raises(LinkError, match="Plug"):
        link.reopen()
    bench.clock.sleep_until(1.7)
    link.reopen()
    link.write(packet(1, PING))
    assert link.read(6, 2.0) == status(1)


def test_an_adapter_that_is_back_needs_a_new_handle():
    bench = Bench()
    plan = FaultPlan(faults=(Fault(kind="usb_lost", start=1.0, end=2.0),))
    link = MemoryLink(FaultyLine(bench.line, plan), bench.clock)
    with pytest.raises(LinkLostError, match="gone"):
        link.read(6, 5.0)
    bench.clock.sleep_until(3.0)
    with pytest.raises(LinkLostError, match="reopen"):
        link.read(6, 5.0)
