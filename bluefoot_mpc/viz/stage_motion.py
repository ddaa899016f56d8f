"""What moves around a recorded robot: the leader and the LIDAR's sweeps, as numbers for the 3D replay."""

from __future__ import annotations

import base64
from dataclasses import replace
from typing import Any

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import FloatArray, LidarScan
from bluefoot_mpc.viz.animation import animation_data
from bluefoot_mpc.viz.crossing_series import CrossingSeries
from bluefoot_mpc.viz.packing import pack, stride_for
from bluefoot_mpc.viz.scans import is_usable, known_plan
from bluefoot_mpc.viz.scene import build_scene
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.stage import Stage, stage_data, stage_of, wheel_angles, wheel_steering
from bluefoot_mpc.viz.stage_ground import terrain_data
from bluefoot_mpc.wheels.ready import READY

MAX_SWEEPS = 1200
"""Most sweeps that a page carries: two minutes at 10 Hz; longer runs show every other one, and so on."""
RAYS = 230
"""Most rays of a sweep that a page carries."""
_LEADER_ROWS = 1500


def replay_data(
    run: RunData, series: RunSeries, robot: RobotModel, crossing: CrossingSeries | None = None
) -> dict[str, Any]:
    """Everything that the 3D replay of a run needs, ready for JSON.

    Args:
        run: the run.
        series: its time series.
        robot: the robot that ran.
        crossing: how it crossed rough ground; None where it did not.
    """
    parameters = robot.parameters
    radius = parameters.legs.foot_radius
    below = radius if series.has_truth else 0.0
    data = animation_data(build_scene(robot), series, radius)
    data |= moving_data(run, series, parameters.sensors, below)
    if crossing is None:
        return data
    return {"rough": {"floor": 0.0, "below": below}, **data, "terrain": terrain_data(crossing)}


def moving_data(
    run: RunData, series: RunSeries, mounts: SensorMounts, foot_radius: float = 0.0
) -> dict[str, Any]:
    """Surroundings, leader and sweeps of a run, ready for JSON; empty for a run on open floor without any.

    Args:
        run: the run.
        series: its time series.
        mounts: where the sensors are.
        foot_radius: m, from the feet of the series down to the ground.
    """
    moves = any(np.isfinite(sample.leader[:1]).any() for sample in run.truth[:1])
    stage = stage_of(run.config)
    stage = Stage(plan=known_plan(run, mounts), leader=stage.leader if moves else "")
    sweeps = _sweeps(run, series, mounts)
    if stage == Stage() and sweeps is None:
        return {}
    data = stage_data(replace(stage, foot_radius=foot_radius))
    if data["leader"] is not None:
        data["leader"] |= _leader(run, series, stage.leader)
    waypoints = [record.motion.guide.waypoints for record in run.telemetry if record.motion.guide is not None]
    return {**data, "sweeps": sweeps, "waypoints": waypoints[-1].tolist() if waypoints else []}


def _leader(run: RunData, series: RunSeries, kind: str) -> dict[str, Any]:
    n = len(series.time)
    wheeled = READY[kind]()
    pose = np.array([sample.leader for sample in run.truth[:n]])
    speeds = np.array([sample.leader_wheels for sample in run.truth[:n]]).reshape(n, -1)
    turned = wheel_angles(speeds, series.time)
    if turned.shape[1] != len(wheeled.wheels):
        turned = np.zeros((n, len(wheeled.wheels)))
    pick = slice(None, None, max(5, stride_for(n, _LEADER_ROWS)))
    time, shown = series.time[pick], pose[pick]
    return {
        "time": pack(time),
        "pose": pack(shown),
        "turned": pack(turned[pick]),
        "steered": pack(wheel_steering(wheeled, shown, time)),
    }


def _sweeps(run: RunData, series: RunSeries, mounts: SensorMounts) -> dict[str, Any] | None:
    """Distances of a part of the rays of a part of the sweeps; None without any."""
    scans = [frame.lidar for frame in run.frames[: len(series.time)] if is_usable(frame.lidar)]
    if not scans:
        return None
    start = run.telemetry[0].time
    # All sweeps of a device have the same rays; one that differs is left out.
    rays = len(scans[0].bearing)
    scans = [scan for scan in scans if len(scan.bearing) == rays]
    scans = scans[:: stride_for(len(scans), MAX_SWEEPS)]
    every = stride_for(rays, RAYS)
    millimetres = np.array([to_millimetres(scan, every) for scan in scans])
    return {
        "mount": [float(x) for x in mounts.lidar],
        **({"turn": mounts.lidar_rotation.ravel().tolist()} if any(mounts.lidar_rpy_deg) else {}),
        "bearing": pack(scans[0].bearing[::every]),
        "time": pack([scan.time - start for scan in scans]),
        "distance": base64.b64encode(millimetres.tobytes()).decode("ascii"),
    }


def to_millimetres(scan: LidarScan, every: int) -> np.ndarray[Any, np.dtype[np.uint16]]:
    """(k,) little-endian distances of every so many rays, mm; 0 where no echo came back."""
    distance: FloatArray = 1e3 * np.nan_to_num(scan.distance[::every], nan=0.0, posinf=0.0, neginf=0.0)
    return np.clip(np.round(distance), 0, 65535).astype("<u2")
