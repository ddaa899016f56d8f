"""The cloud of a run: what its LIDAR met of the ground, as the robot believed."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import zip_longest

import numpy as np

from bluefoot_mpc.terrain.cloud import Cloud, join
from bluefoot_mpc.types import SensorFrame, Telemetry


def run_cloud(telemetry: Iterable[Telemetry], frames: Iterable[SensorFrame] = ()) -> Cloud:
    """All points that a run's controller took of its scans, odometry frame; empty where it took none.

    Args:
        telemetry: of the run, oldest first.
        frames: of the same ticks: a scan's own time stamp is better than that of the tick that used it.
    """
    clouds = []
    for record, frame in zip_longest(telemetry, frames):
        if record is None or record.crossing is None or not len(record.crossing.points):
            continue
        points = record.crossing.points
        scan = None if frame is None else frame.lidar
        clouds.append(Cloud(points, np.full(len(points), record.time if scan is None else scan.time)))
    return join(clouds)
