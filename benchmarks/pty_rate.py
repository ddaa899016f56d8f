"""Cycles per second on a pseudo-terminal: the bus cycle against a bare loop of write and read.

    OMP_NUM_THREADS=1 python benchmarks/pty_rate.py [--cycles 300] [--blocks 10] [--json]

Emulated AX-12A serve the terminal from another process, at 1 Mbit/s in real
time. Both clients send the same bytes in the same order on the same open port,
flat out, and take turns in blocks, so that both meet the same load of the
machine. The bare one checks nothing and recovers from nothing: it is the most
that Python can do here.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import select
import statistics
import time

import numpy as np

from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.dynamixel.bus import BusConfig, ServoBus
from bluefoot_mpc.io.dynamixel.codec import read_packet, sync_write_packet
from bluefoot_mpc.io.dynamixel.cycle import BusCycle
from bluefoot_mpc.io.dynamixel.layout import ServoLayout
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.serial_link import SerialLink

LAYOUT = ServoLayout()
GOAL, SPEED, LIMIT = np.full(16, 512.0), np.full(16, 200.0), np.full(16, 500.0)


def serve(connection):
    """The other process: servos on a terminal until told to end."""
    line = ServoLine(OwnShafts(16), LAYOUT.ids)
    for servo in line.all:
        servo.write(5, 0)  # return delay
        servo.write(24, 1)
        servo.write(34, 500, 2)
    with PtyLine(line) as terminal:
        connection.send(terminal.port)
        connection.recv()


class Bare:
    """Write and read, nothing else."""

    def __init__(self, file):
        self._file = file
        servos = {servo: bytes((0, 2, 200, 0)) for servo in LAYOUT.ids}
        self._write = sync_write_packet(30, servos)
        self._positions = [read_packet(servo, 36, 2) for servo in LAYOUT.ids]
        self._full = [read_packet(servo, 36, 8) for servo in LAYOUT.ids]
        self._turn = 0

    def cycle(self):
        os.write(self._file, self._write)
        for request in self._positions:
            self._ask(request, 8)
        self._ask(self._full[self._turn % 16], 14)
        self._turn += 1

    def _ask(self, request, size):
        os.write(self._file, request)
        while size > 0:
            ready, _, _ = select.select((self._file,), (), (), 1.0)
            if not ready:
                raise SystemExit("a reply was lost: the bare loop ends")
            size -= len(os.read(self._file, size))


class Driver:
    """The bus cycle, without a deadline that would cut it off."""

    def __init__(self, link, clock):
        # A busy machine delays the emulator's process: wait longer than on a real line.
        self.bus = ServoBus(link, clock, BusConfig(margin=0.02))
        self._clock = clock
        self._cycle = BusCycle([self.bus], LAYOUT, clock)
        self._cycle.admit()
        self.fresh = 0

    def cycle(self):
        self._cycle.write(GOAL, SPEED, LIMIT)
        self.fresh += int(self._cycle.read(self._clock.now() + 1.0).fresh.sum())


def rate(client, cycles):
    """Cycles per second."""
    begun = time.perf_counter()
    for _ in range(cycles):
        client.cycle()
    return cycles / (time.perf_counter() - begun)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cycles", type=int, default=300, help="of one block")
    parser.add_argument("--blocks", type=int, default=10)
    parser.add_argument("--json", action="store_true")
    options = parser.parse_args()
    here, there = multiprocessing.Pipe()
    other = multiprocessing.Process(target=serve, args=(there,), daemon=True)
    other.start()
    clock = MonotonicClock()
    link = SerialLink(here.recv(), 1_000_000, clock)
    driver, bare = Driver(link, clock), Bare(link.fileno())
    rate(driver, 20)
    rate(bare, 20)
    driver.fresh = 0
    rates = np.array(
        [(rate(driver, options.cycles), rate(bare, options.cycles)) for _ in range(options.blocks)]
    )
    here.send("end")
    other.join(timeout=5.0)
    link.close()
    figures = {
        "driver_hz": statistics.median(rates[:, 0].tolist()),
        "bare_hz": statistics.median(rates[:, 1].tolist()),
        "ratio": statistics.median((rates[:, 0] / rates[:, 1]).tolist()),
        "fresh": driver.fresh / (16 * options.cycles * options.blocks),
        "retries": driver.bus.statistics.total.retries,
    }
    if options.json:
        print(json.dumps(figures))
        return
    for name, value in figures.items():
        print(f"{name:12s}{value:.4g}")


if __name__ == "__main__":
    main()
