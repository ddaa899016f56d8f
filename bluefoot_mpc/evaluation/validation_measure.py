"""One run of a validation, reduced to figures; on an emulator, with what its devices saw."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
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
from bluefoot_mpc.runtime.loop import INTERRUPTED, LoopHooks, Observer, run_loop
from bluefoot_mpc.runtime.summary import fell, summarize
from bluefoot_mpc.runtime.window import SETTLING
from bluefoot_mpc.scenarios import RunOptions
from bluefoot_mpc.scenarios.config import Resolved, resolve
from bluefoot_mpc.scenarios.robots import RunRobot, make_robot
from bluefoot_mpc.scenarios.runner import sitting, supervise
from bluefoot_mpc.types import N_JOINTS, JointCommand, Mode, SensorFrame, TruthSample

_MOVING = (Instruction.SYNC_WRITE, Instruction.REG_WRITE, Instruction.ACTION)
"""Instructions with which the driver moves servos."""
_GOES_ON = 0.5
"""s before the end of its run at which the emergency stop is pulled."""
_ASKED = 10
"""Control periods in which torque is still asked for after it."""


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
    """The emergency stop of a run.

    Attributes:
        was_pulled: True once it was.
        took_ms: until every torque was off; None where one stayed on.
        goals: instructions that move servos, sent afterwards.
        torque_left: servos with torque a little later, though a controller went on asking for it.
    """

    was_pulled: bool = False
    took_ms: float | None = None
    goals: int = 0
    torque_left: int | None = None


class _Run:
    """A run whose robot can be looked at afterwards."""

    def __init__(self, resolved: Resolved) -> None:
        self._resolved = resolved
        self._model = RobotModel(resolved.parameters)
        self._pipeline = Pipeline(self._model, resolved.stages.control, resolved.command_period)
        self._on: RunRobot = make_robot(resolved, self._model, sitting(self._pipeline, self._model))
        self._cut = _Cut()
        self._devices: dict[str, Any] = {}

    def drive(self) -> RunData:
        """The run; whatever happens, the robot is closed."""
        scenario, on = self._resolved.scenario, self._on
        is_emergency = isinstance(scenario, EmergencyStop)
        # A simulated robot is brought to rest as well: that is what a controlled stop is.
        rests = (on.rests and not is_emergency) or isinstance(scenario, ControlledStop)
        try:
            supervisor = supervise(on.robot, self._model, self._resolved)
            observers = (self._cutting(supervisor),) if is_emergency else ()
            hooks = LoopHooks(truth=on.truth, rests=rests, observers=observers)
            data = run_loop(supervisor, self._pipeline, scenario.source, hooks, self._resolved.table())
            self._devices = on.devices() if on.devices is not None else {}
        finally:
            on.robot.close()
        return data

    def figures(self, data: RunData) -> Figures:
        """The figures of a run that ended."""
        scenario = self._resolved.scenario
        figures: Figures = {"torque_left": self._torque_left(data), **self._seen_by_devices()}
        if isinstance(scenario, EmergencyStop):
            return {**figures, "emergency_ms": self._cut.took_ms, "goals_after": float(self._cut.goals)}
        end = scenario.config.duration
        ended = data.frames[0].time + end if data.frames else 0.0
        figures |= _motion(data, self._model, ended)
        if isinstance(scenario, ControlledStop):
            figures |= _rest(data, ended)
        return figures

    def _cutting(self, supervisor: SafetySupervisor) -> Observer:
        """An observer that pulls the emergency stop when the time has come, and sees what it did."""
        began: list[float] = []
        at = self._resolved.scenario.config.duration - _GOES_ON

        def observe(frame: SensorFrame, output: ControlOutput, truth: TruthSample | None) -> None:
            began.append(frame.time)
            if not self._cut.was_pulled and frame.time - began[0] >= at:
                self._pull(supervisor, frame, output.command)

        return observe

    def _pull(self, supervisor: SafetySupervisor, frame: SensorFrame, command: JointCommand) -> None:
        """Pull the emergency stop, and go on asking for torque as a controller that was not told would."""
        cut, on = self._cut, self._on
        cut.was_pulled = True
        supervisor.emergency("validation")
        before = self._goals()
        if on.parts is not None and on.truth is not None and not _torque_on(on.parts.report()):
            # On the bus's own clock, the check that torque is off included.
            cut.took_ms = 1e3 * (on.truth().time - frame.time)
        asked = replace(command, torque_limit=np.ones(N_JOINTS))
        for _ in range(_ASKED):
            now = supervisor.step(asked).time
            if on.truth is not None:
                left = np.count_nonzero(on.truth().duty)
                cut.torque_left = int(left)
                if not left and cut.took_ms is None:
                    cut.took_ms = 1e3 * (now - frame.time)
        cut.goals = self._goals() - before

    def _goals(self) -> int:
        """Instructions that move servos, sent until now."""
        parts = self._on.parts
        if parts is None:
            return 0
        return sum(line.requests[kind] for line in parts.lines for kind in _MOVING)

    def _torque_left(self, data: RunData) -> float | None:
        """Servos that have torque at the end."""
        if isinstance(self._resolved.scenario, EmergencyStop):
            return _float(self._cut.torque_left)
        if self._devices:
            return float(_torque_on(self._devices))
        if not isinstance(self._resolved.scenario, ControlledStop) or not data.commands:
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


def _float(value: int | None) -> float | None:
    return None if value is None else float(value)


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
