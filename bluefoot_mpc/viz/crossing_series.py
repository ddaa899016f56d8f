"""How a run crossed rough ground, as plain arrays over time; what was mapped, planned and stepped on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeGuard

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import BoolArray, CrossingReport, FloatArray, GuideTask, HeightMap, Telemetry
from bluefoot_mpc.viz.series import RunSeries, estimated_feet, estimated_q

MOST_POINTS = 6000
"""Points of the cloud that a page carries."""
_FINEST = 0.01
"""m, side of the boxes that thin the cloud out first: one point in each."""
_AROUND, _AHEAD = 0.8, 1.3
"""m around the way and the goal, and ahead of both, from which points are kept."""
_LATE = 0.3
"""s after the end of a swing within which a foot may come down."""
_SETTLES = 2
"""Ticks after which a foot that came down has settled."""


@dataclass(frozen=True, slots=True)
class MapAt:
    """A map, and the tick on which it was new."""

    tick: int
    ground: HeightMap


@dataclass(frozen=True, slots=True)
class RouteAt:
    """A planned way (k, 3): x, y (m) and yaw (rad), odometry frame, and the tick on which it was new."""

    tick: int
    poses: FloatArray


@dataclass(frozen=True, slots=True)
class Swing:
    """One swing of one leg.

    Attributes:
        leg: index of the leg.
        start: first tick of the swing.
        landed: tick on which the foot stands again.
        chosen: (3,) m, where it was to land, odometry frame; NaN where nothing was chosen.
        landing: (3,) m, where its lowest point landed as estimated, odometry frame.
    """

    leg: int
    start: int
    landed: int
    chosen: FloatArray
    landing: FloatArray

    @property
    def missed(self) -> float:
        """Horizontal distance (m) between the chosen and the real foothold; NaN where none was chosen."""
        return float(np.hypot(*(self.landing - self.chosen)[:2]))


@dataclass(frozen=True, kw_only=True, slots=True)
class CrossingSeries:
    """Crossing of rough ground in one run, n ticks; NaN where nothing was reported.

    World and odometry frame both begin under the robot's first stance; what lies between them is the
    drift of the estimate. Heights in the odometry frame count from the ground there, as in the world; the
    robot's own count from the middles of the balls that its feet end in.

    Attributes:
        time: (n,) s, from the first tick.
        has_truth: True where simulator truth was recorded.
        phase: (n,) what the robot was at; empty where it did not cross anything.
        reason: (n,) why; mostly empty.
        level: (n,) index of the sweep's level; -1 outside a sweep.
        pitch: (n,) rad, wanted pitch of the trunk, nose down.
        pitch_estimate: (n,) rad.
        pitch_truth: (n,) rad; NaN without truth.
        speed: (n,) m/s, allowed.
        lift: (n, 4) m, wanted step heights.
        drift: (n,) m, correction of the older map by the newest sweep.
        sweeps: sweeps ended.
        goal: (2,) m, odometry frame; NaN without one.
        position: (n, 3) m, trunk in world: truth, else the estimate.
        estimate: (n, 3) m, trunk as estimated, odometry frame.
        turn: (n, 3, 3) rotation from the odometry frame to the world that lays the estimated trunk over the
            true one; unity without truth.
        feet: (n, 4, 3) m, lowest points of the feet in world: truth, else the estimate.
        feet_estimate: (n, 4, 3) m, lowest points as estimated, odometry frame.
        swings: every swing of every leg, in order.
        maps: in order.
        routes: in order.
        points: (m, 3) m, the cloud near the way, thinned, odometry frame, in order of time.
        point_time: (m,) s, from the first tick.
        seen: points before thinning.
        touching: (n,) names of bodies other than feet that truly touched the world.
    """

    time: FloatArray
    has_truth: bool
    phase: tuple[str, ...]
    reason: tuple[str, ...]
    level: FloatArray
    pitch: FloatArray
    pitch_estimate: FloatArray
    pitch_truth: FloatArray
    speed: FloatArray
    lift: FloatArray
    drift: FloatArray
    sweeps: int
    goal: FloatArray
    position: FloatArray
    estimate: FloatArray
    turn: FloatArray
    feet: FloatArray
    feet_estimate: FloatArray
    swings: tuple[Swing, ...]
    maps: tuple[MapAt, ...]
    routes: tuple[RouteAt, ...]
    points: FloatArray
    point_time: FloatArray
    seen: int
    touching: tuple[tuple[str, ...], ...]

    @property
    def reports(self) -> BoolArray:
        """(n,) True where the robot reported on the ground."""
        return np.array([bool(name) for name in self.phase], dtype=np.bool_)

    def map_at(self, tick: int) -> HeightMap | None:
        """The map in force on a tick; None before the first."""
        known = [entry.ground for entry in self.maps if entry.tick <= tick]
        return known[-1] if known else None

    def in_world(self, places: FloatArray, tick: int) -> FloatArray:
        """(..., 3) m, places laid into the world so that the robot of a tick stands where it truly stood.

        Args:
            places: (..., 3) m, odometry frame.
            tick: the tick.
        """
        return np.asarray((places - self.estimate[tick]) @ self.turn[tick].T + self.position[tick])


def extract_crossing(run: RunData, series: RunSeries, foot_radius: float) -> CrossingSeries | None:
    """What a run tells of crossing rough ground; None for one that did not.

    Args:
        run: the run.
        series: its time series.
        foot_radius: m, of the balls whose centres the truth tells.
    """
    n = len(series.time)
    telemetry = run.telemetry[:n]
    reports = [record.crossing for record in telemetry]
    if not any(report is not None for report in reports):
        return None
    feet_estimate = np.array([estimated_feet(record) for record in telemetry]) - (0.0, 0.0, foot_radius)
    rise = datum(feet_estimate[0])
    feet_estimate -= rise
    estimate = np.array([estimated_q(record)[:7] for record in telemetry])
    turns = [_turn(true[3:7], believed[3:7]) for true, believed in zip(series.q, estimate, strict=True)]
    estimate[:, :3] -= rise
    goal = _goal(telemetry)
    points, point_time, seen = _cloud(telemetry, np.concatenate([estimate[:, :2], goal[None]]))
    return CrossingSeries(
        time=series.time,
        has_truth=series.has_truth,
        phase=tuple("" if report is None else str(report.phase) for report in reports),
        reason=tuple("" if report is None else report.reason for report in reports),
        level=_reported(reports, "level")[:, 0],
        pitch=_reported(reports, "pitch")[:, 0],
        pitch_estimate=series.rpy_estimate[:, 1],
        pitch_truth=series.rpy_truth[:, 1],
        speed=_reported(reports, "speed")[:, 0],
        lift=_reported(reports, "lift", 4),
        drift=_reported(reports, "drift")[:, 0],
        sweeps=max(report.sweeps for report in reports if report is not None),
        goal=goal,
        position=series.q[:, :3] if series.has_truth else estimate[:, :3],
        estimate=estimate[:, :3],
        turn=np.array(turns),
        feet=series.feet - (0.0, 0.0, foot_radius) if series.has_truth else feet_estimate,
        feet_estimate=feet_estimate,
        swings=_swings(series, reports, feet_estimate, rise),
        maps=_maps(reports, rise),
        routes=tuple(RouteAt(k, r.route) for k, r in enumerate(reports) if r is not None and is_route(r)),
        points=points - rise,
        point_time=point_time - telemetry[0].time,
        seen=seen,
        touching=tuple(t.touching for t in run.truth[:n]) if series.has_truth else ((),) * n,
    )


def datum(feet: FloatArray) -> FloatArray:
    """(3,) m, straight up: from the zero of estimated heights to the ground at the start.

    Args:
        feet: (4, 3) m, lowest points of the standing feet, odometry frame.
    """
    height = float(feet[:, 2].mean())
    return np.array([0.0, 0.0, height if np.isfinite(height) else 0.0])


def raised(ground: HeightMap, rise: FloatArray) -> HeightMap:
    """A map with its heights counted from the ground at the start; `rise` as `datum` gives it."""
    return replace(ground, pose=ground.pose - (0.0, 0.0, rise[2], 0.0))


def _maps(reports: Sequence[CrossingReport | None], rise: FloatArray) -> tuple[MapAt, ...]:
    new = [(k, report.ground) for k, report in enumerate(reports) if report is not None]
    return tuple(MapAt(k, raised(ground, rise)) for k, ground in new if is_map(ground))


def _turn(true: FloatArray, believed: FloatArray) -> FloatArray:
    return rotation_from_quaternion(true) @ rotation_from_quaternion(believed).T


def is_map(ground: HeightMap | None) -> TypeGuard[HeightMap]:
    """True of a map that can be drawn: some cells, of a size, at a place."""
    if ground is None or ground.height.ndim != 2 or ground.height.size == 0:
        return False
    return bool(ground.cell > 0.0 and np.isfinite(ground.pose).all() and np.isfinite(ground.cell))


def is_route(report: CrossingReport) -> bool:
    """True of a report with a new way that can be drawn."""
    route = report.route
    return route.ndim == 2 and len(route) > 1 and bool(np.isfinite(route[:, :2]).all())


def _goal(telemetry: Sequence[Telemetry]) -> FloatArray:
    """(2,) m, where the newest task to cross something leads."""
    for record in reversed(telemetry):
        guide = record.motion.guide
        if guide is not None and guide.task == GuideTask.CROSS and len(guide.waypoints):
            return np.asarray(guide.waypoints[-1], dtype=np.float64)
    return np.full(2, np.nan)


def _reported(reports: Sequence[CrossingReport | None], name: str, width: int = 1) -> FloatArray:
    """(n, width) one quantity of the reports; NaN where there is none."""
    nothing = np.full(width, np.nan)
    return np.array([nothing if r is None else np.reshape(getattr(r, name), width) for r in reports])


def _cloud(telemetry: Sequence[Telemetry], way: FloatArray) -> tuple[FloatArray, FloatArray, int]:
    """Points (m, 3) near a way (n, 2), with their times (m,), evenly thinned, and how many there were."""
    found = [(r.time, r.crossing.points) for r in telemetry if r.crossing is not None]
    pieces = [(time, points[np.isfinite(points).all(axis=1)]) for time, points in found if len(points)]
    if not pieces:
        return np.zeros((0, 3)), np.zeros(0), 0
    points = np.concatenate([points for _, points in pieces])
    time = np.repeat([time for time, _ in pieces], [len(points) for _, points in pieces])
    seen = len(points)
    low, high = np.nanmin(way, axis=0) - _AROUND, np.nanmax(way, axis=0) + np.array([_AHEAD, _AROUND])
    near = ((points[:, :2] >= low) & (points[:, :2] <= high)).all(axis=1)
    points, time = points[near], time[near]
    boxes = np.round(points / _FINEST).astype(np.int64) + (1 << 19)
    _, first = np.unique((boxes[:, 0] << 40) + (boxes[:, 1] << 20) + boxes[:, 2], return_index=True)
    kept = np.sort(first)
    # Every third of three rays that lie side by side would leave out whole sides of things: at random.
    if len(kept) > MOST_POINTS:
        kept = np.sort(np.random.default_rng(0).choice(kept, MOST_POINTS, replace=False))
    return points[kept], time[kept], seen


def _swings(
    series: RunSeries, reports: Sequence[CrossingReport | None], feet: FloatArray, rise: FloatArray
) -> tuple[Swing, ...]:
    """Every swing that ended, in the order of the landings."""
    found: list[Swing] = []
    n = len(series.time)
    late = int(np.searchsorted(series.time, series.time[0] + _LATE))
    for leg in range(4):
        aims = np.array([np.full(3, np.nan) if r is None else r.footholds[leg] for r in reports])
        swinging = np.concatenate([[False], ~series.scheduled[:, leg], [False]]).astype(np.int8)
        edges = np.flatnonzero(np.diff(swinging))
        for start, end in zip(edges[0::2].tolist(), edges[1::2].tolist(), strict=True):
            if end >= n:
                continue
            down = np.flatnonzero(series.loaded[end : end + late, leg])
            landed = min(n - 1, end + (int(down[0]) if len(down) else 0) + _SETTLES)
            aim = aims[start:end]
            aim = aim[np.isfinite(aim[:, :2]).all(axis=1)]
            chosen = aim[-1] - rise if len(aim) else np.full(3, np.nan)
            found.append(Swing(leg, start, landed, chosen, feet[landed, leg]))
    return tuple(sorted(found, key=lambda swing: (swing.landed, swing.leg)))
