"""``bluefoot emulator``: emulated servos, or the whole robot, on pseudo-terminals."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from types import FrameType

from bluefoot_mpc.cli.emulator_arguments import EmulatorCommand, parse_ids
from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.exceptions import DeviceError
from bluefoot_mpc.io.calibration import Calibration, save_calibration
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.io.emulation.device import Device
from bluefoot_mpc.io.emulation.faults import FaultPlan
from bluefoot_mpc.io.emulation.faults_line import FaultyLine
from bluefoot_mpc.io.emulation.own_shafts import OwnShafts
from bluefoot_mpc.io.emulation.pty_line import PtyLine
from bluefoot_mpc.io.emulation.servo_line import ServoLine
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import resolve
from bluefoot_mpc.scenarios.emulated_live import start_emulator
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.runner import sitting

_LOOK_PERIOD = 0.5
"""s between looks at whether the line still works."""


def emulator(command: EmulatorCommand) -> Outcome:
    """Open the port; the outcome's `serve` keeps it until Ctrl-C.

    Raises:
        ConfigurationError: IDs, baud rate, faults or link are wrong.
        LinkError: the system has no pseudo-terminal left.
    """
    if command.physics == "robot":
        return _robot(command)
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


def _robot(command: EmulatorCommand) -> Outcome:
    """The whole robot, its servos' shafts being MuJoCo's joints."""
    options = RunOptions(
        robot="emulator", link="pty",
        overrides=(f"devices.baud={command.baud}", f"devices.faults={str(command.faults or '')!r}"),
    )  # fmt: skip
    resolved = resolve(find_scenario("stand"), options)
    model = RobotModel(resolved.parameters)
    if command.calibration is not None:
        save_calibration(Calibration.nominal(model.parameters), command.calibration)
    pipeline = Pipeline(model, resolved.stages.control, resolved.command_period)
    process = start_emulator(resolved, model, sitting(pipeline, model), time.monotonic())
    servos, board = process.ports["servos"], process.ports["board"]
    ports = " ".join(f"--port {port}" for port in servos)
    calibration = command.calibration or "calibration.toml"
    example = (
        f"bluefoot run walk --robot hardware {ports} --set devices.board_port={board}"
        f" --set devices.calibration={calibration}"
    )
    return Outcome(
        data={"servos": servos, "board": board, "baud": command.baud, "physics": command.physics,
              "example": example},
        page=(
            f"the robot's servos on {', '.join(servos)}, its sensor board on {board}",
            f"try: {example}",
            "Ctrl-C ends it",
        ),
        serve=lambda: _keep(lambda: process.is_running, process.close, "the emulator's process has ended"),
    )  # fmt: skip


def _serve(line: PtyLine) -> None:
    """Keep a line until Ctrl-C or SIGTERM.

    Raises:
        DeviceError: what is behind the line broke.
    """
    _keep(lambda: line.is_serving, line.close, f"the emulated servos broke: {line.error}")


def _keep(works: Callable[[], bool], close: Callable[[], None], broken: str) -> None:
    kept = signal.signal(signal.SIGTERM, _interrupt)
    try:
        while works():
            time.sleep(_LOOK_PERIOD)
    except KeyboardInterrupt:
        return  # how it is meant to end
    finally:
        close()
        signal.signal(signal.SIGTERM, kept)
    raise DeviceError(broken)


def _interrupt(_: int, __: FrameType | None) -> None:
    raise KeyboardInterrupt
