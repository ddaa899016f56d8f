"""``bluefoot world``: make a world, tell what is in it, write and draw it."""

from __future__ import annotations

import re
from collections import Counter
from typing import Any

from bluefoot_mpc.cli.outcome import Outcome
from bluefoot_mpc.cli.world_arguments import WorldCommand
from bluefoot_mpc.cli.world_picture import save_world_picture
from bluefoot_mpc.cli.world_relief import save_relief_picture, tell_relief
from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.settings import build, merge, parse_override, to_table
from bluefoot_mpc.sim.config import PLANNED_WORLDS, TERRAIN_WORLDS, WorldConfig
from bluefoot_mpc.sim.worlds import footprint
from bluefoot_mpc.sim.worlds.coverage import LIDAR_HEIGHT, ROBOT_RADIUS, Grid, reachable
from bluefoot_mpc.sim.worlds.files import write_plan
from bluefoot_mpc.sim.worlds.make import world_plan
from bluefoot_mpc.sim.worlds.plan import WorldPlan

_PLURALS = {
    "block": "blocks", "box": "boxes", "chair": "chairs", "cylinder": "cylinders", "partition": "partitions",
    "plate": "plates", "screen": "screens", "stone": "stones", "table": "tables", "wall": "walls",
}  # fmt: skip
"""More than one of the kinds of things that are made; a file names its things as it likes."""


def world(command: WorldCommand) -> Outcome:
    """Make or read the world; write what is asked for."""
    plan = world_plan(_config(command), command.seed)
    if plan is None:
        raise UnknownNameError("kind of world", command.kind, (*PLANNED_WORLDS, *TERRAIN_WORLDS))
    grid = reachable(plan)
    warnings = _warnings(plan)
    lines = [*_describe(plan, grid), *warnings]
    files = []
    if command.out is not None:
        write_plan(plan, command.out)
        files.append(command.out)
    if command.picture is not None:
        if plan.is_even:
            save_world_picture(plan, grid, command.picture)
        else:
            save_relief_picture(plan, command.picture)
        files.append(command.picture)
    lines += [f"wrote {file}" for file in files]
    source = command.out or command.kind
    choices = "" if str(source).endswith(".toml") else _choices(command)
    lines.append(f"walk in it: bluefoot run {_scenario(plan)} --world {source}{choices}")
    data: dict[str, Any] = {
        "plan": to_table(plan),
        "reachable_m2": round(grid.area, 3),
        "robot_radius_m": ROBOT_RADIUS,
        "warnings": warnings,
        "files": [str(file) for file in files],
    }
    return Outcome(data=data, page=("\n".join(lines),))


def _config(command: WorldCommand) -> WorldConfig:
    """The world that is asked for, with what was set of it.

    Raises:
        ConfigurationError: something else was set.
    """
    table: dict[str, Any] = {}
    for text in command.set:
        table = merge(table, parse_override(text))
    world = table.pop("sim", {})
    chosen = world.pop("world", {}) if isinstance(world, dict) else None
    if table or world or not isinstance(chosen, dict) or "name" in chosen:
        raise ConfigurationError(
            "--set takes values of the world only, sim.world.KEY=VALUE, and the kind stands for itself:"
            " bluefoot world rubble --set sim.world.terrain_height=0.03"
        )
    return build(WorldConfig, {**chosen, "name": command.kind}, "sim.world")


def _choices(command: WorldCommand) -> str:
    """What makes a run take place in the same world."""
    return "".join([f" --seed {command.seed}", *(f" --set {text}" for text in command.set)])


def _describe(plan: WorldPlan, grid: Grid) -> list[str]:
    x0, y0, x1, y1 = plan.bounds
    things = ", ".join(_counted(kind, count) for kind, count in _things(plan).items())
    number = len(plan.solids)
    lines = [
        f"{plan.name}, seed {plan.seed}: {x1 - x0:.2f} m x {y1 - y0:.2f} m;"
        f" the robot starts {-x0:.2f} m from the back and {-y0:.2f} m from the right side",
        f"{number} {'solid' if number == 1 else 'solids'}: {things or 'none'}",
    ]
    lines += [f"floor that the robot can get at: {grid.area:.1f} m²"] if plan.is_even else tell_relief(plan)
    if plan.marker is not None:
        lines.append(f"marker at x = {plan.marker.x:.2f} m, y = {plan.marker.y:.2f} m")
    return lines


def _things(plan: WorldPlan) -> Counter[str]:
    """How many things of each kind there are; a chair's legs, seat and back are one chair."""
    whole = {re.sub(r"_(leg\d*|seat|back|top|post)$", "", solid.name) for solid in plan.solids}
    return Counter(_kind(name) for name in sorted(whole))


def _kind(name: str) -> str:
    return "wall" if name.startswith("wall") else re.sub(r"\d+$", "", name)


def _counted(kind: str, count: int) -> str:
    """How many of a kind: "4 walls", "1 table"; of a kind that a file invents "4 × w"."""
    if count == 1:
        return f"1 {kind}"
    return f"{count} {_PLURALS[kind]}" if kind in _PLURALS else f"{count} × {kind}"


def _scenario(plan: WorldPlan) -> str:
    """The scenario that a world is good for: with a marker that stands there is something to look for."""
    if not plan.is_even:
        return "rough"
    if plan.marker is not None:
        return "approach"
    return "follow" if plan.name == "arena" else "wander"


def _warnings(plan: WorldPlan) -> list[str]:
    """What a robot that goes by its LIDAR will not see, and so walk into."""
    return [
        f"warning: '{solid.name}' lies {'below' if solid.z < LIDAR_HEIGHT else 'above'} the LIDAR's plane, "
        f"{LIDAR_HEIGHT:g} m above the floor: the robot does not see it and may walk into it"
        for solid in footprint.unseen(plan.solids, LIDAR_HEIGHT)
    ]
