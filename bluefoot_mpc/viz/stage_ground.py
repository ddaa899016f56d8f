"""Rough ground in the 3D views: what the robot knows of it, where it means to go and to step."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

from bluefoot_mpc.terrain.frame import heights_at
from bluefoot_mpc.types import FloatArray, HeightMap
from bluefoot_mpc.viz.crossing_series import CrossingSeries
from bluefoot_mpc.viz.packing import pack
from bluefoot_mpc.viz.plots_terrain import HEIGHTS, some_maps, span_of

MOST_CELLS = 40_000
"""Cells of a map that a page draws; of a larger one every other row and column, and so on."""
LEAST_SPAN = 20.0
"""mm of height, up and down, that the colours span at least."""
_OVER = 0.02
"""m over the ground at which a planned way is drawn."""
_UNKNOWN = -32768
"""What stands for an unknown height among millimetres."""
_FAR = 32767


def terrain_data(crossing: CrossingSeries) -> dict[str, Any]:
    """Cloud, maps, planned ways and footholds of a run, ready for JSON.

    Args:
        crossing: the run.
    """
    maps = some_maps(crossing.maps)
    time = crossing.time
    aims = [swing for swing in crossing.swings if np.isfinite(swing.chosen).all()]
    return {
        **colours(span_of(maps)),
        "points": _millimetres(crossing.points),
        "pointTime": pack(crossing.point_time),
        "maps": [{"time": float(time[entry.tick]), **map_data(entry.ground)} for entry in maps],
        "routes": [
            {
                "time": float(time[route.tick]),
                "points": route_points(route.poses, crossing.map_at(route.tick)),
            }
            for route in crossing.routes
        ],
        "aims": {
            "leg": [swing.leg for swing in aims],
            "time": pack([[time[swing.start], time[swing.landed]] for swing in aims]),
            "at": _millimetres(np.array([swing.chosen for swing in aims]).reshape(-1, 3)),
        },
    }


def colours(span: float) -> dict[str, Any]:
    """The colours of heights: those of the report's maps; `span` in mm to either side of zero."""
    return {"span": span, "scale": [colour for _, colour in HEIGHTS]}


def map_data(ground: HeightMap) -> dict[str, Any]:
    """A map as the page draws it: its frame, and heights in millimetres of the odometry frame.

    Args:
        ground: the map.
    """
    every = max(1, int(np.ceil(np.sqrt(ground.height.size / MOST_CELLS))))
    height = ground.height[::every, ::every] + ground.pose[2]
    x, y, _, yaw = ground.pose.tolist()
    return {
        "frame": [x, y, yaw],
        "cell": ground.cell * every,
        "columns": height.shape[1],
        "heights": _millimetres(height),
    }


def route_points(poses: FloatArray, ground: HeightMap | None) -> list[float]:
    """(3 k,) m, a planned way one point after the other, a little over the ground.

    Args:
        poses: (k, 3) x, y (m), yaw, odometry frame.
        ground: the map that it leads over.
    """
    known = np.zeros(len(poses)) if ground is None else np.nan_to_num(heights_at(ground, poses[:, :2]))
    points: list[float] = np.round(np.column_stack([poses[:, :2], known + _OVER]), 3).ravel().tolist()
    return points


def _millimetres(metres: FloatArray) -> str:
    """Base64 of little-endian whole millimetres; what is unknown is a number that no height has."""
    rounded = np.clip(np.round(1e3 * np.nan_to_num(metres, nan=0.0, posinf=0.0, neginf=0.0)), -_FAR, _FAR)
    whole = np.where(np.isfinite(metres), rounded, _UNKNOWN).astype("<i2")
    return base64.b64encode(np.ascontiguousarray(whole).tobytes()).decode("ascii")
