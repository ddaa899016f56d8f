"""Figures of a sweep of the ground: what was seen, how true it is, and how the LIDAR is mounted."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.model.parameters import RobotParameters
from bluefoot_mpc.navigation.crossing.pose_track import PoseTrack
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.scenarios.crossing_figures import in_truth
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.terrain.frame import centres
from bluefoot_mpc.terrain.mounting import Floor, Mounting, PosedScan, find_mounting
from bluefoot_mpc.terrain.sweep import SweepConfig, line_ahead
from bluefoot_mpc.types import BodyState, BoolArray, CrossingPhase, FloatArray, HeightMap, Telemetry

REACH = 1.2
"""m from the robot, within which a map is judged."""
SIDE = 0.8
"""m to either side, within which cells should have been seen."""
OTHERWISE = "not as in the parameter file"
"""What a run says of a LIDAR that is mounted otherwise."""
CLEAR = 2.5
"""Standard deviations from which a mounting is not what the parameter file says."""
_SEEN = 0.5
"""Confidence from which a cell counts as seen, not as assumed."""


def sweep_figures(run: RunData) -> dict[str, Any]:
    """What a run's sweep gave."""
    reports = [(t, t.crossing) for t in run.telemetry if t.crossing is not None]
    sweeping = [r for _, r in reports if r.phase is CrossingPhase.SWEEP]
    mapped = next(((k, t) for k, t in enumerate(run.telemetry) if _has_map(t)), None)
    found: dict[str, Any] = {
        "sweeps": reports[-1][1].sweeps if reports else 0,
        "sweep_time_s": round(len(sweeping) * run.period, 2),
        "levels": 1 + max((r.level for r in sweeping), default=-1),
        "sweep_reason": (reports[-1][1].reason or None) if reports else "the robot never swept",
        "points": sum(len(r.points) for r in sweeping),
        "seen_within_reach_percent": None,
        "map_cells": 0,
        **_errors(np.zeros(0)),
    }
    if mapped is not None:
        k, telemetry = mapped
        ground = telemetry.crossing.ground if telemetry.crossing is not None else None
        if ground is not None:
            seen = _seen(ground)
            found |= {
                "seen_within_reach_percent": covered(
                    ground, telemetry.estimate, nearest_line(run, telemetry.estimate.height)
                ),
                "map_cells": int(np.count_nonzero(seen & _within(ground, telemetry.estimate))),
                **_errors(_deviations(run, k, ground)),
            }
    return found | mounting_figures(run)


def covered(ground: HeightMap, estimate: BodyState, nearest: float) -> float | None:
    """Percent of the cells ahead, from the nearest line of the sweep to `REACH`, that were seen.

    Args:
        ground: the map.
        estimate: of the robot.
        nearest: m ahead of the trunk, the nearest line.
    """
    x, y = _from_robot(ground, estimate)
    wanted = (x >= nearest) & (np.hypot(x, y) <= REACH) & (np.abs(y) <= SIDE)
    count = np.count_nonzero(wanted)
    return 100.0 * float(np.count_nonzero(wanted & _seen(ground)) / count) if count else None


def nearest_line(run: RunData, height: float) -> float:
    """How far (m) ahead of the trunk the steepest level of a run's first sweep meets level ground.

    Args:
        run: the run.
        height: m, of the trunk over the feet.
    """
    sweep = build(SweepConfig, run.config["control"]["crossing"]["first_sweep"])
    lift = build(RobotParameters, run.config["model"]).sensors.lidar[2]
    return float(line_ahead(sweep.pitch_range[1], height, lift))


def mounting_figures(run: RunData) -> dict[str, Any]:
    """How the LIDAR is mounted, where the run's sweep was of a flat floor; else why that is not known."""
    found = find_run_mounting(run)
    if found.reason:
        return {"lidar_mounting": found.reason}
    believed = build(RobotParameters, run.config["model"]).sensors.lidar_rpy_deg
    fits = bool((np.abs(found.rpy_deg - believed) <= CLEAR * found.deviation_deg).all())
    return {
        "lidar_mounting": "as in the parameter file" if fits else OTHERWISE,
        "lidar_rpy_deg": found.rpy_deg.round(2).tolist(),
        "lidar_rpy_deviation_deg": found.deviation_deg.round(2).tolist(),
        "lidar_height_m": round(found.height, 4),
    }


def find_run_mounting(run: RunData) -> Mounting:
    """The LIDAR's mounting from the scans of a run's sweep, and the poses that the robot believed in."""
    parameters = build(RobotParameters, run.config["model"])
    track, looks, feet = PoseTrack(), [], []
    for frame, telemetry in zip(run.frames, run.telemetry, strict=False):
        estimate = telemetry.estimate
        track.add(estimate)
        if frame.lidar is None or telemetry.crossing is None or not len(telemetry.crossing.points):
            continue
        pose = track.at(frame.lidar.time)
        looks.append(PosedScan(frame.lidar, pose.position, pose.quaternion))
        feet.append(_feet(estimate))
    floor = Floor(math.nan, math.nan) if not feet else _floor(np.array(feet), parameters.legs.foot_radius)
    return find_mounting(looks, floor, parameters.sensors)


def _floor(feet: FloatArray, radius: float) -> Floor:
    """The floor under (n, 4, 3) m feet in the odometry frame."""
    middle = np.median(feet, axis=0)
    away = middle - middle.mean(axis=0)
    slope, *_ = np.linalg.lstsq(away[:, :2], away[:, 2], rcond=None)
    return Floor(float(middle[:, 2].mean()) - radius, math.atan(math.hypot(*slope.tolist())))


def _feet(estimate: BodyState) -> FloatArray:
    """(4, 3) m, foot points in the odometry frame."""
    turned = estimate.foot_position_in_base @ rotation_from_quaternion(estimate.quaternion).T
    return np.asarray(turned + estimate.position)


def _has_map(telemetry: Telemetry) -> bool:
    return telemetry.crossing is not None and telemetry.crossing.ground is not None


def _seen(ground: HeightMap) -> BoolArray:
    return np.isfinite(ground.height) & (ground.confidence >= _SEEN)


def _from_robot(ground: HeightMap, estimate: BodyState) -> tuple[FloatArray, FloatArray]:
    """(n, m) m ahead of the robot and to its left, of the cells' centres."""
    away = centres(ground) - estimate.position[:2]
    c, s = math.cos(estimate.rpy[2]), math.sin(estimate.rpy[2])
    return c * away[..., 0] + s * away[..., 1], c * away[..., 1] - s * away[..., 0]


def _within(ground: HeightMap, estimate: BodyState) -> BoolArray:
    return np.hypot(*_from_robot(ground, estimate)) <= REACH


def _deviations(run: RunData, k: int, ground: HeightMap) -> FloatArray:
    """(n,) m, heights of a tick's map less the true ones, cells that were seen within reach.

    Empty where the true ground is not known by geometry, or on a robot that is no simulated one.
    """
    world = build(WorldConfig, run.config["sim"]["world"], "sim.world")
    plan = world_plan(world, run.config["run"]["seed"])
    level = world.name == "flat" and world.slope == 0.0
    if k >= len(run.truth) or (plan is None and not level):
        return np.zeros(0)
    estimate = run.telemetry[k].estimate
    chosen = _seen(ground) & _within(ground, estimate)
    points = np.column_stack((centres(ground)[chosen], ground.height[chosen] + ground.pose[2]))
    points = in_truth(points, estimate, run.truth[k])
    true = np.zeros(len(points)) if plan is None else heights(plan, points[:, :2])
    return np.asarray(points[:, 2] - true)


def _errors(deviations: FloatArray) -> dict[str, Any]:
    if not deviations.size:
        return {"map_error_median_mm": None, "map_error_95_mm": None}
    found = 1e3 * np.abs(deviations)
    return {
        "map_error_median_mm": float(np.median(found)),
        "map_error_95_mm": float(np.percentile(found, 95.0)),
    }
