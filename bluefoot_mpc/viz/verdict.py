"""What a summary says in words and key figures: the head of the report."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

_MARKS = {"good": "✓", "warn": "!", "bad": "✕", "": ""}
_MINUS = "\u2212"
_STOPPED_AT = re.compile(r"stopped at (\d+\.?\d*) s:")

_DID = {
    "stand": "stood",
    "pose": "moved its trunk",
    "walk": "walked",
    "turn": "turned",
    "transition": "changed its gait while walking",
    "push": "withstood the push",
    "drive": "was driven",
    "level": "levelled its trunk",
    "wander": "wandered",
    "goto": "went to its waypoints",
    "approach": "approached the marker",
    "follow": "followed the leader",
    "sweep": "swept the ground ahead",
    "rough": "walked over the rough ground",
}


@dataclass(frozen=True, kw_only=True, slots=True)
class Verdict:
    """Outcome of a run in one line.

    Attributes:
        status: ``good``, ``warn`` or ``bad``.
        word: one word for the badge.
        headline: one sentence.
        explanation: what it rests on, or why it went wrong.
    """

    status: str
    word: str
    headline: str
    explanation: str

    @property
    def mark(self) -> str:
        """Sign beside the word, for those who cannot tell the colours."""
        return _MARKS[self.status]


@dataclass(frozen=True, kw_only=True, slots=True)
class Tile:
    """One key figure.

    Attributes:
        label: what it is.
        value: number as text.
        unit: its unit; may be empty.
        note: goal or remark.
        status: ``good``, ``warn``, ``bad`` or empty (not judged).
    """

    label: str
    value: str
    unit: str = ""
    note: str = ""
    status: str = ""

    @property
    def mark(self) -> str:
        """Sign for those who cannot tell the colours."""
        return _MARKS[self.status]


def verdict(summary: Mapping[str, Any], checks: Sequence[Mapping[str, Any]] = ()) -> Verdict:
    """Judge a run by its summary.

    Args:
        summary: the summary, as in ``summary.json``.
        checks: the scenario's criteria: ``name``, ``holds`` and ``detail`` of each.
    """
    did = _DID.get(str(summary.get("scenario")), "completed the run")
    reason = str(summary.get("stop_reason") or "completed")
    lasted = f"{number(summary.get('duration_s'), 1)} s"
    failed = [check for check in checks if not check.get("holds")]
    if summary.get("fell"):
        why = reason if reason != "completed" else "the trunk or a link above a foot touched the ground"
        when = _STOPPED_AT.match(reason)
        after = f"at {when[1]} s" if when else f"in a run of {lasted}"
        return Verdict(
            status="bad", word="Fell", headline=f"The robot fell {after}", explanation=_sentence(why)
        )
    if reason == "interrupted":
        return Verdict(
            status="warn",
            word="Interrupted",
            headline=f"Interrupted after {lasted}",
            explanation="The run was ended by hand; the robot sat down and was switched off.",
        )
    if reason != "completed":
        headline = f"The run was stopped after {lasted}"
        return Verdict(status="bad", word="Stopped", headline=headline, explanation=_sentence(reason))
    if not summary.get("success", True):
        missed = "; ".join(f"{check['name']}: {check['detail']}" for check in failed)
        return Verdict(
            status="bad",
            word="Criteria missed",
            headline=f"The robot {did}, but missed {_count(failed)} of its criteria",
            explanation=_sentence(missed or "the scenario's criteria do not hold"),
        )
    return Verdict(
        status="good",
        word="Success",
        headline=f"The robot {did}{_extent(summary)}",
        explanation=_sentence(
            "; ".join(f"{c['name']} ({c['detail']})" for c in checks) or "every criterion holds"
        ),
    )


def facts(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    """What was run: names and values for the line under the headline."""
    found = [
        (key, str(summary[key])) for key in ("scenario", "gait", "controller", "robot") if summary.get(key)
    ]
    if summary.get("seed") is not None:
        found.append(("seed", str(summary["seed"])))
    if summary.get("duration_s") is not None:
        found.append(("duration", f"{number(summary['duration_s'], 1)} s"))
    if summary.get("real_time_factor"):
        found.append(("real-time factor", f"{number(summary['real_time_factor'], 1)} ×"))
    if summary.get("config_sha256"):
        found.append(("configuration", str(summary["config_sha256"])[:10]))
    return found


def tiles(
    summary: Mapping[str, Any],
    stall_torque: float,
    period: float,
    checks: Sequence[Mapping[str, Any]] = (),
) -> list[Tile]:
    """Key figures with their goals; figures that a run does not have are left out.

    The scenario's criteria say what its figures should be; servos, estimate and
    timing have goals of their own.

    Args:
        summary: the summary.
        stall_torque: N·m.
        period: s, command period.
        checks: the scenario's criteria; one with a ``figure`` judges that tile by its ``goal``.
    """
    goals = {
        check["figure"]: _Goal(str(check["goal"]), _always if check["holds"] else _never)
        for check in checks
        if check.get("figure")
    }
    walks = bool(summary.get("speed_ref_mps"))
    found = [
        *(_way_tiles(summary, goals) if walks else []),
        *_attitude_tiles(summary, goals),
        *_balance_tiles(summary, goals),
        *_servo_tiles(summary, stall_torque),
        *_timing_tiles(summary, period),
    ]
    return [tile for tile in found if tile is not None]


def _always(_: float) -> bool:
    return True


def _never(_: float) -> bool:
    return False


def _way_tiles(summary: Mapping[str, Any], goals: Mapping[str, _Goal]) -> list[Tile | None]:
    speed, drift = goals.get("speed_mps"), goals.get("lateral_drift_m")
    wanted = f"commanded {number(summary['speed_ref_mps'], 0, 1e3)}"
    return [
        _tile("Distance", summary.get("distance_m"), 2, "m", note="while measured"),
        _tile("Speed", summary.get("speed_mps"), 1, "mm/s", speed, scale=1e3, note=wanted),
        _tile("Sideways drift", summary.get("lateral_drift_m"), 0, "mm", drift, scale=1e3),
        _tile("Heading drift", summary.get("yaw_drift_deg"), 1, "°"),
    ]


def _attitude_tiles(summary: Mapping[str, Any], goals: Mapping[str, _Goal]) -> list[Tile | None]:
    estimate = _Goal("of the estimate, goal ≤ 0.3°", lambda x: x <= 0.3)
    return [
        *(
            _tile(f"{axis.capitalize()}, {kind}", summary.get(key), 2, "°", goals.get(key))
            for axis in ("roll", "pitch")
            for kind, key in _attitude_figures(axis, goals)
        ),
        _tile("Attitude error, RMS", summary.get("attitude_error_rms_deg"), 2, "°", estimate),
    ]


def _attitude_figures(axis: str, goals: Mapping[str, _Goal]) -> list[tuple[str, str]]:
    """RMS, and the peak where a criterion is about it."""
    figures = [("RMS", f"{axis}_rms_deg"), ("peak", f"{axis}_peak_deg")]
    return [figure for figure in figures if figure[0] == "RMS" or figure[1] in goals]


def _balance_tiles(summary: Mapping[str, Any], goals: Mapping[str, _Goal]) -> list[Tile | None]:
    swing, feet = "swing_clearance_median_m", "three or more feet down"
    return [
        _tile("Swing clearance", summary.get(swing), 1, "mm", goals.get(swing), scale=1e3, note="median"),
        _tile("ZMP inside support", summary.get("zmp_inside_fraction"), 0, "%", scale=100.0, note=feet),
        _tile("ZMP margin, least", summary.get("zmp_margin_min_m"), 0, "mm", scale=1e3, note=feet),
    ]


def _servo_tiles(summary: Mapping[str, Any], stall_torque: float) -> list[Tile | None]:
    below_stall = _Goal(f"stall {stall_torque:g} N·m", lambda x: x <= 1.001 * stall_torque)
    cool = _Goal("switches off at 70 °C", lambda x: x < 65.0)
    return [
        _tile("Torque, peak", summary.get("torque_peak_nm"), 2, "N·m", below_stall),
        _tile("Torque, RMS", summary.get("torque_rms_nm"), 2, "N·m"),
        _tile("Hottest servo", summary.get("servo_temp_max_c"), 0, "°C", cool),
        _tile("Energy", summary.get("energy_j"), 0, "J"),
        _tile("Cost of transport", summary.get("cost_of_transport"), 1),
    ]


def _timing_tiles(summary: Mapping[str, Any], period: float) -> list[Tile | None]:
    ticks = summary.get("tick_us") or {}
    in_time = _Goal(f"deadline {1e3 * period:g} ms", lambda x: x < 1e6 * period)
    none = _Goal("goal 0", lambda x: x == 0)
    return [
        _tile("Tick, 99 %", ticks.get("p99"), 0, "µs", in_time),
        _tile("Deadline misses", summary.get("deadline_misses"), 0, "", none),
        _tile("QP failures", summary.get("qp_failures"), 0, "", none),
    ]


def number(value: Any, digits: int, scale: float = 1.0) -> str:
    """A number as text with a true minus sign; a dash where there is none."""
    if value is None or not math.isfinite(float(value)):
        return "–"
    text = f"{scale * float(value):.{digits}f}"
    if float(text) == 0.0:
        text = text.removeprefix("-")
    return text.replace("-", _MINUS)


@dataclass(frozen=True, slots=True)
class _Goal:
    """What a figure should be: in words, and as a test in the summary's unit."""

    note: str
    holds: Callable[[float], bool]


def _tile(
    label: str,
    value: Any,
    digits: int,
    unit: str = "",
    goal: _Goal | None = None,
    *,
    scale: float = 1.0,
    note: str = "",
) -> Tile | None:
    if value is None:
        return None
    text = number(value, digits, scale)
    if goal is None:
        return Tile(label=label, value=text, unit=unit, note=note)
    status = "good" if goal.holds(float(value)) else "bad"
    return Tile(label=label, value=text, unit=unit, note=goal.note, status=status)


def _extent(summary: Mapping[str, Any]) -> str:
    figures = summary.get("figures") or {}
    path, reached = figures.get("path_m"), figures.get("reached_s")
    if reached is not None:
        return f" in {number(reached, 0)} s"
    if path is not None:
        return f" over {number(path, 1)} m in {number(summary.get('duration_s'), 0)} s"
    distance, speed = summary.get("distance_m"), summary.get("speed_mps")
    if not summary.get("speed_ref_mps") or distance is None or speed is None:
        return f" for {number(summary.get('duration_s'), 0)} s"
    return f" {number(distance, 2)} m at {number(speed, 0, 1e3)} mm/s"


def _count(failed: Sequence[Mapping[str, Any]]) -> str:
    return {0: "some", 1: "one", 2: "two", 3: "three"}.get(len(failed), str(len(failed)))


def _sentence(text: str) -> str:
    text = text.strip()
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
