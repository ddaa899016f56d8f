"""A run as one self-contained page: verdict, key figures, 3D replay and plots. Opens offline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.settings import dump_toml
from bluefoot_mpc.viz import plots, plots_ground, plots_level, plots_machine, plots_plan
from bluefoot_mpc.viz.animation import player_script, viewer_script
from bluefoot_mpc.viz.crossing import Crossing, crossing_of
from bluefoot_mpc.viz.journey import journey_of
from bluefoot_mpc.viz.level_series import extract_leveling
from bluefoot_mpc.viz.packing import stretches
from bluefoot_mpc.viz.page import embed_json, render, scripts, template_text
from bluefoot_mpc.viz.plan_series import extract_plans
from bluefoot_mpc.viz.plots import Panel
from bluefoot_mpc.viz.series import RunSeries, extract
from bluefoot_mpc.viz.stage_motion import replay_data
from bluefoot_mpc.viz.style import BAD, NEUTRAL
from bluefoot_mpc.viz.verdict import Tile, facts, number, tiles, verdict
from bluefoot_mpc.viz.verdict_crossing import CROSSING, crossing_events, crossing_tiles
from bluefoot_mpc.viz.verdict_way import NAVIGATION, way_events, way_tiles

SERVO_TEMPERATURE_LIMIT = 70.0
"""°C at which an AX-12A switches itself off (its control table's default)."""
_MAX_EVENTS = 400


def write_report(
    run: RunData,
    summary: Mapping[str, Any],
    robot: RobotModel,
    path: Path,
    checks: Sequence[Mapping[str, Any]] = (),
) -> None:
    """Write the report of a run.

    Args:
        run: what was recorded; truth may be missing (hardware).
        summary: the run's figures, as in ``summary.json``.
        robot: the robot that ran.
        path: file to write.
        checks: the scenario's criteria: ``name``, ``holds`` and ``detail`` of each, ``figure`` and ``goal``
            of those that judge a figure of the summary.
    """
    path.write_text(report_html(run, summary, robot, checks), encoding="utf-8")


def report_html(
    run: RunData,
    summary: Mapping[str, Any],
    robot: RobotModel,
    checks: Sequence[Mapping[str, Any]] = (),
) -> str:
    """The report as text; arguments as in `write_report`."""
    stall_torque = robot.parameters.servo.stall_torque
    series = extract(run, stall_torque)
    has_ticks = len(series.time) > 0
    crossing = crossing_of(run, series, robot) if has_ticks else None
    journey = journey_of(run, series, robot) if has_ticks else None
    panels = _panels(run, series, stall_torque, summary.get("figures") or {}) if has_ticks else []
    ways = [
        *(journey.panels if journey is not None else ()),
        *(crossing.panels if crossing is not None else ()),
    ]
    panels = [*ways, *panels]
    judged = verdict(summary, checks)
    data = (
        replay_data(run, series, robot, crossing.series if crossing is not None else None)
        if has_ticks
        else {}
    )
    return render(
        "report.html.j2",
        title=f"{judged.word}: {summary.get('scenario') or 'run'}, seed {summary.get('seed')}",
        verdict=judged,
        facts=facts(summary),
        checks=checks,
        tiles=[*_own_tiles(summary, checks, crossing), *tiles(summary, stall_torque, run.period, checks)],
        has_ticks=has_ticks,
        has_truth=series.has_truth,
        has_sweeps=bool(data.get("sweeps")),
        has_room=bool(data.get("bounds")),
        has_terrain=crossing is not None,
        plots_follow=True,
        panels=panels,
        strip=journey.strip if journey is not None else (),
        strip_after=journey.strip_after if journey is not None else "",
        run_data=embed_json(data),
        figures=embed_json(figures(panels, series)),
        **scripts([*([viewer_script()] if has_ticks else []), *drawing_scripts()], packed=bool(ways)),
        configuration=dump_toml(run.config).strip() or "none recorded",
        versions=sorted((summary.get("versions") or {}).items()),
        all_figures=_flat(summary),
        footer=_footer(series, len(run.telemetry)),
        **_events(
            series,
            [
                *(way_events(run, journey.guided) if journey is not None else []),
                *(crossing_events(crossing.series) if crossing is not None else []),
            ],
        ),
    )


def _own_tiles(
    summary: Mapping[str, Any], checks: Sequence[Mapping[str, Any]], crossing: Crossing | None
) -> list[Tile]:
    """Key figures of what the robot did on its own."""
    found = crossing_tiles(summary, checks) if crossing is not None else []
    return [*found, *way_tiles(summary, checks)]


def _panels(run: RunData, series: RunSeries, stall_torque: float, named: Mapping[str, Any]) -> list[Panel]:
    period, plans, level = run.period, extract_plans(run, series), extract_leveling(run, series)
    return [
        plots.footfall(series, period),
        *(plots_level.level_panels(series, level, named) if level is not None else []),
        plots.attitude(series),
        plots_ground.path(series),
        plots_ground.balance(series),
        plots.motion(series),
        *(plots_plan.plan_panels(series, plans) if plans is not None else []),
        plots_machine.torques(series, stall_torque),
        plots_machine.torque_strip(series, stall_torque),
        plots_machine.temperatures(series, SERVO_TEMPERATURE_LIMIT),
        plots_machine.tick_times(series, period),
    ]


def figures(panels: Sequence[Panel], series: RunSeries) -> dict[str, Any]:
    """Figures for the page's script, with pushes and changes of mode and gait drawn into every time axis."""
    start = plots.replay_start(series) if len(series.time) else 0.0
    found: dict[str, Any] = {"start": start, "duration": series.duration}
    for panel in panels:
        layout = dict(panel.layout)
        if panel.time:
            layout["shapes"] = [*_marks(series), *layout.get("shapes", [])]
            layout["xaxis"] = {"range": [0.0, series.duration], **layout["xaxis"]}
        found[panel.key] = {
            "data": panel.data,
            "layout": layout,
            "time": panel.time,
            "follow": panel.window > 0.0,
            "window": panel.window,
            "full": layout.get("xaxis", {}).get("range"),
        }
        if panel.steps:
            found[panel.key]["steps"] = [{"time": step.time, "data": step.data} for step in panel.steps]
        if panel.follows:
            found[panel.key]["follows"] = True
    return found


def _marks(series: RunSeries) -> list[dict[str, Any]]:
    shapes: list[dict[str, Any]] = []
    for k in range(1, len(series.mode)):
        if series.mode[k] != series.mode[k - 1]:
            shapes.append(plots.band(float(series.time[k]), float(series.time[k]), NEUTRAL))
    shapes += [plots.band(time, time, NEUTRAL) for time, text in series.events if text.startswith("gait ")]
    pushed = (series.push != 0.0).any(axis=1)
    step = float(series.time[1] - series.time[0]) if len(series.time) > 1 else 0.0
    shapes += [plots.band(start, end, BAD) for start, end in stretches(pushed, series.time, step)]
    return shapes


def _events(series: RunSeries, on_the_way: Sequence[tuple[float, str]]) -> dict[str, Any]:
    """Events with equal ones in a row put together, and a caption that tells what was left out."""
    grouped: list[dict[str, Any]] = []
    told = [
        event
        for event in _with_pushes(series)
        if not (on_the_way and event[1].startswith((NAVIGATION, CROSSING)))
    ]
    for time, text in sorted([*told, *on_the_way], key=lambda event: event[0]):
        last = next((group for group in reversed(grouped[-4:]) if group["text"] == text), None)
        if last is not None and time - last["end"] < 0.5:
            last.update(end=time, count=last["count"] + 1)
        else:
            grouped.append({"time": round(time, 4), "end": time, "text": text, "count": 1})
    shown = grouped[:_MAX_EVENTS]
    for event in shown:
        event["label"] = f"{event['time']:.2f} s"
        if event["count"] > 1:
            event["text"] += f" (for {event['end'] - event['time']:.2f} s, {event['count']} ticks)"
    kinds = "mode, gait and what leads" if on_the_way else "mode and gait"
    caption = f"Changes of {kinds}, limits met and pushes; press a time to go there in the replay."
    if not shown:
        caption = "Nothing out of the ordinary happened."
    elif len(grouped) > len(shown):
        caption = f"The first {len(shown)} of {len(grouped)}. {caption}"
    return {"events": shown, "events_caption": caption}


def _with_pushes(series: RunSeries) -> list[tuple[float, str]]:
    found = list(series.events)
    pushed = (series.push != 0.0).any(axis=1)
    step = float(series.time[1] - series.time[0]) if len(series.time) > 1 else 0.0
    for start, end in stretches(pushed, series.time, step):
        force = series.push[int(series.time.searchsorted(start))]
        size, lasted = float((force @ force) ** 0.5), end - start
        text = f"push of {number(size, 1)} N for {lasted:.2f} s, {number(size * lasted, 2)} N·s"
        found.append((start, text))
    return sorted(found, key=lambda event: event[0])


def _flat(table: Mapping[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    rows: list[tuple[str, str]] = []
    for key, value in table.items():
        if key == "versions":
            continue
        if isinstance(value, Mapping):
            rows += _flat(value, f"{prefix}{key}.")
        elif isinstance(value, list) and value and all(isinstance(entry, Mapping) for entry in value):
            for count, entry in enumerate(value, start=1):
                rows += _flat(entry, f"{prefix}{key}.{count}.")
        else:
            text = f"{value:.6g}" if isinstance(value, float) else "–" if value is None else str(value)
            rows.append((prefix + key, text))
    return rows


def _footer(series: RunSeries, ticks: int) -> str:
    source = (
        "Curves named truth come from the simulator and were not known to the controller."
        if series.has_truth
        else "Without simulator truth, everything is drawn from the robot's measurements and estimates."
    )
    return f"{ticks} ticks. {source} Angles: roll right side down, pitch nose down, yaw left positive."


def drawing_scripts() -> list[str]:
    """The JavaScript that draws figures beside a replay."""
    return [plotly_script(), player_script(), template_text("report.js")]


def plotly_script() -> str:
    """The JavaScript of plotly, from the installed package."""
    from plotly.offline import get_plotlyjs  # noqa: PLC0415 - half a second that only a report needs

    return str(get_plotlyjs())
