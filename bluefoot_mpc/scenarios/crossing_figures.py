"""Figures of runs over rough ground: the goal line, the map against the truth, where the feet came down."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.terrain.frame import centres
from bluefoot_mpc.types import BodyState, FloatArray, HeightMap, TruthSample

MAP_REACH = 1.2
"""m from the trunk, within which a map is compared with the truth."""
TOPPLED_DEG = 50.0
"""degrees of tilt, beyond which a robot has toppled; a sweep takes it to 34."""
_SEEN = 0.5
"""Confidence from which a cell counts as seen, not as assumed."""


def crossing_figures(run: RunData, goal: float, tolerance: float) -> dict[str, Any]:
    """How far the robot came, and how well it knew and met the ground.

    Args:
        run: the run.
        goal: m ahead of the start.
        tolerance: m, before the line, that counts as there.
    """
    reports = [t.crossing for t in run.telemetry if t.crossing is not None]
    spent = Counter(str(report.phase) for report in reports)
    return {
        **progress(run, goal, tolerance),
        "toppled": toppled(run),
        "touched": touched(run),
        "sweeps": reports[-1].sweeps if reports else 0,
        "phase_s": {name: round(count * run.period, 2) for name, count in sorted(spent.items())},
        "blocked": next((r.reason for r in reversed(reports) if r.phase == "blocked"), None),
        "drift_corrected_mm": [round(1e3 * r.drift, 1) for r in reports if r.ground is not None],
        **map_errors(run),
        **foothold_errors(run),
    }


def progress(run: RunData, goal: float, tolerance: float) -> dict[str, Any]:
    """How much of the way to the goal line was left at best, and when the robot was there; truth."""
    if not run.truth:
        return {"goal_left_m": None, "reached_s": None, "progress_m": None}
    time = np.array([sample.time for sample in run.truth])
    position = np.array([sample.q[:2] for sample in run.truth])
    forward = rotation_from_quaternion(run.truth[0].q[3:7])[:2, 0]
    way = (position - position[0]) @ (forward / np.linalg.norm(forward))
    there = np.flatnonzero(way >= goal - tolerance)
    return {
        "goal_left_m": float(goal - way.max()),
        "reached_s": float(time[there[0]]) if there.size else None,
        "progress_m": float(way[-1]),
    }


def toppled(run: RunData) -> bool | None:
    """Whether the robot lay on its trunk or on its side, by the truth; links that touch do not count here."""
    if not run.truth:
        return None
    upright = math.cos(math.radians(TOPPLED_DEG))
    return any(
        "trunk" in sample.touching or rotation_from_quaternion(sample.q[3:7])[2, 2] < upright
        for sample in run.truth
    )


def touched(run: RunData) -> dict[str, float] | None:
    """S for which each part above a foot's ball touched anything, the longest first; None without truth."""
    if not run.truth:
        return None
    ticks = Counter(name for sample in run.truth for name in sample.touching)
    return {name: round(count * run.period, 2) for name, count in ticks.most_common()}


def map_errors(run: RunData) -> dict[str, Any]:
    """Errors of all maps' seen cells within `MAP_REACH` of the robot: true place, true height."""
    plan = world_plan(build(WorldConfig, run.config["sim"]["world"], "sim.world"), run.config["run"]["seed"])
    errors = [
        _errors(t.crossing.ground, t.estimate, truth, plan)
        for t, truth in zip(run.telemetry, run.truth, strict=False)
        if plan is not None and t.crossing is not None and t.crossing.ground is not None
    ]
    if not errors:
        return {"map_error_median_mm": None, "map_error_95_mm": None, "map_cells": 0}
    found = np.abs(np.concatenate(errors))
    return {
        "map_error_median_mm": 1e3 * float(np.median(found)) if found.size else None,
        "map_error_95_mm": 1e3 * float(np.percentile(found, 95.0)) if found.size else None,
        "map_cells": int(found.size),
    }


def foothold_errors(run: RunData) -> dict[str, Any]:
    """Horizontal distances from chosen footholds to where the feet truly came down."""
    missed: list[float] = []
    for before, now, truth in zip(run.telemetry, run.telemetry[1:], run.truth[1:], strict=False):
        if before.crossing is None:
            continue
        landed = before.phase.swing & ~now.phase.swing & np.isfinite(before.crossing.footholds[:, 0])
        if not landed.any():
            continue
        wanted = in_truth(before.crossing.footholds[landed], now.estimate, truth)
        missed += np.hypot(*(truth.foot_position[landed] - wanted)[:, :2].T).tolist()
    return {
        "footholds": len(missed),
        "foothold_error_median_mm": 1e3 * float(np.median(missed)) if missed else None,
        "foothold_error_95_mm": 1e3 * float(np.percentile(missed, 95.0)) if missed else None,
    }


def in_truth(points: FloatArray, estimate: BodyState, truth: TruthSample) -> FloatArray:
    """(n, 3) m in world of points that the robot believes to be at (n, 3) m in the odometry frame."""
    in_base = (points - estimate.position) @ rotation_from_quaternion(estimate.quaternion)
    return np.asarray(in_base @ rotation_from_quaternion(truth.q[3:7]).T + truth.q[:3])


def _errors(ground: HeightMap, estimate: BodyState, truth: TruthSample, plan: WorldPlan) -> FloatArray:
    """(k,) m, height errors of a map's seen cells near the robot."""
    places = centres(ground)
    near = np.hypot(*(places - estimate.position[:2]).transpose(2, 0, 1)) <= MAP_REACH
    seen = near & np.isfinite(ground.height) & (ground.confidence >= _SEEN)
    points = np.column_stack((places[seen], ground.height[seen] + ground.pose[2]))
    points = in_truth(points, estimate, truth)
    return np.asarray(points[:, 2] - heights(plan, points[:, :2]))
