"""The world that a run took place in, as its plan tells: outlines for maps, shapes for the 3D views."""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import BlueFootError
from bluefoot_mpc.settings import build
from bluefoot_mpc.sim.config import WorldConfig
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.sim.worlds.plan import Solid, WorldPlan
from bluefoot_mpc.types import FloatArray

_LOG = logging.getLogger(__name__)

_CORNERS = 24
"""Corners of the polygon that stands for a circle."""


def plan_of(config: Mapping[str, Any]) -> WorldPlan | None:
    """The plan of the world of a simulated run; None where there is none, or where it cannot be made again.

    Args:
        config: everything resolved, as a run records it: names world and seed.
    """
    named, table = config.get("run", {}), config.get("sim", {}).get("world")
    if table is None or named.get("robot") == "hardware":
        return None
    try:
        return world_plan(build(WorldConfig, table, "sim.world"), int(named.get("seed") or 0))
    except (BlueFootError, OSError) as error:
        # A file that was moved since, or a log of another version: the run can be shown without its world.
        _LOG.warning("the run's world cannot be drawn: %s", error)
        return None


def outline(solid: Solid) -> FloatArray:
    """(k, 2) m, corners of a solid from above, in world; a cylinder's lie on its edge."""
    if solid.shape == "cylinder":
        angle = np.linspace(0.0, 2.0 * math.pi, _CORNERS, endpoint=False)
        ring = 0.5 * solid.size[0] * np.column_stack([np.cos(angle), np.sin(angle)])
        return np.asarray(ring + np.array([solid.x, solid.y]))
    return footprint.corners(solid)


def hangs_over(solid: Solid) -> bool:
    """True of what the robot can walk under."""
    return solid.z - 0.5 * solid.size[2] >= footprint.HEADROOM


def css_colour(colour: tuple[float, float, float], opacity: float = 1.0) -> str:
    """A colour (red, green, blue, 0..1) as the page writes it."""
    red, green, blue = (round(255 * part) for part in colour)
    return f"rgba({red},{green},{blue},{opacity:g})"
