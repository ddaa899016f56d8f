"""An emulated robot in real time: its process, the drivers on its terminals, and its truth."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from dataclasses import replace
from typing import Any

import orjson

from bluefoot_mpc.exceptions import ConfigurationError, DeviceError, LogError
from bluefoot_mpc.io.calibration import Calibration
from bluefoot_mpc.io.clock import MonotonicClock
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.codec import decode
from bluefoot_mpc.scenarios.config import Resolved
from bluefoot_mpc.scenarios.emulator_process import Order
from bluefoot_mpc.scenarios.hardware import live_robot
from bluefoot_mpc.scenarios.robots import RunRobot
from bluefoot_mpc.settings import to_table
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.types import TruthSample

_START = 30.0
"""s that the process may take until it tells its ports."""


class EmulatorProcess:
    """The process of an emulated robot, from the outside.

    Attributes:
        ports: what it told: ``servos``, ``board``, ``drawn``.
        report: what its devices saw of their driver; empty until `close`.

    Args:
        order: what is to be emulated.

    Raises:
        DeviceError: it did not start.
    """

    def __init__(self, order: Order) -> None:
        self.ports: dict[str, Any] = {}
        self.report: dict[str, Any] = {}
        self._newest: TruthSample | None = None
        self._ready = threading.Event()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "bluefoot_mpc.scenarios.emulator_process"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        )  # fmt: skip
        self._reader = threading.Thread(target=self._read, name="emulator truth", daemon=True)
        self._reader.start()
        if self._process.stdin is not None:
            self._process.stdin.write(order.line())
            self._process.stdin.flush()
        if not self._ready.wait(_START) or not self.ports:
            self.close()
            raise DeviceError("the emulator's process did not start; its message stands above")

    def truth(self) -> TruthSample:
        """The simulator's truth, some 5 ms old."""
        if self._newest is None:
            raise DeviceError("the emulator's process tells no truth")
        return self._newest

    @property
    def is_running(self) -> bool:
        """False once it has ended."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the process and take its report. Idempotent."""
        if self._process.stdin is not None and not self._process.stdin.closed:
            self._process.stdin.close()
        try:
            self._process.wait(timeout=5.0)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._reader.join(timeout=2.0)
        if self._process.stdout is not None:
            self._process.stdout.close()

    def _read(self) -> None:
        stream = self._process.stdout
        for line in stream if stream is not None else ():
            if self._newest is None and not self.ports:
                self.ports = orjson.loads(line)
            elif line.startswith(b'{"report"'):
                self.report = orjson.loads(line)["report"]
            else:
                self._take(line)
                self._ready.set()
        self._ready.set()

    def _take(self, line: bytes) -> None:
        try:
            self._newest = decode(TruthSample, line)
        except LogError:
            return  # the last line of a process that was killed


def start_emulator(resolved: Resolved, model: RobotModel, sitting: Posture, zero: float) -> EmulatorProcess:
    """Start the process of an emulated robot.

    Args:
        resolved: configuration with simulation and devices.
        model: the robot's model.
        sitting: how it lies at the start.
        zero: s on the machine's monotonic clock that count as zero.

    Raises:
        ConfigurationError: it is to have a camera.
        DeviceError: it did not start.
    """
    if resolved.stages.sim.camera.enabled:
        raise ConfigurationError(
            "an emulated robot that is reached through ports has no camera: its pictures have no port to"
            " come through. Leave --link pty out, or run without a camera (--set sim.camera.enabled=false)"
        )
    return EmulatorProcess(
        Order(
            model=to_table(model.parameters), sim=to_table(resolved.stages.sim),
            devices=to_table(resolved.stages.devices), seed=resolved.run.seed,
            joints=sitting.joints.tolist(), height=sitting.height, zero=zero,
        )
    )  # fmt: skip


def make_emulated_live(resolved: Resolved, model: RobotModel, sitting: Posture) -> RunRobot:
    """An emulated robot in real time, reached as a real one is.

    Args:
        resolved: the run's configuration.
        model: the robot's model.
        sitting: how it lies at the start, and sinks to by itself.
    """
    zero = time.monotonic()
    process = start_emulator(resolved, model, sitting, zero)
    config = replace(resolved.stages.devices, lidar_port=process.ports["lidar"] or "")
    try:
        robot = live_robot(
            config, Calibration.nominal(model.parameters), MonotonicClock(zero),
            process.ports["servos"], process.ports["board"],
            model=model.parameters.name, on_close=process.close,
        )  # fmt: skip
    except BaseException:
        process.close()
        raise
    return RunRobot(
        robot=robot, truth=process.truth, drawn=process.ports["drawn"],
        devices=lambda: {**process.report, "in_real_time": True},
    )  # fmt: skip
