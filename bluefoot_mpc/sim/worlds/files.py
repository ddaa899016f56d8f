"""World plans as TOML files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import build, dump_toml, read_toml, to_table
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.heights import heights
from bluefoot_mpc.sim.worlds.plan import WorldPlan

START_RADIUS = 0.35
"""m around the origin that must be free in any world: the robot stands there with its legs."""

EVEN = 0.003
"""m, by which ground may differ from height zero where the robot starts."""

GREATEST_SIDE = 60.0
"""m; the floor's cells must fit into memory."""

_HEADER = """\
# A world on level floor, m and rad. The robot starts at the origin and looks along x.
# bounds: least x, least y, greatest x, greatest y of the floor that counts.
# A solid: shape is box or cylinder; x, y, z its centre (without z it stands on the floor);
# size is length, width and height, of a cylinder twice the diameter and the height; yaw turns it left.
# is_ground: to be walked on; such a box may be tilted by pitch, nose down. floor is the floor's height.

"""


def read_plan(path: Path) -> WorldPlan:
    """Read a plan, and check that a robot can start in it.

    What may be left out: name (the file's), seed, floor, z, yaw, pitch, is_ground, colour and marker.

    Raises:
        ConfigurationError: the file cannot be read, or says what cannot be.
    """
    table = {"name": path.stem, "seed": 0, **read_toml(path)}
    table.setdefault("solids", [])
    if "bounds" not in table:
        raise ConfigurationError(
            f"{path}: no bounds. Add a line with least x, least y, greatest x, greatest y of the floor in m:"
            " bounds = [-1.0, -2.0, 5.0, 2.0]"
        )
    if isinstance(table["solids"], list):
        floor = table.get("floor")
        level = float(floor) if isinstance(floor, int | float) else 0.0  # a wrong one is told later
        table["solids"] = [_standing(solid, level) for solid in table["solids"]]
    try:
        _require_known(table)
        plan = build(WorldPlan, table)
        _require_start(plan)
        _require_even_start(plan)
        _require_free_marker(plan)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from error
    return plan


def write_plan(plan: WorldPlan, path: Path) -> None:
    """Write a plan so that `read_plan` gives the same one again.

    Raises:
        ConfigurationError: the file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(_HEADER + dump_toml(to_table(plan)), encoding="utf-8")
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error.strerror or error}") from error


def _standing(solid: Any, floor: float) -> Any:
    """A solid's table; without a height above the floor it stands on it."""
    if not isinstance(solid, Mapping) or "z" in solid:
        return solid
    height = 0.0  # what a wrong size takes; that is told later
    match solid.get("size"):
        case [_, _, float() | int() as value]:
            height = value
    return {**solid, "z": floor + 0.5 * height}


def _require_start(plan: WorldPlan) -> None:
    """Refuse a world without room for the robot where it starts."""
    x0, y0, x1, y1 = plan.bounds
    if max(x1 - x0, y1 - y0) > GREATEST_SIDE:
        raise ConfigurationError(
            f"bounds = {list(plan.bounds)}: at most {GREATEST_SIDE:g} m from side to side"
        )
    way_out = f"the robot starts at the origin and needs {START_RADIUS:g} m around it; move the solid"
    for solid in footprint.in_the_way(plan.solids):
        if footprint.distance(np.zeros((1, 2)), solid)[0] < START_RADIUS:
            raise ConfigurationError(f"'{solid.name}' stands in the start: {way_out}")
    marker = plan.marker
    if marker is not None and np.hypot(marker.x, marker.y) - marker.radius < START_RADIUS:
        raise ConfigurationError(f"the marker stands in the start: {way_out.replace('solid', 'marker')}")


def _require_even_start(plan: WorldPlan) -> None:
    """Refuse ground that is not at height zero where the robot starts."""
    if plan.is_even:
        return
    reach = np.arange(-START_RADIUS, START_RADIUS + 1e-9, 0.01)
    places = np.stack(np.meshgrid(reach, reach), axis=-1)
    places = places[np.hypot(places[..., 0], places[..., 1]) <= START_RADIUS]
    worst = float(np.abs(heights(plan, places)).max())
    if worst > EVEN:
        raise ConfigurationError(
            f"the ground under the start is not even: {1e3 * worst:.0f} mm off height zero. Within"
            f" {START_RADIUS:g} m of the origin it must be at zero, within {1e3 * EVEN:.0f} mm: move what"
            " is there, or put a piece of ground with its top at zero under it"
        )


def _require_known(table: Mapping[str, Any]) -> None:
    """Refuse keys outside all tables that no plan has."""
    known = [field.name for field in dataclasses.fields(WorldPlan)]
    for key in table:
        if key not in known:
            raise UnknownNameError("key", key, known)


def _require_free_marker(plan: WorldPlan) -> None:
    """Refuse a marker whose ball is inside a thing, where nothing sees it; it may stand on one."""
    marker = plan.marker
    if marker is None:
        return
    for solid in plan.solids:
        is_level = abs(marker.z - solid.z) < marker.radius + 0.5 * solid.size[2]
        away = footprint.distance(np.array([[marker.x, marker.y]]), solid)[0]
        if is_level and away < marker.radius:
            raise ConfigurationError(f"the marker stands in '{solid.name}': move one of them")
