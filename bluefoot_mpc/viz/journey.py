"""The part of a report that shows how the robot found its own way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds.coverage import Coverage, lidar_pose, reachable
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.types import FloatArray
from bluefoot_mpc.viz.camera_strip import Overlay, camera_strip, kept_pictures
from bluefoot_mpc.viz.guided_series import GuidedSeries, extract_guided
from bluefoot_mpc.viz.packing import pack
from bluefoot_mpc.viz.plots import Panel, Trace
from bluefoot_mpc.viz.plots_field import field_pictures, navigation_config
from bluefoot_mpc.viz.plots_map import world_map
from bluefoot_mpc.viz.plots_marker import distances, in_picture
from bluefoot_mpc.viz.plots_way import way_over_time
from bluefoot_mpc.viz.scans import cloud, is_usable, known_plan, read_scans
from bluefoot_mpc.viz.series import RunSeries

_MOST_SCANS = 1500
"""Sweeps that the page looks at, spread over the run."""
_MOST_POINTS = 6000
"""Points of the map that the LIDAR made."""


@dataclass(frozen=True, kw_only=True, slots=True)
class Journey:
    """What a page shows of finding the way.

    Attributes:
        guided: as arrays over time.
        plan: of the world; None where it is not known.
        panels: figures, in their order.
        strip: pictures of the camera.
    """

    guided: GuidedSeries
    plan: WorldPlan | None
    panels: tuple[Panel, ...]
    strip: tuple[Overlay, ...]

    @property
    def strip_after(self) -> str:
        """Key of the figure behind which the pictures stand."""
        keys = [panel.key for panel in self.panels]
        return "way" if "way" in keys else keys[-1]


def journey_of(run: RunData, series: RunSeries, robot: RobotModel) -> Journey | None:
    """How a run found its way; None where it was told where to go and no LIDAR looked on.

    Args:
        run: the run.
        series: its time series.
        robot: the robot that ran.
    """
    if crosses_only(run):
        # Its sweeps look down at the ground: a map of what stands around would be made of it.
        return None
    mounts = robot.parameters.sensors
    guided = extract_guided(run, series, mounts)
    if guided is None:
        return None
    plan, config = known_plan(run, mounts), navigation_config(run.config)
    n = len(series.time)
    scans = read_scans(run, n, mounts, config.scan, most=_MOST_SCANS)
    pictures = kept_pictures(run)
    seen = _seen_floor(run, n, plan, np.asarray(mounts.lidar)) if plan is not None and run.truth else []
    overview, field = (
        world_map(series, guided, plan, cloud(run, scans, _MOST_POINTS), seen),
        field_pictures(guided, scans, config),
    )
    panels = [replace(overview, wide=True)] if field is None else [overview, field]
    if guided.reports.any():
        panels.append(way_over_time(series, guided, run.period))
    if guided.looks_for_a_marker:
        width = pictures[0].pixels.shape[1] * pictures[0].shrunk if pictures else 0
        panels += [in_picture(guided, width), distances(guided, run.period)]
    strip = camera_strip(pictures, guided, mounts.camera_view_deg, run.telemetry[0].time)
    return Journey(guided=guided, plan=plan, panels=tuple(panels), strip=tuple(strip))


def crosses_only(run: RunData) -> bool:
    """True of a run that looks at the ground with its LIDAR, and at nothing else."""
    crosses = any(record.crossing is not None for record in run.telemetry)
    return crosses and all(record.navigation is None for record in run.telemetry)


def _seen_floor(run: RunData, n: int, plan: WorldPlan, mount: FloatArray) -> list[Trace]:
    """The floor that the robot can get at: what its LIDAR saw, and what not."""
    coverage = Coverage(reachable(plan))
    grid = coverage.grid
    if not grid.floor.any():
        return []
    for frame, truth in zip(run.frames[:n], run.truth[:n], strict=True):
        if is_usable(frame.lidar):
            coverage.add(lidar_pose(truth.q, mount), frame.lidar)
    rows, columns = grid.floor.shape
    shown = np.where(grid.floor, coverage.seen, np.nan)
    return [
        {
            "type": "heatmap",
            "x": pack(grid.corner[0] + (np.arange(columns) + 0.5) * grid.cell),
            "y": pack(grid.corner[1] + (np.arange(rows) + 0.5) * grid.cell),
            "z": pack(shown),
            "zmin": 0.0,
            "zmax": 1.0,
            "colorscale": [[0.0, "rgba(217,154,0,0.22)"], [1.0, "rgba(18,161,124,0.13)"]],
            "showscale": False,
            "hoverinfo": "skip",
            "name": f"floor seen, {100.0 * coverage.fraction:.0f} % (amber: not)",
            "showlegend": True,
        }
    ]
