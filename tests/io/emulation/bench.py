"""A bench of emulated servos, and packets written out by hand, independent of the driver's codec."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.emulation.shafts import ShaftDrive, ShaftState

PING, READ, WRITE, REG_WRITE, ACTION, RESET, SYNC_WRITE = 1, 2, 3, 4, 5, 6, 0x83
ALL = 254


@dataclass
class StillShafts:
    """Joints that stand where a test puts them, and keep what they were told."""

    count: int
    angle: float = 0.0
    speed: float = 0.0
    load: float = 0.0
    temperature: float = 25.0
    voltage: float = 12.0
    drives: dict[int, ShaftDrive] = field(default_factory=dict)
    time: float = -math.inf

    def advance(self, time: float) -> None:
        assert time >= self.time or time <= self.time  # a number
        self.time = max(self.time, time)

    def drive(self, index: int, drive: ShaftDrive) -> None:
        self.drives[index] = drive

    def state(self, index: int) -> ShaftState:
        return ShaftState(
            angle=self.angle, speed=self.speed, load=self.load, temperature=self.temperature,
            voltage=self.voltage,
        )  # fmt: skip


def packet(identity: int, instruction: int, *parameters: int) -> bytes:
    body = bytes((identity, len(parameters) + 2, instruction, *parameters))
    return b"\xff\xff" + body + bytes((~sum(body) & 0xFF,))


def status(identity: int, error: int = 0, *parameters: int) -> bytes:
    return packet(identity, error, *parameters)


class Bench:
    """Servos 1, 2, … on a line in memory.

    Attributes:
        shafts: their joints.
        line: the servos.
        link: the host's end.
        clock: of all.
    """

    def __init__(self, count: int = 3, **options: float) -> None:
        self.shafts = StillShafts(count, **options)
        self.line = ServoLine(self.shafts, range(1, count + 1))
        self.clock = VirtualClock()
        self.link = MemoryLink(self.line, self.clock)

    def __getitem__(self, identity: int):
        return self.line.servos[identity]

    def ask(self, identity: int, instruction: int, *parameters: int) -> bytes:
        """Send an instruction; the reply within 20 ms, or nothing."""
        return self.send(packet(identity, instruction, *parameters))

    def send(self, data: bytes) -> bytes:
        """Send bytes; the reply within 20 ms, or nothing."""
        self.link.write(data)
        return self.link.read(200, self.clock.now() + 0.02)

    def wait(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)


def low_high(value: int) -> tuple[int, int]:
    return value & 255, value >> 8
