"""What the live view shows around the robot: leader, newest sweep, waypoints, the marker as believed."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.geometry import rotation_from_quaternion
from bluefoot_mpc.types import FloatArray, LidarScan, Telemetry, TruthSample
from bluefoot_mpc.viz.live_ground import LiveGround
from bluefoot_mpc.viz.packing import stride_for
from bluefoot_mpc.viz.scans import is_usable
from bluefoot_mpc.viz.series import estimated_q
from bluefoot_mpc.viz.stage import Stage, wheel_steering
from bluefoot_mpc.viz.stage_motion import RAYS
from bluefoot_mpc.wheels.ready import READY


class LiveSurroundings:
    """Keeps what has to be carried from tick to tick; `note` is for every tick, `state` for those drawn.

    Args:
        stage: what stands and moves around the robot.
        mount: (3,) m, the LIDAR in the base frame.
        turn: (3, 3) rotation from the LIDAR's frame to the base frame; None for one that is not turned.
    """

    def __init__(
        self, stage: Stage, mount: tuple[float, float, float], turn: FloatArray | None = None
    ) -> None:
        self._wheeled = READY[stage.leader]() if stage.leader in READY else None
        self._mount = np.array(mount)
        self._turn = np.eye(3) if turn is None else turn
        self._ground = LiveGround(stage.foot_radius)
        self._sweep: tuple[FloatArray, LidarScan] | None = None
        self._time: float | None = None
        self._turned = np.zeros(0)
        self._last: tuple[float, FloatArray] | None = None
        self._steered = np.zeros(0)

    def note(self, telemetry: Telemetry, truth: TruthSample | None, scan: LidarScan | None) -> None:
        """Take in a tick; returns at once."""
        self._ground.note(telemetry)
        if is_usable(scan):
            self._sweep = (estimated_q(telemetry) if truth is None else truth.q, scan)
        if truth is None or self._wheeled is None:
            return
        step = 0.0 if self._time is None else truth.time - self._time
        self._time = truth.time
        if len(self._turned) != len(truth.leader_wheels) or not 0.0 <= step < 1.0:
            self._turned, step = np.zeros(len(truth.leader_wheels)), 0.0
        self._turned = self._turned + step * truth.leader_wheels

    def state(self, telemetry: Telemetry, truth: TruthSample | None) -> dict[str, Any]:
        """What the page needs besides the robot; each sweep is told once."""
        found: dict[str, Any] = {}
        sweep, self._sweep = self._sweep, None
        if sweep is not None:
            found["sweep"] = sweep_points(*sweep, self._mount, self._turn)
        if truth is not None and self._wheeled is not None and np.isfinite(truth.leader[0]):
            found["leader"] = truth.leader
            found["turned"], found["steered"] = self._turned, self._steering(truth)
        report, guide = telemetry.navigation, telemetry.motion.guide
        if report is not None:
            found["guided"] = str(report.guided)
            found["reason"] = report.reason
            if np.isfinite(report.marker_position).all():
                found["marker"] = report.marker_position
        if guide is not None and len(guide.waypoints):
            left = 0 if report is None else report.waypoints_left
            found["waypoints"] = guide.waypoints
            found["reached"] = max(0, len(guide.waypoints) - left)
        return found | self._ground.state(telemetry)

    def _steering(self, truth: TruthSample) -> FloatArray:
        """(k,) rad, how the wheels stand, from the way between the states drawn."""
        if self._wheeled is None:
            return np.zeros(0)
        if self._last is None or not 0.0 < truth.time - self._last[0] < 1.0:
            self._last = (truth.time, truth.leader)
        elif truth.time - self._last[0] > 0.1:
            time = np.array([self._last[0], truth.time])
            self._steered = wheel_steering(self._wheeled, np.array([self._last[1], truth.leader]), time)[-1]
            self._last = (truth.time, truth.leader)
        return self._steered


def sweep_points(q: FloatArray, scan: LidarScan, mount: FloatArray, turn: FloatArray) -> list[int]:
    """(3 k,) mm, ends of some rays of a sweep, one after the other, in the frame of `q`.

    Args:
        q: (7,) or longer: trunk position (m) and quaternion.
        scan: the sweep.
        mount: (3,) m, the LIDAR in the base frame.
        turn: (3, 3) rotation from the LIDAR's frame to the base frame.
    """
    every = stride_for(len(scan.bearing), RAYS)
    distance, bearing = scan.distance[::every], scan.bearing[::every]
    met = np.isfinite(distance) & (distance > 0.02)
    rays = np.column_stack([np.cos(bearing[met]), np.sin(bearing[met]), np.zeros(met.sum())])
    points = q[:3] + (mount + distance[met, None] * rays @ turn.T) @ rotation_from_quaternion(q[3:7]).T
    millimetres: list[int] = np.round(1e3 * points).astype(int).ravel().tolist()
    return millimetres
