"""A made-up room before an emulated LIDAR, a line in memory, and the driver at its host's end."""

from __future__ import annotations

import numpy as np

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.lidar import EmulatedLidar, LidarTimes
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.lidar import Lidar, LidarConfig

from ..board.bench import Unplugged

PERIOD = 0.02


class Room:
    """A `LidarSource`: another picture at every look, and what was seen is remembered."""

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)
        self.seen: list[tuple[float, np.ndarray]] = []
        self.still = False

    def scan(self, time):
        if self.still:
            return self.seen[-1][1]
        self.seen.append((time, self._random.integers(0, 5601, 682)))
        return self.seen[-1][1]


class Bench:
    """Everything together; `run` lets whole command periods pass."""

    def __init__(self, times=None, config=None):
        self.clock = VirtualClock()
        self.room = Room()
        self.lidar = EmulatedLidar(self.room, times or LidarTimes())
        self.link = Unplugged(MemoryLink(self.lidar, self.clock, 115200))
        self.driver = Lidar(self.link, self.clock, config or LidarConfig())

    def run(self, seconds):
        """The scans that were new, each with the time at which it was taken."""
        found = []
        for _ in range(round(seconds / PERIOD)):
            self.clock.sleep_until(self.clock.now() + PERIOD)
            self.driver.poll()
            scan = self.driver.take()
            if scan is not None:
                found.append((self.clock.now(), scan))
        return found
