"""How much of the floor a run's LIDAR saw."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.coverage import lidar_pose, reachable, seen_fraction
from bluefoot_mpc.sim.worlds.make import world_plan


def seen_figures(run: RunData) -> Mapping[str, Any]:
    """Share of the floor that the robot can get at that its scans showed; null without a plan."""
    plan = world_plan(build(WorldConfig, run.config["sim"]["world"], "sim.world"), run.config["run"]["seed"])
    if plan is None or not run.truth:
        return {"reachable_m2": None, "seen_percent": None}
    mount = np.array(run.config["model"]["sensors"]["lidar"])
    # Scans were taken in the true world: where they show what is judged by where the robot truly was.
    looks = [(f.lidar, t.q) for f, t in zip(run.frames, run.truth, strict=False) if f.lidar is not None]
    grid = reachable(plan)
    poses = [lidar_pose(q, mount) for _, q in looks]
    seen = seen_fraction(grid, poses, [scan for scan, _ in looks])
    return {"reachable_m2": grid.area, "seen_percent": 100.0 * seen}
