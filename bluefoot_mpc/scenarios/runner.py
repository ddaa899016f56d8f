"""Running a scenario: robot, controller, loop, log, summary and report put together."""

from __future__ import annotations

import dataclasses
import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import orjson

from bluefoot_mpc.control.config import ControlConfig
from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.exceptions import ConfigurationError, LogError
from bluefoot_mpc.io.pacing import PacedRobot
from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.io.safety import SafetySupervisor
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.loop import INTERRUPTED, CommandSource, LoopHooks, Observer, run_loop
from bluefoot_mpc.runtime.progress import Progress
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.runtime.summary import summarize
from bluefoot_mpc.scenarios.base import Criterion
from bluefoot_mpc.scenarios.config import Resolved, resolve
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.settings import build, dump_toml
from bluefoot_mpc.sim.robot import SimRobot
from bluefoot_mpc.viz.live import LiveView
from bluefoot_mpc.viz.report import write_report

log = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True, slots=True)
class RunResult:
    """What a run left.

    Attributes:
        summary: the figures of ``summary.json``.
        folder: where everything was written.
        criteria: the scenario's conditions of success.
        success: True when all of them hold.
        data: the run in memory.
    """

    summary: dict[str, Any]
    folder: Path
    criteria: list[Criterion]
    success: bool
    data: RunData

    @property
    def exit_status(self) -> int:
        """0 success, 1 a criterion does not hold, 130 interrupted."""
        if self.summary["stop_reason"] == INTERRUPTED:
            return 130
        return 0 if self.success else 1


def run(name_or_path: str = "walk", options: RunOptions | None = None) -> RunResult:
    """Run a scenario and write its log, summary, configuration and report.

    Args:
        name_or_path: a scenario's name, or the path of a script that defines one.
        options: choices of the user; defaults where missing.

    Raises:
        ConfigurationError: an option, file or value is impossible.
    """
    options = options or RunOptions()
    resolved = resolve(find_scenario(name_or_path), options)
    return run_commanded(resolved.scenario.source, resolved, options)


def simulate(name_or_path: str, options: RunOptions) -> RunResult:
    """Run a scenario in memory, as fast as it goes, and write nothing.

    Args:
        name_or_path: a scenario's name, or the path of a script that defines one.
        options: choices of the user; ``out``, ``view`` and ``report`` have no effect.

    Raises:
        ConfigurationError: an option, file or value is impossible.
    """
    resolved = resolve(find_scenario(name_or_path), options)
    model = RobotModel(resolved.parameters)
    resolved.scenario.check(model, resolved.stages.control)
    simulator = SimRobot(model, resolved.stages.sim, resolved.run.seed)
    table = {**resolved.table(), "drawn": simulator.drawn}
    data = _drive(
        simulator, model, resolved, resolved.scenario.source, LoopHooks(truth=simulator.truth), table
    )
    return _judge(data, resolved, model, Path())


def run_commanded(source: CommandSource, resolved: Resolved, options: RunOptions) -> RunResult:
    """Run with any source of commands: a scenario's, or a person at the keyboard.

    Args:
        source: wanted motion over time; None ends the run.
        resolved: the configuration.
        options: output folder, view and report.
    """
    model = RobotModel(resolved.parameters)
    resolved.scenario.check(model, resolved.stages.control)
    simulator = SimRobot(model, resolved.stages.sim, resolved.run.seed)
    table = {**resolved.table(), "drawn": simulator.drawn}
    folder = _make_folder(options, resolved.run.scenario)
    (folder / "config.toml").write_text(dump_toml(table), encoding="utf-8")
    view = LiveView(model) if options.view else None
    robot = simulator if view is None else PacedRobot(simulator)
    progress = Progress(resolved.scenario.config.duration)
    observers: list[Observer] = [lambda frame, output, truth: progress.update(frame.time)]
    if view is not None:
        observers.append(view.update)
    try:
        with Recorder(folder / "log.mcap", table, simulator.period) as recorder, progress:
            hooks = LoopHooks(recorder=recorder, truth=simulator.truth, observers=tuple(observers))
            data = _drive(robot, model, resolved, source, hooks, table)
            recorder.finish(data.stop_reason, data.real_time_factor)
    finally:
        if view is not None:
            view.close()
    result = _judge(data, resolved, model, folder)
    text = orjson.dumps(result.summary, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY)
    (folder / "summary.json").write_bytes(text + b"\n")
    if options.report:
        checks = [dataclasses.asdict(criterion) for criterion in result.criteria]
        write_report(data, result.summary, model, folder / "report.html", checks)
    return result


def _drive(
    robot: Robot,
    model: RobotModel,
    resolved: Resolved,
    source: CommandSource,
    hooks: LoopHooks,
    table: dict[str, Any],
) -> RunData:
    """The loop itself; the robot is closed whatever happens."""
    try:
        supervised = supervise(robot, model, resolved)
        pipeline = Pipeline(model, resolved.stages.control, robot.period)
        return run_loop(supervised, pipeline, source, hooks, table)
    finally:
        robot.close()


def supervise(robot: Robot, model: RobotModel, resolved: Resolved) -> SafetySupervisor:
    """The robot behind its safety supervisor."""
    return SafetySupervisor(robot, model.lower, model.upper, resolved.stages.safety)


def pipeline_from_log(data: RunData) -> Pipeline:
    """The controller that a log's configuration describes, as today's code builds it.

    Raises:
        LogError: the log does not hold a configuration that today's code understands.
    """
    try:
        parameters = build(RobotParameters, data.config["model"], "model")
        control = build(ControlConfig, data.config["control"], "control")
    except (KeyError, ConfigurationError) as error:
        raise LogError(f"the log's configuration does not fit this version: {error}") from error
    return Pipeline(RobotModel(parameters), control, data.period)


def _judge(data: RunData, resolved: Resolved, model: RobotModel, folder: Path) -> RunResult:
    summary = summarize(data, model, window=resolved.scenario.window())
    criteria = resolved.scenario.criteria(summary)
    summary["success"] = success = all(criterion.holds for criterion in criteria)
    return RunResult(summary=summary, folder=folder, criteria=criteria, success=success, data=data)


def _make_folder(options: RunOptions, scenario: str) -> Path:
    folder = options.out or Path("runs") / f"{time.strftime('%Y%m%d-%H%M%S')}-{scenario}"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ConfigurationError(f"cannot write to --out {folder}: {error.strerror or error}") from error
    return folder
