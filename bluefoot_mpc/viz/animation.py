"""A recorded run as the data of the 3D replay: the scene, and one row of numbers per frame."""

from __future__ import annotations

import functools
import importlib.util
from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.types import LEGS, FloatArray
from bluefoot_mpc.viz.packing import pack, pack_bytes, stride_for
from bluefoot_mpc.viz.page import template_text
from bluefoot_mpc.viz.scene import Node, RobotScene, scene_commands
from bluefoot_mpc.viz.series import RunSeries
from bluefoot_mpc.viz.style import LEG_COLOURS

MAX_FRAMES = 6000
"""Most frames that a page carries: two minutes at 50 Hz; longer runs are thinned."""


def scene_data(scene: RobotScene, foot_radius: float) -> dict[str, Any]:
    """The robot itself, ready for JSON; `foot_radius` in m."""
    return {
        "commands": scene_commands(scene),
        "nodes": [_node(node) for node in scene.nodes],
        "legs": [{"name": leg, "colour": LEG_COLOURS[leg]} for leg in LEGS],
        "footRadius": foot_radius,
    }


def animation_data(scene: RobotScene, series: RunSeries, foot_radius: float) -> dict[str, Any]:
    """Everything the replay needs, ready for JSON.

    Args:
        scene: the robot.
        series: the run.
        foot_radius: m.
    """
    pick = slice(None, None, stride_for(len(series.time), MAX_FRAMES))
    states = series.loaded[pick] @ [1, 2, 4, 8] + series.scheduled[pick] @ [16, 32, 64, 128]
    modes = sorted(set(series.mode))
    ground = _ground_plane(series, foot_radius)
    return {
        **scene_data(scene, foot_radius),
        "ground": ground,
        "time": pack(series.time[pick]),
        "q": pack(series.q[pick]),
        "feet": pack(series.feet[pick]),
        "states": pack_bytes(states.astype(np.uint8)),
        "com": pack(series.com[pick]),
        "zmp": pack(series.zmp[pick]),
        "zmpPlan": pack(series.zmp_plan[pick]),
        "push": pack(series.push[pick]) if bool(series.push.any()) else None,
        "modes": modes,
        "mode": pack_bytes(np.array([modes.index(m) for m in series.mode[pick]], dtype=np.uint8)),
    }


@functools.cache
def viewer_script() -> str:
    """The JavaScript of meshcat's viewer, from the installed package.

    Raises:
        BlueFootError: meshcat is not installed completely.
    """
    spec = importlib.util.find_spec("meshcat")
    for folder in (spec.submodule_search_locations or []) if spec is not None else []:
        file = Path(folder) / "viewer" / "dist" / "main.min.js"
        if file.is_file():
            return file.read_text(encoding="utf-8")
    raise BlueFootError("meshcat's viewer (viewer/dist/main.min.js) is missing: install meshcat >= 0.3.2")


def player_script() -> str:
    """The JavaScript of the replay's and the live view's own part, surroundings included."""
    return template_text("surroundings.js") + template_text("ground.js") + template_text("player.js")


def _node(node: Node) -> dict[str, Any]:
    return {
        "path": node.path.strip("/").split("/"),
        "axis": [round(float(x), 9) for x in node.axis],
        "q": node.q_index,
    }


def _ground_plane(series: RunSeries, foot_radius: float) -> list[float]:
    """Height and slopes (z = a + b x + c y) of the plane on which the loaded feet stand, m and 1.

    A flat floor comes out as zeros; a ramp as its slope; on rough ground it is
    the mean plane.
    """
    feet: FloatArray = series.feet[series.loaded]
    if len(feet) < 8:
        return [0.0, 0.0, 0.0]
    # The estimate's feet are points on the ground or near it; truth gives the balls' centres.
    height = feet[:, 2] - (foot_radius if series.has_truth else 0.0)
    if float(np.percentile(np.abs(height), 90)) < 0.006:
        return [0.0, 0.0, 0.0]
    table = np.column_stack([np.ones(len(feet)), feet[:, :2]])
    solution = np.linalg.lstsq(table, height, rcond=None)[0]
    return [round(float(x), 5) for x in solution]
