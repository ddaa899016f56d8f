"""A made-up run that finds its way: the trot of `synthetic_run` in a room, with a leader."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from bluefoot_mpc.geometry import quaternion_from_rpy, rpy_from_quaternion
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.make import make_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import (
    CameraImage,
    FloatArray,
    Guide,
    Guided,
    GuideTask,
    LidarScan,
    NavigationReport,
)

from .synthetic_run import make_run

SEED = 3
RADIUS, RATE = 1.2, 0.06
"""m and rad/s of the circle that the robot goes."""
DRIFT = 0.01
"""m/s that the estimate runs away to the left."""
BEARING = np.radians(np.linspace(-120.0, 120.0, 682))
FOCAL = 522.0
WANTED = 0.7


def room() -> WorldPlan:
    return make_plan("room", SEED)


def navigating_run(
    robot: RobotModel, *, duration: float = 12.0, truth: bool = True, camera: bool = True, leader: bool = True
) -> RunData:
    """The run; the marker is in view from 3 s on, but for the time from 6 s to 8 s."""
    run = make_run(robot, duration=duration, truth=True, seed=SEED)
    plan = room()
    run.config = {
        **run.config,
        "run": {"scenario": "follow", "seed": SEED, "robot": "sim", "controller": "mpc"},
        "sim": {"world": {"name": "room"}, "leader": {"kind": "differential" if leader else ""}},
    }
    for k, sample in enumerate(list(run.truth)):
        time = sample.time
        pose, q = _on_circle(time, sample.q)
        near = _nearest(pose[:2], plan) - 0.2
        marker, leader_pose = _leader(time)
        run.truth[k] = dataclasses.replace(
            sample, q=q, clearance=near, collisions=("chair1",) if 100 <= k < 103 else (),
            foot_position=_moved(sample.foot_position - [sample.q[0], 0, 0], pose),
            marker=marker, leader=leader_pose if leader else np.full(7, np.nan),
            leader_wheels=np.array([2.0, 2.5]) if leader else np.zeros(0),
        )  # fmt: skip
        _think(run, k, pose, near, marker)
        _sense(run, k, pose, plan, marker, camera)
        run.keep_picture(run.frames[k], run.telemetry[k])
        run.frames[k] = dataclasses.replace(run.frames[k], camera=None)
    if not truth:
        run.truth.clear()
        run.config.pop("sim")
    return run


def _on_circle(time: float, q: FloatArray) -> tuple[FloatArray, FloatArray]:
    angle = RATE * max(0.0, time - 1.0)
    pose = np.array([RADIUS * math.sin(angle), RADIUS * (1 - math.cos(angle)), angle])
    rpy = rpy_from_quaternion(q[3:7]) + np.array([0, 0, angle])
    return pose, np.concatenate([pose[:2], q[2:3], quaternion_from_rpy(rpy), q[7:]])


def _moved(points: FloatArray, pose: FloatArray) -> FloatArray:
    c, s = math.cos(pose[2]), math.sin(pose[2])
    x, y, z = points.T
    return np.column_stack([pose[0] + c * x - s * y, pose[1] + s * x + c * y, z])


def _nearest(point: FloatArray, plan: WorldPlan) -> float:
    return min(float(footprint.distance(point[None], solid)[0]) for solid in plan.solids)


def _leader(time: float) -> tuple[FloatArray, FloatArray]:
    angle = RATE * max(0.0, time - 1.0) + 0.55
    x, y = RADIUS * math.sin(angle), RADIUS * (1 - math.cos(angle))
    pose = np.concatenate([[x, y, 0.03], quaternion_from_rpy(np.array([0.0, 0.0, angle]))])
    return np.array([x, y, 0.2]), pose


def seen(time: float) -> bool:
    return time >= 3.0 and not 6.0 <= time < 8.0


def _think(run: RunData, k: int, pose: FloatArray, near: float, marker: FloatArray) -> None:
    record = run.telemetry[k]
    time = record.time
    drifted = np.array([pose[0], pose[1] + DRIFT * time, record.estimate.position[2]])
    rpy = record.estimate.rpy + np.array([0, 0, pose[2]])
    estimate = dataclasses.replace(
        record.estimate, position=drifted, rpy=rpy, quaternion=quaternion_from_rpy(rpy)
    )
    report = None
    motion = record.motion
    if time >= 1.0:
        visible = seen(time)
        age = 0.0 if visible else time - 6.0 if time >= 6.0 else np.inf
        guided = Guided.MARKER if visible else Guided.SEARCH if age > 1.0 else Guided.FIELD
        report = NavigationReport(
            guided=guided, velocity=np.array([0.07, 0.0]), yaw_rate=RATE, pitch=0.0,
            field=np.array([10.0, 3.0]), potential=0.1, mixing=float(visible),
            marker=pixels(pose, marker) if visible else np.full(3, np.nan),
            marker_position=marker + np.array([0, DRIFT * time, 0]) if time >= 3.0 else np.full(3, np.nan),
            marker_age=age, clearance=near + 0.02 if time < 10.0 else np.inf, scan_time=time,
        )  # fmt: skip
        motion = dataclasses.replace(
            motion, guide=Guide(task=GuideTask.FOLLOW, distance=WANTED, waypoints=np.array([[1.0, 0.5]]))
        )
    run.telemetry[k] = dataclasses.replace(record, estimate=estimate, motion=motion, navigation=report)


def pixels(pose: FloatArray, marker: FloatArray) -> FloatArray:
    """(3,) where a pin-hole camera above the trunk's origin shows the marker."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    dx, dy = marker[:2] - pose[:2]
    ahead, left = max(0.2, c * dx + s * dy), c * dy - s * dx
    return np.array([320 - FOCAL * left / ahead, 240 - FOCAL * 0.02 / ahead, FOCAL * 0.06 / ahead])


def _sense(run: RunData, k: int, pose: FloatArray, plan: WorldPlan, marker: FloatArray, camera: bool) -> None:
    if k % 5:
        return
    time = run.frames[k].time
    distance = cast(pose, plan)
    picture = None
    if camera:
        image = np.full((480, 640, 3), (150, 160, 175), dtype=np.uint8)
        image[300:] = (120, 116, 110)
        if seen(time):
            column, row, radius = pixels(pose, marker)
            v, u = np.mgrid[:480, :640]
            image[(u - column) ** 2 + (v - row) ** 2 < radius**2] = (230, 26, 140)
        picture = CameraImage(time=time, pixels=image, valid=True)
    run.frames[k] = dataclasses.replace(
        run.frames[k], lidar=LidarScan(time=time, bearing=BEARING, distance=distance, valid=True),
        camera=picture,
    )  # fmt: skip


def cast(pose: FloatArray, plan: WorldPlan) -> FloatArray:
    """(682,) m to the first thing along each ray from a LIDAR over the trunk's origin, by marching."""
    angle = pose[2] + BEARING
    step = np.column_stack([np.cos(angle), np.sin(angle)])
    way = np.zeros(len(BEARING))
    for _ in range(40):
        points = pose[:2] + [0.04 * math.cos(pose[2]), 0.04 * math.sin(pose[2])] + way[:, None] * step
        way += np.maximum(0.0, np.min([footprint.distance(points, solid) for solid in plan.solids], axis=0))
    return np.where(way > 5.6, np.nan, way)
