"""``bluefoot emulator``: a bus of emulated servos on a pseudo-terminal."""

from __future__ import annotations

import signal
import time
from types import FrameType

from bluefoot_mpc.cli.emulator_arguments import EmulatorCommand, parse_ids
from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.emulation.device import Device
from bluefoot_mpc.io.emulation.faults import FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.emulation.servo_line import ServoLine

_LOOK_PERIOD = 0.5
"""s between looks at whether the line still works."""


def emulator(command: EmulatorCommand) -> Outcome:
    """Open the port; the outcome's `serve` keeps it until Ctrl-C.

    Raises:
        ConfigurationError: IDs, baud rate, faults or link are wrong.
        LinkError: the system has no pseudo-terminal left.
    """
    ids = parse_ids(command.ids)
    clock = MonotonicClock()
    device: Device = ServoLine(OwnShafts(len(ids)), ids, command.baud)
    if command.faults is not None:
        plan = FaultPlan.load(command.faults).on("servos")
        device = FaultyLine(device, plan, clock.now())
    line = PtyLine(device, baud=command.baud, link=command.link, clock=clock)
    example = f"bluefoot servo scan --port {line.port} --baud {command.baud} --ids {command.ids}"
    return Outcome(
        data={"port": line.port, "terminal": line.terminal, "baud": command.baud, "ids": ids,
              "physics": command.physics, "example": example},
        page=(
            f"{len(ids)} servos at {command.baud} bit/s on {line.port}",
            f"try: {example}",
            "Ctrl-C ends it",
        ),
        serve=lambda: _serve(line),
    )  # fmt: skip


def _serve(line: PtyLine) -> None:
    """Keep a line until Ctrl-C or SIGTERM.

    Raises:
        DeviceError: what is behind the line broke.
    """
    kept = signal.signal(signal.SIGTERM, _interrupt)
    try:
        while line.is_serving:
            time.sleep(_LOOK_PERIOD)
    except KeyboardInterrupt:
        return  # how it is meant to end
    finally:
        line.close()
        signal.signal(signal.SIGTERM, kept)
    raise DeviceError(f"the emulated servos broke: {line.error}")


def _interrupt(_: int, __: FrameType | None) -> None:
    raise KeyboardInterrupt
