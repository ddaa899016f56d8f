"""The watchdog beside the robot's program: a process that switches torque off when the program dies or hangs.

``python -m bluefoot_mpc.io.safety.watchdog``, started by `WatchdogProcess`
(``watchdog_process.py``) and by nobody else. It imports nothing but the
standard library, so that it starts at once and nothing of ours can break it.

It hears heartbeats on a socket that it has inherited. The socket closed without
a farewell, or silent for too long after the first of them: it writes the bytes it was given at the start
to each port, three times, waits until a servo has forgotten a packet that was
cut off in the middle (more than 100 ms between bytes reset its parser), and
does so again. Ports that the program holds exclusively are written through the
descriptor that came with them; where that one is dead, the port is opened anew.

After that it stays as long as the program lives, and says so to every heartbeat
that still comes: a program that was only halted must not go on as if nothing had
happened.
"""

from __future__ import annotations

import argparse
import contextlib
import logging
import os
import select
import signal
import socket
import sys
import termios
import time
import tty
from dataclasses import dataclass

log = logging.getLogger("bluefoot.watchdog")

HEARTBEAT = b"h"
FAREWELL = b"e"
PORT = b"p"
"""Followed by the number of the port as one byte; its new descriptor comes with it, none where it is lost."""
READY = b"r"
FIRED = b"f"

REPEATS = 3
GAP = 0.005
"""s between two repeats; a torque-off packet takes 0.08 ms at 1 Mbit/s."""
PARSER_RESET = 0.12
"""s after which a servo has forgotten an unfinished packet (AX-12 user's manual: 100 ms)."""
RETRY = 3.0
"""s for which a port that cannot be written is tried again: USB comes back after about one."""
NORMAL, HAS_FIRED = 0, 4


@dataclass(slots=True)
class GuardedPort:
    """A port and what switches it off.

    Attributes:
        path: device file.
        baud: bit/s.
        payload: bytes that switch its devices off.
        descriptor: open descriptor of the port, -1 without one.
    """

    path: str
    baud: int
    payload: bytes
    descriptor: int = -1

    def take(self, descriptor: int) -> None:
        """Use another descriptor, -1 for none; an old one would keep a lost device's name in use."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
        self.descriptor = descriptor

    def write(self) -> bool:
        """Write the bytes once; True when the port has taken them."""
        if self.descriptor >= 0 and _written(self.descriptor, self.payload):
            return True
        opened = _opened(self.path, self.baud)
        if opened < 0:
            return False
        self.take(opened)
        return _written(opened, self.payload)


def switch_off(ports: list[GuardedPort]) -> bool:
    """Switch every port's devices off; True when every port has taken its bytes."""
    first = _rounds(ports)
    # A packet that broke off in the middle would have swallowed the first ones.
    time.sleep(PARSER_RESET)
    return _rounds(ports) and first


def _rounds(ports: list[GuardedPort]) -> bool:
    taken = True
    for repeat in range(REPEATS):
        if repeat:
            time.sleep(GAP)
        # Every port each time: one that hangs must not keep the others waiting.
        results = [port.write() for port in ports]
        taken = taken and all(results)
    return taken


def _written(descriptor: int, payload: bytes) -> bool:
    try:
        # A port whose buffer is full (nobody drains it) must not stop us.
        _, writable, _ = select.select([], [descriptor], [], 0.02)
        return bool(writable) and os.write(descriptor, payload) == len(payload)
    except (OSError, ValueError):
        return False


def _opened(path: str, baud: int) -> int:
    """A raw descriptor of the port, or -1."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return -1
    with contextlib.suppress(termios.error, OSError):
        tty.setraw(descriptor, termios.TCSANOW)
        speed = getattr(termios, f"B{baud}", None)
        if speed is not None:
            attributes = termios.tcgetattr(descriptor)
            attributes[4] = attributes[5] = speed
            attributes[2] |= termios.CLOCAL
            termios.tcsetattr(descriptor, termios.TCSANOW, attributes)
    return descriptor


class Watch:
    """Hears the program and acts when it falls silent.

    Args:
        channel: socket to the program.
        ports: what to switch off.
        timeout: s of silence.
    """

    def __init__(self, channel: socket.socket, ports: list[GuardedPort], timeout: float) -> None:
        self._channel, self._ports, self._timeout = channel, ports, timeout
        self._heard = self._fired = False

    def run(self) -> int:
        """Watch until the program ends; gives the exit status."""
        self._channel.send(READY)
        while True:
            wait = self._timeout if self._heard and not self._fired else None
            readable, _, _ = select.select([self._channel], [], [], wait)
            if not readable:
                self._fire(f"the robot's program was silent for {self._timeout:g} s")
                continue
            message, descriptors = self._receive()
            if message.startswith(FAREWELL):
                return HAS_FIRED if self._fired else NORMAL
            if not message:
                self._fire("the robot's program ended without a farewell")
                return HAS_FIRED
            self._heard = self._heard or message.startswith(HEARTBEAT)
            if message.startswith(PORT) and len(message) == 2:
                self._ports[message[1]].take(descriptors[0] if descriptors else -1)
            if self._fired:
                self._insist()

    def _receive(self) -> tuple[bytes, list[int]]:
        try:
            message, descriptors, _, _ = socket.recv_fds(self._channel, 16, 1)
        except OSError:
            return b"", []
        return message, descriptors

    def _fire(self, why: str) -> None:
        self._fired = True
        log.error("%s: torque is switched off", why)
        # Waits for the program where that one is halted: the first thing that it hears.
        self._tell()
        end = time.monotonic() + RETRY
        while not switch_off(self._ports):
            if time.monotonic() > end:
                names = ", ".join(port.path for port in self._ports)
                log.error(
                    "not every port could be written (%s). Switch the servos' supply off by hand", names
                )
                return

    def _insist(self) -> None:
        """The program is back: whatever it has written meanwhile, torque stays off, and it is told."""
        _rounds(self._ports)
        self._tell()

    def _tell(self) -> None:
        with contextlib.suppress(OSError):
            self._channel.send(FIRED, socket.MSG_DONTWAIT)


def _port(text: str) -> GuardedPort:
    path, baud, descriptor, payload = text.rsplit(",", 3)
    return GuardedPort(path=path, baud=int(baud), descriptor=int(descriptor), payload=bytes.fromhex(payload))


def main(arguments: list[str] | None = None) -> int:
    """Watch the program that has started this process."""
    parser = argparse.ArgumentParser(
        description="Switches torque off when the robot's program dies or hangs."
    )
    parser.add_argument("--channel", type=int, required=True, help="descriptor of the socket to the program")
    parser.add_argument("--timeout", type=float, default=0.5, help="s of silence that are too long")
    parser.add_argument("--port", type=_port, action="append", default=[], help="PATH,BAUD,DESCRIPTOR,HEX")
    options = parser.parse_args(arguments)
    logging.basicConfig(format="bluefoot watchdog: %(message)s")
    # Nobody may be there any more to read what is said.
    logging.raiseExceptions = False
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGPIPE, signal.SIGQUIT):
        signal.signal(number, signal.SIG_IGN)
    for port in options.port:
        if port.descriptor >= 0:
            # Shared with the program's own descriptor, which waits by itself: never made non-blocking here.
            os.set_inheritable(port.descriptor, False)
    channel = socket.socket(fileno=options.channel)
    return Watch(channel, options.port, options.timeout).run()


if __name__ == "__main__":
    sys.exit(main())
