"""Emulated servos with joints of their own, on lines in memory or on a pseudo-terminal."""

from __future__ import annotations

import contextlib

from bluefoot_mpc.io.clock import VirtualClock
from bluefoot_mpc.io.commissioning.ports import ServoPorts
from bluefoot_mpc.io.emulation.memory_link import MemoryLink
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.io.link import LinkError

ID, BAUD, RETURN_DELAY, CW_LIMIT, CCW_LIMIT, STATUS_LEVEL, SHUTDOWN = 3, 4, 5, 6, 8, 16, 18
TORQUE, LOCK = 24, 47


class Bench:
    """Servos 1 … n.

    Attributes:
        shafts: their joints.
        line: the servos.
        clock: of the ports in memory.
    """

    def __init__(self, count=16, configs=None, commissioned=True, baud=1_000_000):
        self.shafts = OwnShafts(configs or count)
        self.line = ServoLine(self.shafts, tuple(range(1, (len(configs) if configs else count) + 1)), baud)
        self.clock = VirtualClock()
        if commissioned:
            for servo in self.line.all:
                servo.write(RETURN_DELAY, 0)

    def ports(self, baud=1_000_000, **options):
        """The host's end in memory."""

        def opener(name, rate, clock):
            if rate == 400_000:
                raise LinkError("this adapter does not have 400000 bit/s")
            return MemoryLink(self.line, clock, rate, name)

        return ServoPorts(["memory"], baud, clock=self.clock, opener=opener, **options)

    @contextlib.contextmanager
    def pty(self):
        """The servos on a pseudo-terminal; gives its path."""
        with PtyLine(self.line) as pty:
            yield pty.port

    @property
    def limp(self):
        """Whether no servo has torque."""
        return not any(servo.read(TORQUE) for servo in self.line.all)

    def turn(self, index, degrees):
        """Turn a joint by hand, relative, as a person would."""
        angle = self.shafts.state(index).angle
        self.shafts.turn(index, angle + degrees * 3.141592653589793 / 180.0)
