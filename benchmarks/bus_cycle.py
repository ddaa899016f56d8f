"""Time on the bus and of the processor for one cycle of sixteen servos, and what faults cost.

    OMP_NUM_THREADS=1 python benchmarks/bus_cycle.py [--cycles 2000] [--fuzz 1000000] [--json]

Emulated AX-12A on a line in memory at 1 Mbit/s, return delay 0. Bus time is
that of the virtual clock: exact, the same on every machine. Processor time is
that of driver and emulator together, and of the driver alone: the same
cycle against a link that answers from a table.
"""

from __future__ import annotations

import argparse
import json
import random
import time

import numpy as np

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.dynamixel.bus import ServoBus
from bluefoot_mpc.io.dynamixel.codec import Problem, ProblemKind, StatusParser, status_packet
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.servo_line import ServoLine

PERIOD = 0.02
BUDGET = 0.015
LAYOUT = ServoLayout()
SPEED, LIMIT = np.full(16, 200.0), np.full(16, 500.0)


class LossyLink(MemoryLink):
    """An emulated line of which a test drops replies: `lost` is asked with each, with its servo's ID."""

    lost = staticmethod(lambda servo: False)

    def read(self, count, deadline):
        while (data := super().read(count, deadline)) and self.lost(data[2]):
            pass
        return data


class TableLink:
    """A link that answers every read at once from a table: what is left is the driver."""

    name, baud = "table", 1_000_000

    def __init__(self, clock):
        self._clock, self._reply, self._replies = clock, b"", {}

    def write(self, data):
        if data[4] == 2:
            reply = self._replies.get(data)
            if reply is None:
                reply = self._replies[data] = status_packet(data[2], 0, bytes(data[6]))
            self._reply = reply

    def read(self, count, deadline):
        reply, self._reply = self._reply, b""
        return reply

    def discard(self):
        self._reply = b""


def robot(make_link):
    """A cycle with armed servos, its clock and its link."""
    clock = VirtualClock()
    line = ServoLine(OwnShafts(16), LAYOUT.ids)
    for servo in line.all:
        servo.write(5, 0)  # return delay
        servo.write(24, 1)
        servo.write(34, 500, 2)
    link = make_link(line, clock)
    cycle = BusCycle([ServoBus(link, clock)], LAYOUT, clock)
    cycle.admit()
    goal = np.full(16, 512.0)
    for _ in range(5):  # limits have been sent and repeated
        begun = clock.now()
        cycle.write(goal, SPEED, LIMIT)
        cycle.read(begun + BUDGET)
        clock.sleep_until(begun + PERIOD)
    return cycle, clock, link


def run(cycle, clock, cycles, paced=True):
    """(n, 2): bus time (ms) and processor time (µs) of each cycle; and the share of fresh readings."""
    goal = np.full(16, 512.0)
    times, fresh = np.zeros((cycles, 2)), 0
    for turn in range(cycles):
        goal[:] = 512.0 + 20.0 * np.sin(0.1 * turn + np.arange(16.0))
        begun, started = clock.now(), time.thread_time()
        cycle.write(np.rint(goal), SPEED, LIMIT)
        fresh += int(cycle.read(begun + BUDGET).fresh.sum())
        times[turn] = 1e3 * (clock.now() - begun), 1e6 * (time.thread_time() - started)
        if paced:
            clock.sleep_until(begun + PERIOD)
    return times, fresh / (16 * cycles)


def processor(times):
    return {"median_us": float(np.median(times[:, 1])), "p99_us": float(np.percentile(times[:, 1], 99))}


def lost_reply():
    """ms that one lost reply of each servo in turn costs, worst and median."""
    cycle, clock, link = robot(LossyLink)
    usual = run(cycle, clock, 20)[0][:, 0].max()
    costs = []
    for servo in LAYOUT.ids:
        pending = [servo]
        link.lost = lambda replying, pending=pending: bool(
            pending and pending[0] == replying and pending.pop()
        )
        times, fresh = run(cycle, clock, 1)
        costs.append(times[0, 0] - usual)
        if fresh < 1.0:
            raise SystemExit(f"servo {servo} was not read again in the same cycle")
        run(cycle, clock, 20)
    return {"worst_ms": max(costs), "median_ms": float(np.median(costs))}


def dead_servo(cycles):
    """Cycles per second flat out with one servo that never answers."""
    cycle, clock, link = robot(LossyLink)
    link.lost = lambda servo: servo == 7
    first = run(cycle, clock, 10)[0][:, 0]
    begun = clock.now()
    times, fresh = run(cycle, clock, cycles, paced=False)
    return {
        "first_cycles_worst_ms": float(first.max()),
        "cycles_per_s": cycles / (clock.now() - begun),
        "worst_ms": float(times[:, 0].max()),
        "fresh": fresh,
    }


def random_loss(cycles, share):
    cycle, clock, link = robot(LossyLink)
    rng = random.Random(1)
    link.lost = lambda servo: rng.random() < share
    times, fresh = run(cycle, clock, cycles)
    return {"median_ms": float(np.median(times[:, 0])), "worst_ms": float(times[:, 0].max()), "fresh": fresh}


MANY_HEADERS = bytes(0xFF if value < 100 else value % 8 for value in range(256))


def random_stream(rng):
    """Up to 64 bytes: noise, half of it rich in headers, mostly with a packet inside, often a spoilt one."""
    noise = rng.randbytes(rng.randrange(65))
    if rng.random() < 0.5:
        noise = noise.translate(MANY_HEADERS)
    if rng.random() < 0.7:
        inside = bytearray(
            status_packet(rng.randrange(254), rng.randrange(128), rng.randbytes(rng.randrange(9)))
        )
        if rng.random() < 0.5:
            inside[rng.randrange(len(inside))] ^= 1 << rng.randrange(8)
        cut = rng.randrange(len(noise) + 1)
        noise = noise[:cut] + inside + noise[cut:]
    return noise[:64]


def fuzz(streams):
    """Random streams in two pieces: wrong are those of which a byte is lost, or a bad checksum is taken."""
    rng = random.Random(2)
    begun, accepted, wrong = time.perf_counter(), 0, 0
    for _ in range(streams):
        stream = random_stream(rng)
        parser, rebuilt = StatusParser(), b""
        cut = rng.randrange(len(stream) + 1)
        for item in [*parser.feed(stream[:cut]), *parser.feed(stream[cut:]), *parser.flush()]:
            if not isinstance(item, Problem):
                accepted += 1
                rebuilt += status_packet(item.id, item.error, item.parameters)
            elif item.kind is ProblemKind.GARBAGE:
                rebuilt += item.data
        # Packets are built anew with a right checksum: equal bytes mean that each was right as it came.
        wrong += rebuilt != stream
    return {
        "streams": streams,
        "packets": accepted,
        "wrong": wrong,
        "seconds": time.perf_counter() - begun,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cycles", type=int, default=2000)
    parser.add_argument("--fuzz", type=int, default=1_000_000)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    with_emulator = run(*robot(MemoryLink)[:2], options.cycles)[0]
    alone = run(*robot(lambda line, clock: TableLink(clock))[:2], options.cycles)[0]
    figures = {
        "bus_ms": float(np.median(with_emulator[:, 0])),
        "bus_worst_ms": float(with_emulator[:, 0].max()),
        "driver": processor(alone),
        "driver_and_emulator": processor(with_emulator),
        "lost_reply": lost_reply(),
        "dead_servo": dead_servo(options.cycles),
        "ten_percent_lost": random_loss(options.cycles, 0.1),
        "fuzz": fuzz(options.fuzz),
    }
    if options.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        parts = value.items() if isinstance(value, dict) else [("", value)]
        print(f"{name:22s}" + "  ".join(f"{part} {number:.4g}" for part, number in parts))


if __name__ == "__main__":
    main()
