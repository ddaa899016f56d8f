"""``bluefoot replay``: look at a recorded run again, or think it through again."""

from __future__ import annotations

import dataclasses
from typing import Any

from bluefoot_mpc.cli.arguments import ReplayCommand
from bluefoot_mpc.cli.outcome import FAILED, OK, WRONG_USE, Outcome
from bluefoot_mpc.exceptions import ConfigurationError, LogError
from bluefoot_mpc.runtime.log import RunLog, read_log
from bluefoot_mpc.runtime.replay import RethinkReport, Step, rethink
from bluefoot_mpc.scenarios import pipeline_from_log
from bluefoot_mpc.types import JointCommand, MotionCommand, SafetyRequest, SensorFrame
from bluefoot_mpc.viz.replay import replay as show_replay


def replay(command: ReplayCommand) -> Outcome:
    """Describe a log, and show or rethink it as asked."""
    log = read_log(command.log)
    if not log.frames:
        raise LogError(f"{log.path} holds no sensor frames: there is nothing to replay")
    data: dict[str, Any] = describe(log)
    lines = [_sentence(data)]
    status = WRONG_USE if log.truncated else OK
    if command.rethink:
        report = rethink(log, lambda: _todays_controller(log))
        status = status if report.equal else FAILED
        data["rethink"] = _as_data(report)
        lines.append(str(report))
    if command.html is not None or command.view:
        _show(command, log)
    if command.html is not None:
        data["html"] = command.html
        lines.append(f"wrote {command.html}")
    return Outcome(status=status, data=data, page=tuple(lines))


def _show(command: ReplayCommand, log: RunLog) -> None:
    if not log.telemetry:
        raise LogError(f"{log.path} holds nothing to show: not one tick of the controller is readable")
    log.look_through()
    try:
        show_replay(log, view=command.view, html=command.html)
    except OSError as error:
        raise ConfigurationError(f"cannot write {command.html}: {error.strerror or error}") from error


def describe(log: RunLog) -> dict[str, Any]:
    """What a log holds, in a few figures."""
    run = log.config.get("run", {})
    duration = log.frames[-1].time - log.frames[0].time + log.period if log.frames else 0.0
    return {
        "log": log.path,
        "scenario": run.get("scenario"),
        "seed": run.get("seed"),
        "controller": run.get("controller"),
        "duration_s": duration,
        "frames": len(log.frames),
        "truncated": log.truncated,
        "stop_reason": log.stop_reason,
        "versions": log.versions,
    }


def _sentence(data: dict[str, Any]) -> str:
    cut = ", cut off: what is readable" if data["truncated"] else ""
    return (
        f"{data['log']}: {data['scenario'] or 'a run'}, seed {data['seed']}, {data['duration_s']:.2f} s "
        f"in {data['frames']} frames{cut} ({data['stop_reason']})"
    )


def _todays_controller(log: RunLog) -> Step:
    pipeline = pipeline_from_log(log, log.path.parent)

    def step(frame: SensorFrame, motion: MotionCommand, safety: SafetyRequest) -> JointCommand:
        return pipeline.step(frame, motion, safety).command

    return step


def _as_data(report: RethinkReport) -> dict[str, Any]:
    return {**dataclasses.asdict(report), "equal": report.equal}
