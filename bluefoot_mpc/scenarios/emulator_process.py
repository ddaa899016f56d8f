"""An emulated robot in a process of its own: its devices on pseudo-terminals, in real time.

Run as ``python -m bluefoot_mpc.scenarios.emulator_process``. Standard input
brings one line of JSON (`Order`); standard output tells the ports in one line,
then the simulator's truth, one sample a line, and at the end what the devices
saw. The process ends when its input does, so it never outlives who started it.
"""

from __future__ import annotations

import contextlib
import os
import signal
import sys
import threading
from contextlib import ExitStack
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import orjson

from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.servo_robot.config import DevicesConfig
from bluefoot_mpc.io.servo_robot.making import BOARD_BAUD, LIDAR_BAUD
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.codec import encode
from bluefoot_mpc.scenarios.emulated import emulate
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.sim.config import SimConfig

_BEAT = 0.005
"""s after which the physics go on though nobody looked, and the truth is told."""
_SWITCH = 0.0005
"""s that a thread of this process keeps the interpreter when another waits for it."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Order:
    """What is to be emulated: plain values.

    Attributes:
        model: the robot's parameters.
        sim: the simulation's configuration.
        devices: the devices' configuration.
        seed: of everything random.
        joints: 16, rad, how the robot lies.
        height: m, of the trunk's origin.
        zero: s on the machine's monotonic clock that count as zero.
    """

    model: dict[str, Any]
    sim: dict[str, Any]
    devices: dict[str, Any]
    seed: int
    joints: list[float]
    height: float
    zero: float

    def line(self) -> bytes:
        """The order as the process reads it."""
        return orjson.dumps(asdict(self)) + b"\n"


def serve(order: Order, until: threading.Event) -> None:
    """Emulate until the event is set; tells ports, truth and a report on standard output."""
    model = RobotModel(build(RobotParameters, order.model, "model"))
    posture = Posture(joints=np.array(order.joints), height=order.height)
    config = build(DevicesConfig, order.devices, "devices")
    robot = emulate(model, build(SimConfig, order.sim, "sim"), posture, order.seed, config)
    clock, lock = MonotonicClock(order.zero), threading.RLock()
    start = clock.now()
    robot.plant.begin(start)
    with ExitStack() as stack:
        servos = [
            stack.enter_context(PtyLine(device, config.baud, lock=lock, clock=clock))
            for device in robot.servo_devices(start)
        ]
        board = stack.enter_context(PtyLine(robot.board_device(start), BOARD_BAUD, lock=lock, clock=clock))
        lidar = robot.lidar_device(start)
        scanner = None
        if lidar is not None:
            scanner = stack.enter_context(PtyLine(lidar, LIDAR_BAUD, lock=lock, clock=clock)).port
        _tell({"servos": [line.port for line in servos], "board": board.port, "lidar": scanner,
               "drawn": robot.plant.drawn})  # fmt: skip
        while not until.wait(_BEAT):
            with lock:
                robot.plant.advance(clock.now())
                sample = robot.plant.truth()
            _write(encode(sample))
        with lock:
            _tell({"report": robot.report()})


def main() -> None:
    """Read the order, then serve until the input ends."""
    line = sys.stdin.buffer.readline()
    if not line:
        return
    # Ctrl-C on a terminal reaches every process on it; this one must stay until the robot is at rest.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.setswitchinterval(_SWITCH)
    ended = threading.Event()

    def wait() -> None:
        sys.stdin.buffer.read()
        ended.set()

    threading.Thread(target=wait, name="input", daemon=True).start()
    # Whoever started this process was killed: it ends without a word.
    with contextlib.suppress(BrokenPipeError):
        serve(Order(**orjson.loads(line)), ended)
        return
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _tell(value: dict[str, Any]) -> None:
    _write(orjson.dumps(value, option=orjson.OPT_SERIALIZE_NUMPY))


def _write(line: bytes) -> None:
    sys.stdout.buffer.write(line + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
