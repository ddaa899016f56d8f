"""One run of a validation, reduced to figures; on an emulator, with what its devices saw."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.control.pipeline import ControlOutput, Pipeline
from bluefoot_mpc.evaluation.cases import Case
from bluefoot_mpc.evaluation.measure import PHASE_STEP, Figures
from bluefoot_mpc.evaluation.validation_scenarios import SCENARIOS, ControlledStop, EmergencyStop
from bluefoot_mpc.io.dynamixel.codec import Instruction
from bluefoot_mpc.io.safety import SafetySupervisor
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import COMPLETED, RunData
from bluefoot_mpc.runtime.loop import INTERRUPTED, LoopHooks, run_loop
from bluefoot_mpc.runtime.summary import fell, summarize
from bluefoot_mpc.runtime.window import SETTLING
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import Resolved, resolve
from bluefoot_mpc.scenarios.robots import RunRobot, make_robot
from bluefoot_mpc.scenarios.runner import sitting, supervise
from bluefoot_mpc.types import Mode, SensorFrame, TruthSample

_MOVING = (Instruction.SYNC_WRITE, Instruction.REG_WRITE, Instruction.ACTION)
"""Instructions with which the driver moves servos."""


def measure_validation(case: Case, seed: int) -> Figures:
    """Run one seed of a case of a validation and give its figures.

    Raises:
        KeyboardInterrupt: somebody stopped the run; it tells nothing of the configuration.
    """
    with _quiet():
        run = _Run(resolve(SCENARIOS[case.scenario], run_options(case, seed)))
        data = run.drive()
    if data.stop_reason == INTERRUPTED:
        raise KeyboardInterrupt
    return run.figures(data)


def run_options(case: Case, seed: int) -> RunOptions:
    """Options of one run: its seed, and its event (a push, a stop) at another part of the cycle."""
    options = dict(case.options, config=Path(str(case.options["config"])))
    shift = PHASE_STEP * seed
    if case.scenario == "push":
        options |= {"push_time": options["push_time"] + shift, "duration": options["duration"] + shift}
    elif case.scenario in (ControlledStop.name, EmergencyStop.name):
        options |= {"duration": options["duration"] + shift}
    return RunOptions(**options, seed=seed)


@contextmanager
def _quiet() -> Iterator[None]:
    """Figures tell what happened: a hundred runs need not warn of the stops that they are there for."""
    package = logging.getLogger("bluefoot_mpc")
    before = package.level
    package.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        package.setLevel(before)


@dataclass(slots=True)
class _Cut:
    """The emergency stop of a run: when (s), how long it took (ms), goals sent until then."""

    time: float = math.inf
    took_ms: float | None = None
    goals: int = 0


class _Run:
    """A run whose robot can be looked at afterwards."""

    def __init__(self, resolved: Resolved) -> None:
        self._resolved = resolved
        self._model = RobotModel(resolved.parameters)
        self._pipeline = Pipeline(self._model, resolved.stages.control, resolved.command_period)
        self._on: RunRobot = make_robot(resolved, self._model, sitting(self._pipeline, self._model))
        self._supervisor: SafetySupervisor | None = None
        self._cut = _Cut()
        self._goals_at_end = 0
        self._devices: dict[str, Any] = {}

    def drive(self) -> RunData:
        """The run; whatever happens, the robot is closed."""
        scenario, on = self._resolved.scenario, self._on
        is_emergency = isinstance(scenario, EmergencyStop)
        # A simulated robot is brought to rest as well: that is what a controlled stop is.
        rests = on.rests or isinstance(scenario, ControlledStop)
        source = scenario.command if is_emergency else scenario.source
        try:
            self._supervisor = supervise(on.robot, self._model, self._resolved)
            hooks = LoopHooks(
                truth=on.truth, rests=rests, observers=(self._cutting(),) if is_emergency else ()
            )
            data = run_loop(self._supervisor, self._pipeline, source, hooks, self._resolved.table())
            self._goals_at_end = self._goals()
            self._devices = on.devices() if on.devices is not None else {}
        finally:
            on.robot.close()
        return data

    def figures(self, data: RunData) -> Figures:
        """The figures of a run that ended."""
        scenario = self._resolved.scenario
        figures: Figures = {"torque_left": self._torque_left(data), **self._seen_by_devices()}
        if isinstance(scenario, EmergencyStop):
            after = self._goals_at_end - self._cut.goals
            return {**figures, "emergency_ms": self._cut.took_ms, "goals_after": float(after)}
        end = scenario.config.duration
        ended = data.frames[0].time + end if data.frames else 0.0
        figures |= _motion(data, self._model, ended)
        if isinstance(scenario, ControlledStop):
            figures |= _rest(data, ended)
        return figures

    def _cutting(self) -> Callable[[SensorFrame, ControlOutput, TruthSample | None], None]:
        """An observer that pulls the emergency stop when the time has come, and sees when torque is gone."""
        began: list[float] = []

        def observe(frame: SensorFrame, output: ControlOutput, truth: TruthSample | None) -> None:
            began.append(frame.time)
            cut, since = self._cut, frame.time - began[0]
            if cut.time == math.inf and since >= self._resolved.scenario.config.duration:
                cut.time = frame.time
                if self._supervisor is not None:
                    self._supervisor.emergency("validation")
                cut.goals = self._goals()
                if self._on.parts is not None and self._on.truth is not None:
                    # On the bus's own clock, the check that torque is off included.
                    is_off = not _torque_on(self._on.parts.report())
                    cut.took_ms = 1e3 * (self._on.truth().time - cut.time) if is_off else None
            if cut.took_ms is None and frame.time > cut.time and truth is not None and not truth.duty.any():
                cut.took_ms = 1e3 * (frame.time - cut.time)

        return observe

    def _goals(self) -> int:
        """Instructions that move servos, sent until now."""
        parts = self._on.parts
        if parts is None:
            return 0
        return sum(line.requests[kind] for line in parts.lines for kind in _MOVING)

    def _torque_left(self, data: RunData) -> float | None:
        """Servos that have torque at the end."""
        if self._devices:
            return float(_torque_on(self._devices))
        if not isinstance(self._resolved.scenario, (ControlledStop, EmergencyStop)) or not data.commands:
            return None  # a simulation simply ends
        return float(np.count_nonzero(data.commands[-1].joints.torque_limit))

    def _seen_by_devices(self) -> Figures:
        devices = self._devices
        if not devices:
            return {}
        return {
            "protocol_violations": float(sum(devices["protocol_violations"].values())),
            "eeprom_writes": float(devices["eeprom_writes"]),
            "goal_writes_while_off": float(devices["goal_writes_while_off"]),
        }


def _torque_on(report: dict[str, Any]) -> int:
    """Servos with torque, by the report of emulated devices; none without the servos' supply."""
    return len(report["torque_on"]) if report["power_on"] else 0


def _motion(data: RunData, model: RobotModel, ended: float) -> Figures:
    """Falls, attitude and speed up to the end of the commands (s).

    Measured is from when the robot, which may have had to get up first, does what
    it was told, and has had `SETTLING` and the time to get up to its speed.
    """
    walked = any(record.mode is Mode.WALK for record in data.telemetry)
    wanted = Mode.WALK if walked else Mode.STAND
    started = next((record.time for record in data.telemetry if record.mode is wanted), ended)
    if not walked:
        started = 0.5 * (data.frames[0].time + ended)
    summary = summarize(data, model, window=(started + SETTLING, ended))
    speed, seen, distance = summary["speed_ref_mps"], summary["speed_mps"], summary["distance_m"]
    moving = walked and bool(speed) and seen is not None
    return {
        "falls": float(fell(data) or data.stop_reason != COMPLETED),
        "roll_rms_deg": summary["roll_rms_deg"],
        "pitch_rms_deg": summary["pitch_rms_deg"],
        "speed_mmps": 1e3 * seen if moving else None,
        "speed_error_percent": 100.0 * abs(seen - speed) / speed if moving else None,
        "drift_percent": 100.0 * abs(summary["lateral_drift_m"] / distance) if moving and distance else None,
        "qp_failures": summary["qp_failures"],
        "deadline_misses": summary["deadline_misses"],
    }


def _rest(data: RunData, ended: float) -> Figures:
    """From the end of the commands (s) to no torque: how long, and the greatest tilt on the way."""
    time = data.stack("truth", "time")
    tilt = np.degrees(metrics.tilt(data.stack("truth", "q")[:, 3:7]))
    limp = [r.time for r in data.commands if r.time >= ended and not r.joints.torque_limit.any()]
    after = time >= ended
    return {
        "rest_s": limp[0] - ended if limp else None,
        "rest_tilt_deg": float(tilt[after].max()) if after.any() else None,
    }
