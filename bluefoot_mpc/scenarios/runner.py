"""Running a scenario: robot, controller, loop, log, summary and report put together."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import orjson

from bluefoot_mpc.control.pipeline import Pipeline
from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.io.robot import Robot
from bluefoot_mpc.io.safety import SafetySupervisor
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.runtime.loop import INTERRUPTED, CommandSource, LoopHooks, Observer, run_loop
from bluefoot_mpc.runtime.progress import Progress
from bluefoot_mpc.runtime.recorder import Recorder
from bluefoot_mpc.runtime.summary import summarize
from bluefoot_mpc.scenarios.base import Criterion
from bluefoot_mpc.scenarios.config import Resolved, resolve
from bluefoot_mpc.scenarios.folder import (
    CLOUD,
    CONFIG,
    LOG,
    REPORT,
    START_WEIGHTS,
    SUMMARY,
    WEIGHTS,
    keep_cloud,
    keep_weights,
    log_in,
    make_folder,
    writing,
)
from bluefoot_mpc.scenarios.options import RunOptions
from bluefoot_mpc.scenarios.registry import find_scenario
from bluefoot_mpc.scenarios.robots import RunRobot, device_criteria, make_robot
from bluefoot_mpc.settings import dump_toml
from bluefoot_mpc.sim.body import Posture
from bluefoot_mpc.viz.live import LiveView
from bluefoot_mpc.viz.report import write_report
from bluefoot_mpc.viz.stage import stage_of

if TYPE_CHECKING:
    from bluefoot_mpc.scenarios.stationed import StationedRun


@dataclass(frozen=True, kw_only=True, slots=True)
class Presentation:
    """How a run looks while it happens.

    Attributes:
        paced: one second of the run takes a second at least; None: only with the live view or a station.
        progress: a bar on the terminal, where there is one.
    """

    paced: bool | None = None
    progress: bool = True


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
    made = _prepare(resolved)
    hooks = LoopHooks(truth=made.on.truth, rests=made.on.rests)
    data = _drive(made, resolved, resolved.scenario.source, hooks)
    return _judge(data, resolved, made, Path())


def run_commanded(
    source: CommandSource,
    resolved: Resolved,
    options: RunOptions,
    presentation: Presentation | None = None,
) -> RunResult:
    """Run with any source of commands: a scenario's, or a person at the keyboard.

    Args:
        source: wanted motion over time; None ends the run.
        resolved: the configuration.
        options: output folder, view and report.
        presentation: pace and progress; defaults where missing.

    Raises:
        ConfigurationError: the robot cannot do what is asked, or a file cannot be written.
        LogError: the log cannot be written.
    """
    presentation = presentation or Presentation()
    # Who looks on, or commands, does so in real time.
    watched = options.view or options.station is not None
    paced = watched if presentation.paced is None else presentation.paced
    made = _prepare(resolved, paced)
    try:
        return _run_made(made, source, resolved, options, presentation)
    finally:
        # Where the run did not even begin, too: a robot holds ports, and has processes beside this one.
        made.on.robot.close()


def _run_made(
    made: _Made, source: CommandSource, resolved: Resolved, options: RunOptions, presentation: Presentation
) -> RunResult:
    on = made.on
    folder = make_folder(options, resolved.run.scenario)
    if resolved.stages.control.leveling.loads_weights:
        # A copy: the file that was named may change, this run itself may write it.
        keep_weights(made.pipeline.learnt, folder / START_WEIGHTS)
        made.table["control"]["leveling"]["weights"] = str((folder / START_WEIGHTS).resolve())
    with writing(folder / CONFIG):
        (folder / CONFIG).write_text(dump_toml(made.table), encoding="utf-8")
    with log_in(folder):
        with (
            _station(options, resolved, source, on) as station,
            _observers(made, resolved, options, presentation) as observers,
            Recorder(folder / LOG, made.table, on.robot.period) as recorder,
        ):
            seen_by = observers if station is None else (*observers, station.observe)
            hooks = LoopHooks(recorder=recorder, truth=on.truth, observers=seen_by, rests=on.rests)
            data = _drive(made, resolved, station or source, hooks, station)
            recorder.finish(data.stop_reason, data.real_time_factor)
        result = _judge(data, resolved, made, folder)
        _write_results(result, made.model, options.report)
        keep_weights(made.pipeline.learnt, folder / WEIGHTS)
        keep_cloud(result.data, folder / CLOUD)
    return result


@dataclass(frozen=True, kw_only=True, slots=True)
class _Made:
    """What a run needs, made before anything of an earlier run is touched.

    Attributes:
        model: the robot's model.
        on: the robot.
        pipeline: the controller.
        table: everything resolved, with what the seed drew.
    """

    model: RobotModel
    on: RunRobot
    pipeline: Pipeline
    table: dict[str, Any]


def _prepare(resolved: Resolved, paced: bool = False) -> _Made:
    model = RobotModel(resolved.parameters)
    resolved.scenario.check(model, resolved.stages.control)
    period = resolved.command_period
    pipeline = Pipeline(model, resolved.stages.control, period)
    on = make_robot(resolved, model, sitting(pipeline, model), paced)
    table = {**resolved.table(), "drawn": on.drawn}
    return _Made(model=model, on=on, pipeline=pipeline, table=table)


def sitting(pipeline: Pipeline, model: RobotModel) -> Posture:
    """Joints and trunk height of the controller's sitting posture."""
    height = float(pipeline.sitting.trunk_position[2]) + model.parameters.legs.foot_radius
    return Posture(joints=pipeline.sitting_joints, height=height)


@contextmanager
def _station(
    options: RunOptions, resolved: Resolved, source: CommandSource, on: RunRobot
) -> Iterator[StationedRun | None]:
    """The ground station of a run, where one is wanted."""
    if options.station is None:
        if not resolved.scenario.scripted:
            raise ConfigurationError(
                f"nothing commands '{resolved.run.scenario}': name the station with --station ADDRESS "
                "(udp:127.0.0.1:14550 for bluefoot station on this machine), or give it a script: "
                "--set 'scenario.script=\"walk 5 forward=0.06; sit 2\"'"
            )
        yield None
        return
    # MAVLink takes a while to load, and most runs need none.
    from bluefoot_mpc.io.station.link import StationLink  # noqa: PLC0415
    from bluefoot_mpc.scenarios.stationed import StationedRun  # noqa: PLC0415

    with StationLink(options.station) as link:
        # A station leads only where nothing else does.
        leads = not resolved.scenario.scripted
        # In memory all devices share one thread with the loop; another one must not touch them.
        direct = resolved.run.robot == "hardware" or resolved.stages.devices.link == "pty"
        yield StationedRun(link, source, leads=leads, powered=on.rests, direct=direct)


@contextmanager
def _observers(
    made: _Made, resolved: Resolved, options: RunOptions, presentation: Presentation
) -> Iterator[tuple[Observer, ...]]:
    """Live view and progress bar, as wanted."""
    with ExitStack() as stack:
        observers: list[Observer] = []
        if presentation.progress:
            progress = stack.enter_context(Progress(resolved.scenario.config.duration))
            observers.append(lambda frame, output, truth: progress.update(frame.time))
        if options.view:
            view = LiveView(made.model, stage_of(made.table))
            stack.callback(view.close)
            observers.append(view.update)
        yield tuple(observers)


def _write_results(result: RunResult, model: RobotModel, report: bool) -> None:
    text = orjson.dumps(result.summary, option=orjson.OPT_INDENT_2 | orjson.OPT_SERIALIZE_NUMPY)
    with writing(result.folder / SUMMARY):
        (result.folder / SUMMARY).write_bytes(text + b"\n")
    if not report:
        return
    checks = [dataclasses.asdict(criterion) for criterion in result.criteria]
    with writing(result.folder / REPORT):
        write_report(result.data, result.summary, model, result.folder / REPORT, checks)


def _drive(
    made: _Made,
    resolved: Resolved,
    source: CommandSource,
    hooks: LoopHooks,
    station: StationedRun | None = None,
) -> RunData:
    """The loop itself; the robot is closed whatever happens."""
    robot = made.on.robot
    try:
        supervised = supervise(robot, made.model, resolved)
        supervised.watch_over(made.pipeline.sitting_joints)
        if station is not None:
            station.attach(supervised)
        return run_loop(supervised, made.pipeline, source, hooks, made.table)
    finally:
        robot.close()


def supervise(robot: Robot, model: RobotModel, resolved: Resolved) -> SafetySupervisor:
    """The robot behind its safety supervisor."""
    return SafetySupervisor(robot, model.lower, model.upper, resolved.stages.safety)


def _judge(data: RunData, resolved: Resolved, made: _Made, folder: Path) -> RunResult:
    scenario = resolved.scenario
    window = _since_first_frame(scenario.window(), data)
    figures = dict(scenario.figures(data))
    if made.on.devices is not None:
        figures["devices"] = made.on.devices()
    summary = summarize(data, made.model, window=window, figures=figures)
    criteria = [*scenario.criteria(summary), *device_criteria(figures.get("devices"))]
    if not data.truth:
        # Figures are the simulator's truth against the command: a real robot cannot be judged by them.
        criteria = [criterion for criterion in criteria if not criterion.figure]
    summary["success"] = success = all(criterion.holds for criterion in criteria)
    return RunResult(summary=summary, folder=folder, criteria=criteria, success=success, data=data)


def _since_first_frame(window: tuple[float, float] | None, data: RunData) -> tuple[float, float] | None:
    """A scenario's window in the time of the frames: arming takes a while before the first of them."""
    if window is None or not data.frames:
        return window
    return window[0] + data.frames[0].time, window[1] + data.frames[0].time
