"""A recorded run looked at again: live in the browser at its own pace, or as one page with the 3D replay."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

from bluefoot_mpc.exceptions import ConfigurationError, LogError
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.settings import build
from bluefoot_mpc.viz.animation import player_script, viewer_script
from bluefoot_mpc.viz.crossing import crossing_of
from bluefoot_mpc.viz.journey import journey_of
from bluefoot_mpc.viz.live import LiveView
from bluefoot_mpc.viz.page import embed_json, render, scripts
from bluefoot_mpc.viz.report import drawing_scripts, figures
from bluefoot_mpc.viz.series import extract
from bluefoot_mpc.viz.stage import stage_of
from bluefoot_mpc.viz.stage_motion import replay_data

_WAIT_FOR_PAGE = 60.0  # s


def replay(
    log: RunData,
    *,
    view: bool = False,
    html: Path | None = None,
    announce: Callable[[str], None] | None = None,
) -> None:
    """Show a recorded run with the robot that its log describes.

    Args:
        log: the run.
        view: play it in the live view, at its own pace, once a page looks on.
        html: file to write the 3D replay to.
        announce: told the live view's address.

    Raises:
        LogError: the log does not describe its robot.
    """
    robot = robot_of(log)
    if html is not None:
        html.write_text(replay_html(log, robot), encoding="utf-8")
    if view:
        live = LiveView(robot, stage_of(log.config))
        try:
            if announce is not None and live.url:
                announce(live.url)
            play(log, live)
        finally:
            live.close()


def replay_html(run: RunData, robot: RobotModel) -> str:
    """The 3D replay as a self-contained page; below it, how the robot found its way where it did."""
    series = extract(run, robot.parameters.servo.stall_torque)
    named = run.config.get("run", {})
    journey = journey_of(run, series, robot) if len(series.time) else None
    crossing = crossing_of(run, series, robot) if len(series.time) else None
    data = replay_data(run, series, robot, crossing.series if crossing is not None else None)
    panels = (
        *(journey.panels if journey is not None else ()),
        *(crossing.panels if crossing is not None else ()),
    )
    return render(
        "page.html.j2",
        title=f"{named.get('scenario', 'run')}, seed {named.get('seed', '–')}",
        has_truth=series.has_truth,
        has_sweeps=bool(data.get("sweeps")),
        has_room=bool(data.get("bounds")),
        has_terrain=crossing is not None,
        plots_follow=bool(panels),
        panels=panels,
        strip=journey.strip if journey is not None else (),
        strip_after=journey.strip_after if journey is not None else "",
        run_data=embed_json(data),
        figures=embed_json(figures(panels, series)) if panels else "",
        **scripts(
            [viewer_script(), *(drawing_scripts() if panels else [player_script()])], packed=bool(panels)
        ),
    )


def play(run: RunData, live: LiveView, *, speed: float = 1.0, wait: float = _WAIT_FOR_PAGE) -> None:
    """Play a run in the live view and return when it is over or the view is gone.

    Args:
        run: the run.
        live: where to show it.
        speed: times its own pace.
        wait: s to wait for the first page before starting.
    """
    deadline = time.monotonic() + wait
    while live.alive and live.pages == 0 and time.monotonic() < deadline:
        time.sleep(0.1)
    start = time.monotonic()
    for index, telemetry in enumerate(run.telemetry):
        if not live.alive:
            return
        due = start + (telemetry.time - run.telemetry[0].time) / speed
        time.sleep(max(0.0, due - time.monotonic()))
        scan = run.frames[index].lidar if index < len(run.frames) else None
        live.show(telemetry, run.truth[index] if index < len(run.truth) else None, scan)


def robot_of(run: RunData) -> RobotModel:
    """The robot whose parameters a run recorded.

    Raises:
        LogError: they are missing, or do not fit this version.
    """
    try:
        return RobotModel(build(RobotParameters, run.config["model"], "model"))
    except (KeyError, ConfigurationError) as error:
        raise LogError(f"the log does not describe its robot: {error}") from error
