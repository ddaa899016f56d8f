"""The page that a run ends with: key figures, verdict, where the results lie."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from bluefoot_mpc.cli.level_page import LEVEL_FIGURES, level_table
from bluefoot_mpc.runtime.loop import INTERRUPTED
from bluefoot_mpc.scenarios import Criterion

Summary = Mapping[str, Any]
Row = tuple[str, str, str]
_NONE = "–"
_UNITS = {
    "s": "s",
    "m": "m",
    "mps": "m/s",
    "deg": "°",
    "rad": "rad",
    "ns": "N·s",
    "n": "N",
    "j": "J",
    "w": "W",
}
_NOT_SHOWN = ("window_s", "devices")
_CHANGE = re.compile(r"(mode|gait) \S+ -> \S+$")
"""What is no news: a change without a reason was commanded."""
_EVENTS_SHOWN = 5
_FILES = (
    ("report", "report.html"),
    ("log", "log.mcap"),
    ("summary", "summary.json"),
    ("configuration", "config.toml"),
    ("learnt weights", "narx.npz"),
    ("cloud", "cloud.ply"),
)


def summary_page(
    summary: Summary,
    criteria: Sequence[Criterion],
    folder: Path,
    events: Sequence[tuple[float, str]] = (),
) -> tuple[RenderableType, ...]:
    """One page on a finished run.

    Args:
        summary: content of summary.json.
        criteria: the scenario's conditions of success.
        folder: where the run's files lie.
        events: time (s) and text of what the controller reported.
    """
    heading = Text.assemble((_title(summary), "bold"), "\n")
    happened = [event for event in events if not _CHANGE.match(event[1])]
    told = (_events(happened),) if happened else ()
    level = level_table(summary.get("figures") or {})
    tables = [_table(_rows(summary, () if level is None else LEVEL_FIGURES))]
    if level is not None:
        tables.append(level)
    return (heading, *tables, _verdict(summary, criteria), *told, _files(folder))


def _events(events: Sequence[tuple[float, str]]) -> Text:
    """The first of each kind of thing out of the ordinary; the report has all of them."""
    kinds: dict[str, list[str]] = {}
    for time, text in events:
        kinds.setdefault(text.partition(":")[0], []).append(f"at {time:.2f} s: {text}")
    lines = [first + (f" (repeated: {len(others)})" if others else "") for first, *others in kinds.values()]
    if len(lines) > _EVENTS_SHOWN:
        lines[_EVENTS_SHOWN:] = [f"... and {len(lines) - _EVENTS_SHOWN} other things, see the report"]
    return Text("\n".join(lines) + "\n", style="yellow")


def _title(summary: Summary) -> str:
    gait = summary.get("gait")
    parts = [
        str(summary.get("scenario", "run")),
        f"{gait} gait" if gait else "",
        f"{_number(summary.get('duration_s'), 1)} s",
        f"seed {summary.get('seed', _NONE)}",
        f"controller {summary.get('controller', _NONE)}",
    ]
    return ", ".join(part for part in parts if part)


def _rows(summary: Summary, elsewhere: Sequence[str]) -> list[Row]:
    """Key figures; the scenario's own come last, but for those that are shown elsewhere."""
    get = summary.get
    tick = get("tick_us") or {}
    rows: list[Row] = [
        ("speed", _scaled(get("speed_mps"), 1e3, 1, "mm/s"), _of_command(summary)),
        ("distance", _scaled(get("distance_m"), 1.0, 2, "m"), _drift(summary)),
        ("roll", _scaled(get("roll_rms_deg"), 1.0, 2, "° RMS"), _peak(get("roll_peak_deg"))),
        ("pitch", _scaled(get("pitch_rms_deg"), 1.0, 2, "° RMS"), _peak(get("pitch_peak_deg"))),
        ("attitude estimate", _scaled(get("attitude_error_rms_deg"), 1.0, 2, "° RMS"), "against the truth"),
        ("swing clearance", _scaled(get("swing_clearance_median_m"), 1e3, 1, "mm"), "median of the swings"),
        ("ZMP inside support", _scaled(get("zmp_inside_fraction"), 100.0, 1, "%"), _zmp_margin(summary)),
        ("servo torque", _scaled(get("torque_rms_nm"), 1.0, 2, "N·m RMS"), _torque_peak(summary)),
        ("servo temperature", _scaled(get("servo_temp_max_c"), 1.0, 1, "°C"), "the hottest"),
        ("energy", _scaled(get("energy_j"), 1.0, 0, "J"), _transport(summary)),
        ("tick", _scaled(tick.get("p50"), 1.0, 0, "µs median"), _tick_tail(summary)),
        ("simulation", _scaled(get("real_time_factor"), 1.0, 1, "x real time"), ""),
    ]
    figures = (get("figures") or {}).items()
    rows += [_figure_row(name, value) for name, value in figures if name not in (*_NOT_SHOWN, *elsewhere)]
    return [row for row in rows if row[1] != _NONE]


def _table(rows: list[Row]) -> Table:
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 1))
    table.add_column(style="cyan", no_wrap=True)
    table.add_column(justify="right", no_wrap=True)
    table.add_column(style="dim")
    for row in rows:
        table.add_row(*(Text(cell) for cell in row))
    return table


def _verdict(summary: Summary, criteria: Sequence[Criterion]) -> Text:
    text = Text("\n")
    for criterion in criteria:
        mark, style = ("yes", "green") if criterion.holds else ("NO ", "bold red")
        text.append(f" {mark}  ", style).append(f"{criterion.name}: {criterion.detail}\n")
    if all(criterion.holds for criterion in criteria):
        return text.append("OK", "bold green").append(": every criterion of the scenario holds\n")
    reason = summary.get("stop_reason")
    if reason == INTERRUPTED:
        return text.append("INTERRUPTED", "bold yellow").append(": the robot sat down, the log is kept\n")
    ended = "" if reason in (None, "completed") else f"; the run ended early: {reason}"
    return text.append("FAILED", "bold red").append(f": a criterion of the scenario does not hold{ended}\n")


def _files(folder: Path) -> Text:
    lines = [f"{name:<14} {folder / file}" for name, file in _FILES if (folder / file).is_file()]
    return Text("\n".join(lines or [f"results        {folder}"]))


def _number(value: Any, digits: int) -> str:
    if not isinstance(value, (int, float)) or isinstance(value, bool) or not math.isfinite(value):
        return _NONE
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def _scaled(value: Any, factor: float, digits: int, unit: str) -> str:
    text = _NONE if value is None else _number(value * factor, digits)
    if text == _NONE:
        return text
    return f"{text}{unit}" if unit in ("°", "° RMS") else f"{text} {unit}"


def _of_command(summary: Summary) -> str:
    reference = summary.get("speed_ref_mps")
    return f"of {reference * 1e3:.0f} mm/s commanded" if reference else ""


def _drift(summary: Summary) -> str:
    drift = _scaled(summary.get("lateral_drift_m"), 1e3, 0, "mm")
    turn = _scaled(summary.get("yaw_drift_deg"), 1.0, 1, "°")
    return _joined(("sideways", drift), ("turned", turn))


def _zmp_margin(summary: Summary) -> str:
    return _joined(("least margin", _scaled(summary.get("zmp_margin_min_m"), 1e3, 1, "mm")))


def _torque_peak(summary: Summary) -> str:
    return _peak(summary.get("torque_peak_nm"), "N·m")


def _transport(summary: Summary) -> str:
    return _joined(("cost of transport", _number(summary.get("cost_of_transport"), 1)))


def _tick_tail(summary: Summary) -> str:
    tick = summary.get("tick_us") or {}
    pairs = [(name, _number(tick.get(name), 0)) for name in ("p99", "max")]
    missed = summary.get("deadline_misses")
    return _joined(*pairs, ("deadlines missed", str(missed) if missed else _NONE))


def _peak(value: Any, unit: str = "°") -> str:
    return _joined(("peak", _scaled(value, 1.0, 2, unit)))


def _joined(*pairs: tuple[str, str]) -> str:
    return ", ".join(f"{name} {text}" for name, text in pairs if text != _NONE)


def _figure_row(name: str, value: Any) -> Row:
    """A scenario's own figure; a unit at the end of its name goes behind the number."""
    label, _, suffix = name.rpartition("_")
    unit = _UNITS.get(suffix, "") if label else ""
    text = _figure(value)
    shown = f"{text}{'' if unit == '°' else ' '}{unit}" if unit and text != _NONE else text
    return ((label if unit else name).replace("_", " "), shown, "")


def _figure(value: Any) -> str:
    writers: dict[type, Callable[[Any], str]] = {
        bool: lambda v: "yes" if v else "no",
        float: lambda v: f"{round(v, 6):.4g}",
    }
    if value is None:
        return _NONE
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_figure(entry)}" for key, entry in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(_figure(entry) for entry in value) or "none"
    return writers.get(type(value), str)(value)
