"""The part of a report that shows how the robot crossed rough ground, or looked at it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bluefoot_mpc.model.parameters import SensorMounts
from bluefoot_mpc.model.robot import RobotModel
from bluefoot_mpc.runtime.data import RunData
from bluefoot_mpc.sim.worlds.heights import Relief
from bluefoot_mpc.viz.crossing_series import CrossingSeries, extract_crossing
from bluefoot_mpc.viz.crossing_truth import Heights, map_errors, profiles
from bluefoot_mpc.viz.plots import Panel
from bluefoot_mpc.viz.plots_cloud import cloud_picture
from bluefoot_mpc.viz.plots_cost import cost_config, cost_slices
from bluefoot_mpc.viz.plots_crossing import phases_over_time, side_view
from bluefoot_mpc.viz.plots_terrain import height_map, map_quality, some_maps
from bluefoot_mpc.viz.scans import known_plan
from bluefoot_mpc.viz.series import RunSeries


@dataclass(frozen=True, kw_only=True, slots=True)
class Crossing:
    """What a page shows of crossing rough ground.

    Attributes:
        series: as arrays over time.
        panels: figures, in their order.
    """

    series: CrossingSeries
    panels: tuple[Panel, ...]


def _true_heights(run: RunData, mounts: SensorMounts) -> Heights | None:
    """Of the ground of a run's world; None where its geometry is not known."""
    plan = known_plan(run, mounts)
    if plan is not None:
        return Relief(plan.solids, plan.floor).height
    world = run.config.get("sim", {}).get("world", {})
    level = world.get("name", "flat") == "flat" and not world.get("slope_deg")
    return (lambda places: np.zeros(places.shape[:-1])) if level else None


def crossing_of(run: RunData, series: RunSeries, robot: RobotModel) -> Crossing | None:
    """How a run crossed rough ground; None where it did not.

    Args:
        run: the run.
        series: its time series.
        robot: the robot that ran.
    """
    parameters = robot.parameters
    crossing = extract_crossing(run, series, parameters.legs.foot_radius)
    if crossing is None:
        return None
    heights = _true_heights(run, parameters.sensors) if series.has_truth else None
    errors = map_errors(crossing, some_maps(crossing.maps), heights)
    panels = [
        height_map(crossing),
        map_quality(crossing, errors),
        cloud_picture(crossing),
        phases_over_time(series, crossing, run.period),
        side_view(crossing, profiles(crossing, heights)),
        cost_slices(crossing, cost_config(run.config)),
    ]
    return Crossing(series=crossing, panels=tuple(panel for panel in panels if panel is not None))
