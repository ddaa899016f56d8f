"""What the LIDAR measured, laid into the frame in which the robot was drawn."""

from __future__ import annotations

import logging
from dataclasses import dataclass
from typing import TypeGuard

import numpy as np

from bluefoot_mpc.geometry import rotation_z, rpy_from_quaternion
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.scan import LevelScan, ScanConfig, ScanReader
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.coverage import LIDAR_HEIGHT, lidar_pose
from bluefoot_mpc.sim.worlds.heights import Relief
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.terrain.cloud import scan_points
from bluefoot_mpc.types import FloatArray, LidarScan
from bluefoot_mpc.viz.surroundings import plan_of

_LOG = logging.getLogger(__name__)

_LOOKS = 12
"""Sweeps that are compared with a plan."""
_NEAR, _NOISE, _FIT = 0.06, 0.015, 0.98
"""m, m per metre of range, and share: so many points must lie so near to the plan's outlines."""
_NOSE_DOWN = 0.15
"""rad of pitch from which a sweep meets the ground."""
_OFF_GROUND, _BESIDE, _GROUND_FIT = 0.02, 0.025, 0.95
"""m up and down, m aside, and share: so many points must lie so near to the ground of a plan."""
_LEADER = 0.3
"""m around marker and leader, which stand in no plan."""
CELL = 0.03
"""m, side of the cells that thin a cloud of points out: one point in each."""


@dataclass(frozen=True, slots=True)
class ReadScan:
    """A usable sweep of a run.

    Attributes:
        tick: index of the frame that brought it.
        scan: levelled by the robot's own estimate of its tilt.
    """

    tick: int
    scan: LevelScan


def is_usable(scan: LidarScan | None) -> TypeGuard[LidarScan]:
    """True of a sweep that can be drawn: one distance for each bearing, and any at all."""
    if scan is None or not scan.valid:
        return False
    return scan.bearing.ndim == 1 and scan.bearing.shape == scan.distance.shape and len(scan.bearing) > 0


def read_scans(
    run: RunData, n: int, mounts: SensorMounts, config: ScanConfig | None = None, *, most: int = 10_000
) -> list[ReadScan]:
    """Usable sweeps of a run, evenly thinned.

    Args:
        run: the run.
        n: ticks to look at.
        mounts: where the LIDAR is.
        config: which sweeps are of use; as the controller had it, or None.
        most: sweeps, at most.
    """
    ticks = [k for k, frame in enumerate(run.frames[:n]) if frame.lidar is not None]
    reader = ScanReader(config or ScanConfig(), mounts)
    found = []
    for k in ticks[:: max(1, -(-len(ticks) // most))]:
        sweep = run.frames[k].lidar
        scan = reader.read(sweep, run.telemetry[k].estimate) if sweep is not None else ""
        if not isinstance(scan, str):
            found.append(ReadScan(tick=k, scan=scan))
    return found


def known_plan(run: RunData, mounts: SensorMounts) -> WorldPlan | None:
    """The plan of the world that a run took place in; None where there is none, or it is no longer known.

    Args:
        run: the run.
        mounts: where the LIDAR is.
    """
    plan = plan_of(run.config)
    if plan is None or plan_fits(plan, run, mounts):
        return plan
    _LOG.info("the world '%s' was another one when the run was recorded: it is left out", plan.name)
    return None


def plan_fits(plan: WorldPlan, run: RunData, mounts: SensorMounts) -> bool:
    """False where a run's own sweeps show that it took place elsewhere: another version makes other worlds.

    Args:
        plan: of the world that the configuration names today.
        run: the run; without truth or sweeps nothing can be said.
        mounts: where the LIDAR is.
    """
    ticks = [k for k, frame in enumerate(run.frames[: len(run.truth)]) if frame.lidar is not None]
    if not plan.is_even:
        return _ground_fits(plan, run, ticks, mounts)
    pieces = [_ends(run, k, mounts) for k in ticks[:: max(1, -(-len(ticks) // _LOOKS))]]
    table = np.concatenate([np.zeros((0, 3)), *pieces])
    if not len(table):
        return True
    solids = footprint.crossing(plan.solids, LIDAR_HEIGHT)
    away = np.abs(footprint.nearest(table[:, :2], solids))
    return float(np.mean(away < _NEAR + _NOISE * table[:, 2])) > _FIT


def _ground_fits(plan: WorldPlan, run: RunData, ticks: list[int], mounts: SensorMounts) -> bool:
    """False where a run's own sweeps over uneven ground met it elsewhere than at its height."""
    found = [np.zeros((0, 3))]
    for k in reversed(ticks):
        sweep, q = run.frames[k].lidar, run.truth[k].q
        if is_usable(sweep) and float(rpy_from_quaternion(q[3:7])[1]) > _NOSE_DOWN:
            found.append(scan_points(sweep, q[:3], q[3:7], mounts))
        if len(found) > _LOOKS:
            break
    points = np.concatenate(found)
    if not len(points):
        return True
    # A ray may meet the side of a thing, and then lies between its height and that of its surroundings.
    around = _BESIDE * np.array([[0.0, 0.0], [1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]])
    near = Relief(plan.solids, plan.floor).height(points[:, None, :2] + around)
    off = np.maximum(near.min(axis=1) - points[:, 2], points[:, 2] - near.max(axis=1))
    return float(np.mean(off < _OFF_GROUND)) > _GROUND_FIT


def _ends(run: RunData, tick: int, mounts: SensorMounts) -> FloatArray:
    """(m, 3) m in world: x and y of what a sweep truly met but marker and leader, and how far away it was."""
    truth, sweep = run.truth[tick], run.frames[tick].lidar
    if not is_usable(sweep):
        return np.zeros((0, 3))
    x, y, yaw = lidar_pose(truth.q, np.asarray(mounts.lidar)).tolist()
    met = np.isfinite(sweep.distance) & (sweep.distance > ScanConfig().least_range)
    angle, away = yaw + sweep.bearing[met], sweep.distance[met]
    points = np.column_stack([x + away * np.cos(angle), y + away * np.sin(angle), away])
    for moving in (truth.marker, truth.leader):
        if len(moving) and np.isfinite(moving[0]):
            points = points[np.hypot(*(points[:, :2] - moving[:2]).T) > _LEADER]
    return points


def cloud(run: RunData, scans: list[ReadScan], most: int) -> FloatArray:
    """(m, 2) m, ends of the rays that met something, in the odometry frame, thinned to one a cell.

    Args:
        run: the run.
        scans: its sweeps.
        most: points, at most.
    """
    pieces = [np.zeros((0, 2))]
    for item in scans:
        estimate = run.telemetry[item.tick].estimate
        turn = rotation_z(float(estimate.rpy[2]))[:2, :2]
        pieces.append(estimate.position[:2] + item.scan.points[item.scan.hit] @ turn.T)
    points = np.concatenate(pieces)
    if not len(points):
        return points
    cells = np.round(points / CELL).astype(np.int64)
    # One number for each cell: sorting pairs takes ten times as long.
    _, first = np.unique(cells[:, 0] * (1 << 24) + cells[:, 1], return_index=True)
    kept = points[np.sort(first)]
    return np.asarray(kept[:: max(1, -(-len(kept) // most))])
