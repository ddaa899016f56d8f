"""What the LIDAR measured, laid into the frame in which the robot was drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.geometry import rotation_z
from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.navigation.scan import LevelScan, ScanConfig, ScanReader
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.types import FloatArray

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
    _, first = np.unique(cells, axis=0, return_index=True)
    kept = points[np.sort(first)]
    return np.asarray(kept[:: max(1, -(-len(kept) // most))])
