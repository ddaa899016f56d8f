"""Figures of runs on which the robot finds its own way: how near, how far, how long in view."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.runtime import metrics
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import FloatArray, Guide, Guided, GuideTask, NavigationReport, TruthSample

STILL_DISTANCE, STILL_YAW = 0.05, math.radians(10.0)
"""m and rad: a robot that has not left this for a while, though it should, is stuck."""
FRESH = 0.4
"""s, greatest age of a picture in which the marker counts as in view: it comes 0.1 s late, every 0.1 s."""
ASIDE = 0.2
"""rad between where the marker was found and where it is, at most: the robot turns while a picture comes."""
SAME_PLACE = 0.3
"""m."""
_STRIDE = 0.5
"""s between the points of the path whose length is measured: steps and sway in between do not count."""
_AT_REST = 1.0
"""s at the end of a run over which the last distance to the marker is averaged."""


def nearness(run: RunData) -> dict[str, Any]:
    """What the robot kept away from, or touched: truth of the whole run."""
    clearance = run.stack("truth", "clearance") if run.truth else np.empty(0)
    known = clearance[~np.isnan(clearance)]
    near = float(known.min()) if known.size else math.nan
    touched = sorted({name for sample in run.truth for name in sample.collisions})
    return {"closest_approach_m": near, "collisions": touched if run.truth else None}


def movement(run: RunData) -> dict[str, Any]:
    """How far the robot went, how long it was stuck at most, and what led it."""
    time, position, yaw = _track(run)
    every = max(1, round(_STRIDE / run.period))
    steps = np.diff(position[::every], axis=0)
    led = Counter(str(t.navigation.guided) for t in run.telemetry if t.navigation is not None)
    total = sum(led.values())
    return {
        "path_m": float(np.hypot(*steps.T).sum()) if len(steps) else 0.0,
        "stuck_longest_s": _longest_still(time, position, yaw, _should_move(run)),
        "same_place_longest_s": _longest_near(time, position),
        "led_by_percent": {name: 100.0 * count / total for name, count in sorted(led.items())},
    }


def in_view_percent(run: RunData) -> float | None:
    """Share of the time since navigation began in which a fresh picture showed the marker where it is."""
    reports = [(k, t.navigation) for k, t in enumerate(run.telemetry) if t.navigation is not None]
    return 100.0 * sum(_is_in_view(run, k, n) for k, n in reports) / len(reports) if reports else None


def marker_distances(run: RunData) -> FloatArray:
    """(n,) m, true horizontal distance from the camera to the marker's centre; NaN without a marker."""
    mount = np.array(run.config["model"]["sensors"]["camera"])
    return np.array([_marker_distance(sample, mount) for sample in run.truth])


def distance_figures(run: RunData, wanted: float) -> dict[str, Any]:
    """How far from the marker the robot was, and came to rest.

    Args:
        run: the run.
        wanted: m, horizontal, from the camera to the marker's centre.
    """
    distance = marker_distances(run)
    if not distance.size or np.isnan(distance).all():
        return {"distance_m": None, "distance_error_m": None, "distance_median_m": None}
    last = float(distance[-max(1, round(_AT_REST / run.period)) :].mean())
    return {
        "distance_m": last,
        "distance_error_m": last - wanted,
        "distance_median_m": float(np.nanmedian(distance)),
    }


def waypoint_distances(run: RunData, points: FloatArray) -> list[float]:
    """Distance of the trunk to each waypoint when the next one became its goal, or when its task ended, m.

    True where there is truth, else estimated; empty where the task never began.

    Args:
        run: the run.
        points: (n, 2) m, waypoints of a task of the run, in the odometry frame.
    """
    ticks = [k for k, record in enumerate(run.commands) if _goes_to(record.motion.guide, points)]
    ticks = [k for k in ticks if k < len(run.telemetry)]
    if not ticks:
        return []
    left = [ticks[-1]] * len(points)
    for k in reversed(ticks):
        navigation = run.telemetry[k].navigation
        done = 0 if navigation is None else len(points) - navigation.waypoints_left
        left[:done] = [k] * done
    _, position, _ = _track(run)
    return [
        math.dist(position[min(k, len(position) - 1)], point)
        for k, point in zip(left, points.tolist(), strict=True)
    ]


def arrival(run: RunData) -> float | None:
    """s, since when the robot has held its goal at the end of the run; None where it does not."""
    since: float | None = None
    for record in run.telemetry:
        if record.navigation is None:
            continue
        if record.navigation.guided is not Guided.ARRIVED:
            since = None
        elif since is None:
            since = record.time
    return since


def first_sight(run: RunData) -> float | None:
    """s, when the marker was first found in a picture; None where it never was."""
    for record in run.telemetry:
        if record.navigation is not None and not math.isnan(record.navigation.marker[2]):
            return record.time
    return None


def _is_in_view(run: RunData, tick: int, navigation: NavigationReport) -> bool:
    column = float(navigation.marker[0])
    if math.isnan(column) or navigation.marker_age > FRESH:
        return False
    if tick >= len(run.truth):
        return True
    sensors, width = run.config["model"]["sensors"], run.config["sim"]["camera"]["width"]
    focal = 0.5 * width / math.tan(0.5 * math.radians(sensors["camera_view_deg"]))
    seen = math.atan2(0.5 * width - column, focal)
    sample = run.truth[tick]
    rotation = rotation_from_quaternion(sample.q[3:7])
    x, y, _ = rotation.T @ (sample.marker - sample.q[:3]) - np.array(sensors["camera"])
    return abs(math.atan2(y, x) - seen) <= ASIDE


def _marker_distance(sample: TruthSample, mount: FloatArray) -> float:
    camera = sample.q[:3] + rotation_from_quaternion(sample.q[3:7]) @ mount
    return float(np.hypot(*(sample.marker - camera)[:2]))


def _goes_to(guide: Guide | None, points: FloatArray) -> bool:
    return guide is not None and guide.task is GuideTask.GOTO and np.array_equal(guide.waypoints, points)


def _track(run: RunData) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time (n,) s, place (n, 2) m and continuous yaw (n,) rad: true where there is truth, else estimated."""
    if run.truth:
        q = run.stack("truth", "q")
        return run.stack("truth", "time"), q[:, :2], metrics.yaw(q[:, 3:7])
    position = run.stack("telemetry", "estimate.position")
    quaternion = run.stack("telemetry", "estimate.quaternion")
    return run.stack("telemetry", "time"), position[:, :2], metrics.yaw(quaternion)


def _should_move(run: RunData) -> list[bool]:
    return [t.navigation is not None and t.navigation.guided is not Guided.ARRIVED for t in run.telemetry]


def _longest_near(time: FloatArray, position: FloatArray) -> float:
    """s, longest stay within `SAME_PLACE` of a place, whatever the robot does there."""
    longest, anchor = 0.0, 0
    for k in range(len(time)):
        if math.hypot(*(position[k] - position[anchor]).tolist()) > SAME_PLACE:
            anchor = k
        longest = max(longest, float(time[k] - time[anchor]))
    return longest


def _longest_still(time: FloatArray, position: FloatArray, yaw: FloatArray, moves: list[bool]) -> float:
    """s, longest stay within `STILL_DISTANCE` and `STILL_YAW` of a place while the robot should move."""
    longest, anchor = 0.0, 0
    for k in range(min(len(time), len(moves))):
        away = math.hypot(*(position[k] - position[anchor]).tolist())
        if not moves[k] or away > STILL_DISTANCE or abs(yaw[k] - yaw[anchor]) > STILL_YAW:
            anchor = k
        longest = max(longest, float(time[k] - time[anchor]))
    return longest
