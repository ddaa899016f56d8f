"""How a run found its own way, as plain arrays over time; beside it what was really there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import BoolArray, FloatArray, NavigationReport, Telemetry, TruthSample
from bluefoot_mpc.viz.series import RunSeries, estimated_q

_MOVED = 0.05
"""m that a marker or leader must move to count as moving."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GuidedSeries:
    """Finding the way in one run, n ticks; NaN where nothing was reported.

    World and odometry frame both begin under the robot's first stance; drawn
    over each other, what lies between them is the drift of the estimate.

    Attributes:
        time: (n,) s, from the first tick.
        has_truth: True where simulator truth was recorded.
        guided: (n,) what led; empty where the robot was told where to go.
        task: (n,) the task; empty without one.
        position: (n, 2) m, trunk in world: truth, else the estimate.
        yaw: (n,) rad, of the same.
        estimate: (n, 2) m, trunk as estimated, odometry frame.
        clearance_true: (n,) m, from any part of the robot to the nearest thing; infinite in the open.
        clearance_known: (n,) m, from the robot's outline to the nearest point that it knew of.
        velocity: (n, 2) m/s, decided, forward and left.
        yaw_rate: (n,) rad/s, decided.
        marker: (n, 3) pixels: column, row and radius in the newest picture.
        marker_true: (n, 3) m, marker's centre in world.
        marker_estimate: (n, 3) m, as last seen, odometry frame.
        marker_age: (n,) s since it was last seen.
        distance_true: (n,) m, horizontally from the camera to the marker's centre.
        distance_estimate: (n,) m, the same as the robot believes it.
        distance_wanted: (n,) m, what the task asks for; NaN without a marker to keep a distance from.
        leader: (n, 7) pose of the leader in world.
        waypoints: (k, 2) m, odometry frame, in the order in which they were given.
        collisions: time (s) and names of things that the robot touched, each time that they change.
    """

    time: FloatArray
    has_truth: bool
    guided: tuple[str, ...]
    task: tuple[str, ...]
    position: FloatArray
    yaw: FloatArray
    estimate: FloatArray
    clearance_true: FloatArray
    clearance_known: FloatArray
    velocity: FloatArray
    yaw_rate: FloatArray
    marker: FloatArray
    marker_true: FloatArray
    marker_estimate: FloatArray
    marker_age: FloatArray
    distance_true: FloatArray
    distance_estimate: FloatArray
    distance_wanted: FloatArray
    leader: FloatArray
    waypoints: FloatArray
    collisions: tuple[tuple[float, tuple[str, ...]], ...]

    @property
    def reports(self) -> BoolArray:
        """(n,) True where navigation reported."""
        return np.array([bool(name) for name in self.guided], dtype=np.bool_)

    @property
    def in_view(self) -> BoolArray:
        """(n,) True where the newest picture shows the marker."""
        return np.asarray(np.isfinite(self.marker[:, 0]))

    @property
    def clearance(self) -> FloatArray:
        """(n,) m, the true clearance; without truth the one that the robot knew of."""
        return self.clearance_true if np.isfinite(self.clearance_true).any() else self.clearance_known

    @property
    def closest(self) -> int | None:
        """Tick of the closest approach; None where nothing ever was near."""
        clearance = np.where(np.isfinite(self.clearance), self.clearance, np.inf)
        return int(np.argmin(clearance)) if np.isfinite(clearance).any() else None

    @property
    def has_leader(self) -> bool:
        """True where a leader moved in the world."""
        return bool(np.isfinite(self.leader[:, 0]).any())

    @property
    def marker_moves(self) -> bool:
        """True where the true marker changed its place."""
        known = self.marker_true[np.isfinite(self.marker_true[:, 0])]
        return bool(len(known) and np.ptp(known[:, :2], axis=0).max() > _MOVED)

    @property
    def looks_for_a_marker(self) -> bool:
        """True where a marker was wanted, or seen."""
        return bool((np.isfinite(self.distance_wanted[self.reports])).any() or self.in_view.any())


def extract_guided(run: RunData, series: RunSeries, mounts: SensorMounts) -> GuidedSeries | None:
    """How a run found its way; None where it neither navigated nor scanned.

    Args:
        run: the run.
        series: its time series.
        mounts: where the sensors are.
    """
    n = len(series.time)
    telemetry, truth = run.telemetry[:n], run.truth[:n]
    reports = [record.navigation for record in telemetry]
    scans = any(frame.lidar is not None for frame in run.frames[:n])
    if n == 0 or not (scans or any(report is not None for report in reports)):
        return None
    marker_true = _stack([t.marker for t in truth], n, 3) if truth else np.full((n, 3), np.nan)
    leader = _stack([t.leader for t in truth], n, 7) if truth else np.full((n, 7), np.nan)
    marker_estimate = _reported(reports, "marker_position", 3)
    estimated = np.array([estimated_q(record)[:7] for record in telemetry])
    guides = [record.motion.guide or run.commands[k].motion.guide for k, record in enumerate(telemetry)]
    keeps = {"approach", "follow"}
    return GuidedSeries(
        time=series.time,
        has_truth=series.has_truth,
        guided=tuple("" if report is None else str(report.guided) for report in reports),
        task=tuple("" if guide is None else str(guide.task) for guide in guides),
        position=series.q[:, :2],
        yaw=np.unwrap(series.rpy_truth[:, 2] if series.has_truth else series.rpy_estimate[:, 2]),
        estimate=estimated[:, :2],
        clearance_true=np.array([t.clearance for t in truth]) if truth else np.full(n, np.nan),
        clearance_known=_reported(reports, "clearance")[:, 0],
        velocity=_reported(reports, "velocity", 2),
        yaw_rate=_reported(reports, "yaw_rate")[:, 0],
        marker=_reported(reports, "marker", 3),
        marker_true=marker_true,
        marker_estimate=marker_estimate,
        marker_age=_reported(reports, "marker_age")[:, 0],
        distance_true=_camera_distance(series.q, marker_true, mounts.camera),
        distance_estimate=_camera_distance(estimated, marker_estimate, mounts.camera),
        distance_wanted=np.array(
            [g.distance if g is not None and str(g.task) in keeps else np.nan for g in guides]
        ),
        leader=leader,
        waypoints=_waypoints(telemetry),
        collisions=_collisions(truth, series.time),
    )


def _reported(reports: Sequence[NavigationReport | None], name: str, width: int = 1) -> FloatArray:
    """(n, width) one quantity of the reports; NaN where there is none."""
    nothing = np.full(width, np.nan)
    return np.array([nothing if r is None else np.reshape(getattr(r, name), width) for r in reports])


def _stack(rows: Sequence[FloatArray], n: int, width: int) -> FloatArray:
    """(n, width); rows that a log of earlier versions lacks are NaN."""
    nothing = np.full(width, np.nan)
    return np.array([row if len(row) == width else nothing for row in rows]).reshape(n, width)


def camera_positions(q: FloatArray, camera: Sequence[float]) -> FloatArray:
    """(n, 3) m, the camera in the frame in which `q` (n, 7 or more) gives the trunk's pose."""
    offset = np.asarray(camera)
    return np.array([row[:3] + rotation_from_quaternion(row[3:7]) @ offset for row in q])


def _camera_distance(q: FloatArray, marker: FloatArray, camera: Sequence[float]) -> FloatArray:
    distance = np.full(len(q), np.nan)
    known = np.isfinite(marker[:, 0])
    if known.any():
        between = marker[known] - camera_positions(q[known], camera)
        distance[known] = np.hypot(between[:, 0], between[:, 1])
    return distance


def _waypoints(telemetry: Sequence[Telemetry]) -> FloatArray:
    """(k, 2) m, all waypoints of the run; those given again count once."""
    found: list[tuple[float, float]] = []
    for record in telemetry:
        guide = record.motion.guide
        for x, y in np.reshape(guide.waypoints, (-1, 2)).tolist() if guide is not None else []:
            if not any(math.dist((x, y), known) < 1e-6 for known in found):
                found.append((x, y))
    return np.array(found, dtype=np.float64).reshape(-1, 2)


def _collisions(truth: Sequence[TruthSample], time: FloatArray) -> tuple[tuple[float, tuple[str, ...]], ...]:
    found: list[tuple[float, tuple[str, ...]]] = []
    before: tuple[str, ...] = ()
    for k, sample in enumerate(truth):
        if sample.collisions and sample.collisions != before:
            found.append((float(time[k]), sample.collisions))
        before = sample.collisions
    return tuple(found)
