"""A made-up run over rough ground: two sweeps and the trot of `synthetic_run` between them, over rubble."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy, rotation_from_rpy
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds.heights import Relief
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import (
    CrossingPhase,
    CrossingReport,
    FloatArray,
    Guide,
    GuideTask,
    HeightMap,
    LidarScan,
)

from .synthetic_run import make_run

SEED = 4
WORLD = "rubble"
BEGIN, WALKS, ENDS = 0.2, 1.0, 6.0
"""s: beginning of the first sweep, of the walk and of the second sweep."""
DRIFT = 0.002
"""m/s that the estimate runs away to the left."""
GOAL = np.array([0.4, 0.0])
CELL = 0.02
LIFT = 0.03
RADIUS = 0.008
"""m, of the balls that the feet end in: the estimate counts heights from their middles."""
BEARING = np.radians(np.linspace(-119.9, 119.9, 171))
LIDAR = np.array([0.04, 0.0, 0.127])


def rubble(world: str = WORLD) -> WorldPlan:
    plan = world_plan(WorldConfig(name=world), SEED)
    assert plan is not None
    return plan


def crossing_run(
    robot: RobotModel,
    *,
    duration: float = 8.0,
    truth: bool = True,
    world: str = WORLD,
    blocked: bool = False,
) -> RunData:
    """The run; where it is `blocked` nothing is mapped, planned or chosen."""
    run = make_run(robot, duration=duration, truth=True, seed=SEED)
    plan = rubble(world)
    ground = Relief(plan.solids, plan.floor)
    run.config = {
        "run": {"scenario": "rough", "seed": SEED, "robot": "sim", "controller": "mpc"},
        "sim": {"world": {"name": world}},
        "control": {},
    }
    rng = np.random.default_rng(SEED)
    for k, sample in enumerate(list(run.truth)):
        feet = sample.foot_position.copy()
        under = ground.height(feet[:, :2])
        feet[:, 2] = np.maximum(feet[:, 2], feet[:, 2] + under)
        pitch = _pitch(sample.time)
        rpy = np.array([0.0, pitch, 0.0])
        q = np.concatenate([sample.q[:3], quaternion_from_rpy(rpy), sample.q[7:]])
        run.truth[k] = dataclasses.replace(sample, foot_position=feet, q=q, external_force=np.zeros(3))
        _think(run, k, rpy, ground, rng, blocked=blocked)
    if not truth:
        run.truth.clear()
        run.config.pop("sim")
    return run


def _sweeping(time: float) -> bool:
    return BEGIN <= time < WALKS - 0.1 or ENDS <= time < ENDS + 1.0


def _pitch(time: float) -> float:
    start = BEGIN if time < WALKS else ENDS
    return math.radians(12.0 + 20.0 * (time - start)) if _sweeping(time) else 0.0


def _phase(time: float, blocked: bool) -> CrossingPhase | None:
    if time < BEGIN:
        return None
    if blocked and time >= WALKS:
        return CrossingPhase.BLOCKED
    if time >= ENDS + 1.5:
        return CrossingPhase.ARRIVED
    if _sweeping(time):
        return CrossingPhase.SWEEP
    return CrossingPhase.THINK if time < WALKS or time >= ENDS else CrossingPhase.WALK


def _think(
    run: RunData, k: int, rpy: FloatArray, ground: Relief, rng: np.random.Generator, *, blocked: bool
) -> None:
    record, truth = run.telemetry[k], run.truth[k]
    time = record.time
    away = np.array([0.0, DRIFT * time, -RADIUS])
    estimate = dataclasses.replace(
        record.estimate, position=truth.q[:3] + away, rpy=rpy, quaternion=quaternion_from_rpy(rpy),
        foot_position_in_base=(truth.foot_position - truth.q[:3]) @ rotation_from_rpy(rpy),
    )  # fmt: skip
    phase = _phase(time, blocked)
    report, motion = None, record.motion
    if phase is not None:
        points = _scan(run, k, rpy, ground, rng) if phase is CrossingPhase.SWEEP else np.zeros((0, 3))
        fresh = k in {round((WALKS - 0.05) / run.period), round((ENDS + 1.2) / run.period)} and not blocked
        swing = record.phase.swing & record.phase.walking
        aim = np.where(swing[:, None], _next_landing(run, k) + away, np.nan)
        report = CrossingReport(
            phase=phase, level=int((time - BEGIN) / 0.1) if phase is CrossingPhase.SWEEP else -1,
            pitch=float(rpy[1]), points=points + away if len(points) else points,
            ground=_map(time, estimate.position, away, ground, rng) if fresh else None,
            route=_route(estimate.position) if fresh else np.zeros((0, 3)),
            footholds=np.full((4, 3), np.nan) if blocked else aim,
            lift=np.where(swing, LIFT, np.nan), speed=0.03 if phase is CrossingPhase.WALK else 0.0,
            sweeps=int(time >= WALKS) + int(time >= ENDS + 1.0),
            drift=0.004 if fresh and time > WALKS else 0.0,
            reason="no way over a gap of 90 mm" if phase is CrossingPhase.BLOCKED else "",
        )  # fmt: skip
        motion = dataclasses.replace(motion, guide=Guide(task=GuideTask.CROSS, waypoints=GOAL[None]))
    run.telemetry[k] = dataclasses.replace(record, estimate=estimate, motion=motion, crossing=report)


def _next_landing(run: RunData, k: int) -> FloatArray:
    """(4, 3) m, where the feet are to come down: some millimetres ahead of where they are."""
    return run.truth[k].foot_position - [0, 0, RADIUS] + np.array([0.006, 0.0, 0.0])


def _scan(run: RunData, k: int, rpy: FloatArray, ground: Relief, rng: np.random.Generator) -> FloatArray:
    """(m, 3) m in world, what a sweep of the LIDAR truly meets, by marching; it goes into the frame, too."""
    if k % 5:
        return np.zeros((0, 3))
    turn = rotation_from_rpy(rpy)
    start = run.truth[k].q[:3] + turn @ LIDAR
    rays = np.column_stack([np.cos(BEARING), np.sin(BEARING), np.zeros(len(BEARING))]) @ turn.T
    # From above the highest ground down to below the lowest.
    down = np.where(rays[:, 2] < -0.08, -rays[:, 2], np.nan)
    away = (start[2] - np.linspace(0.08, -0.09, 60)[:, None]) / down
    along = start + away[..., None] * rays
    met = np.isfinite(down)
    below = along[..., 2] <= np.nan_to_num(ground.height(along[..., :2])) + 1e-9
    ends = np.take_along_axis(away, np.argmax(below, axis=0)[None], axis=0)[0]
    distance = ends + rng.normal(0.0, 0.003, len(BEARING))
    run.frames[k] = dataclasses.replace(
        run.frames[k],
        lidar=LidarScan(time=run.frames[k].time, bearing=BEARING, distance=distance, valid=True),
    )
    return start + distance[met, None] * rays[met]


def _map(
    time: float, position: FloatArray, away: FloatArray, ground: Relief, rng: np.random.Generator
) -> HeightMap:
    """Forward of the robot, with an unknown corner."""
    corner = np.array([position[0] - 0.4, position[1] - 0.5])
    y, x = np.mgrid[:50, :70]
    places = corner + CELL * (np.stack([x, y], axis=-1) + 0.5) - away[:2]
    height = ground.height(places) + rng.normal(0.0, 0.002, (50, 70))
    height[30:, 50:] = np.nan
    known = np.isfinite(height)
    return HeightMap(
        time=time, cell=CELL, pose=np.array([*corner, away[2], 0.0]), height=height,
        confidence=np.where(known, rng.uniform(0.6, 1.0, (50, 70)), 0.0),
    )  # fmt: skip


def _route(position: FloatArray) -> FloatArray:
    x = np.linspace(position[0], max(float(GOAL[0]), position[0] + 0.1), 12)
    return np.column_stack([x, position[1] + 0.03 * np.sin(4.0 * (x - position[0])), np.zeros(12)])
