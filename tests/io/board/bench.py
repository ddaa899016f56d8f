"""A made-up robot behind an emulated board, a line in memory, and the driver at its host's end."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.io.board import BoardConfig, SensorBoard
from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.board import BoardTimes, EmulatedBoard
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.link import LinkError, LinkLostError
from bluefoot_mpc.types import ImuBatch

PERIOD = 0.02
GRAVITY = (0.0, 0.0, 9.81)


class MadeUpRobot:
    """A `BoardSource`: noise on a robot at rest, and switches that trot when told to."""

    def __init__(self, trot: bool = False) -> None:
        self.time = 0.0
        self.powered = False
        self.volts = 11.4
        self.trot = trot
        self.changes: list[tuple[float, bool]] = []
        self.taken: list[ImuBatch] = []
        self._random = np.random.default_rng(3)
        self._sampled = 0

    def advance(self, time):
        self.time = max(self.time, time)

    def samples(self, since):
        last = int(self.time / 0.005 + 1e-6)
        numbers = np.arange(self._sampled + 1, last + 1)
        self._sampled = last
        count = len(numbers)
        field = self._random.normal(0.0, 0.01, (count, 3)) + np.array([0.4, 0.0, -0.9])
        field[numbers % 4 != 0] = np.nan
        batch = ImuBatch(
            time=numbers * 0.005,
            gyro=self._random.normal(0.0, 0.01, (count, 3)),
            accel=self._random.normal(0.0, 0.1, (count, 3)) + GRAVITY,
            magnetometer=field,
            valid=np.ones(count, dtype=bool),
        )
        self.taken.append(batch)
        return batch

    def switches(self):
        swing = self.trot and int(self.time / 0.3) % 2 == 1
        return np.array([swing, not swing, not swing, swing]), self.time

    def voltage(self):
        return self.volts

    def current(self):
        return 2.5

    def set_power(self, on):
        self.powered = on
        self.changes.append((self.time, on))


class Unplugged:
    """A link whose plug can be pulled, and whose bytes can be changed on the way in."""

    def __init__(self, link):
        self._link = link
        self.name, self.baud = link.name, link.baud
        self.out = False
        self.change = lambda data: data
        self.reopened = 0

    def _check(self):
        if self.out:
            raise LinkLostError("the plug is out")

    def write(self, data):
        self._check()
        self._link.write(data)

    def read(self, count, deadline):
        self._check()
        return self.change(self._link.read(count, deadline))

    def discard(self):
        self._link.discard()

    def reopen(self):
        if self.out:
            raise LinkError("no such port")
        self.reopened += 1
        self._link.reopen()

    def close(self):
        self._link.close()


class Bench:
    """Everything together; `run` lets whole command periods pass."""

    def __init__(self, trot=False, times=None, config=None):
        self.clock = VirtualClock()
        self.robot = MadeUpRobot(trot)
        self.board = EmulatedBoard(self.robot, times or BoardTimes(), seed=1)
        self.link = Unplugged(MemoryLink(self.board, self.clock, 115200))
        self.driver = SensorBoard(self.link, self.clock, config or BoardConfig())

    def run(self, seconds, beat=True):
        """The readings of each period."""
        found = []
        for _ in range(round(seconds / PERIOD)):
            self.clock.sleep_until(self.clock.now() + PERIOD)
            self.driver.poll()
            if beat:
                self.driver.beat()
            found.append(self.driver.take())
        return found

    def power_on(self):
        self.run(0.2)
        self.driver.power(True)
        return self.run(0.2)[-1]
