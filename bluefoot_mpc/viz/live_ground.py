"""What the live view shows of rough ground: the newest map, the planned way, and the next footholds."""

from __future__ import annotations

from typing import Any

import numpy as np

from bluefoot_mpc.types import FloatArray, HeightMap, Telemetry
from bluefoot_mpc.viz.crossing_series import MapAt, datum, is_map, is_route, raised
from bluefoot_mpc.viz.plots_terrain import span_of
from bluefoot_mpc.viz.series import estimated_feet
from bluefoot_mpc.viz.stage_ground import map_data, route_points

AGAIN = 2.0
"""s after which map and way are told again, to pages that came later or missed them."""


class LiveGround:
    """Keeps map and way from tick to tick; `note` is for every tick, `state` for those drawn.

    Args:
        foot_radius: m, of the balls that the feet end in.
    """

    def __init__(self, foot_radius: float) -> None:
        self._below = np.array([0.0, 0.0, foot_radius])
        self._rise: FloatArray | None = None
        self._map: HeightMap | None = None
        self._route: FloatArray | None = None
        self._number = 0
        self._told = (0, -np.inf)

    def note(self, telemetry: Telemetry) -> None:
        """Take in a tick; returns at once."""
        report = telemetry.crossing
        if report is None:
            return
        if self._rise is None:
            self._rise = datum(estimated_feet(telemetry) - self._below)
        if is_map(report.ground):
            self._map = raised(report.ground, self._rise)
            self._number += 1
        if is_route(report):
            self._route = report.route[:, :3]
            self._number += 1

    def state(self, telemetry: Telemetry) -> dict[str, Any]:
        """What the page needs on a tick; map and way when they are new, and again every now and then."""
        report, number = telemetry.crossing, self._number
        if report is None:
            return {}
        rise = np.zeros(3) if self._rise is None else self._rise
        aims = [row - rise if np.isfinite(row).all() else None for row in report.footholds]
        found: dict[str, Any] = {"phase": str(report.phase), "reason": report.reason, "aims": aims}
        last, when = self._told
        if number and (number != last or not 0.0 <= telemetry.time - when < AGAIN):
            self._told = (number, telemetry.time)
            if self._map is not None:
                span = span_of([MapAt(0, self._map)])
                found["map"] = {"number": number, "span": span, **map_data(self._map)}
            if self._route is not None:
                found["route"] = route_points(self._route, self._map)
        return found
