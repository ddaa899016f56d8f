"""World plans from their names and a seed, or from files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from bluefoot_mpc.sim.config import PLANNED_WORLDS, TERRAIN_WORLDS, WorldConfig
from bluefoot_mpc.sim.randomization import stream
from bluefoot_mpc.sim.worlds.corridors import corridors
from bluefoot_mpc.sim.worlds.files import read_plan
from bluefoot_mpc.sim.worlds.furniture import chairs
from bluefoot_mpc.sim.worlds.ground import terrain_plan
from bluefoot_mpc.sim.worlds.hiding import hidden
from bluefoot_mpc.sim.worlds.layout import Layout
from bluefoot_mpc.sim.worlds.mazes import dead_ends, maze
from bluefoot_mpc.sim.worlds.plan import WorldPlan
from bluefoot_mpc.sim.worlds.rooms import arena, room

KINDS: Mapping[str, Callable[[np.random.Generator], Layout]] = {
    "room": room,
    "corridors": corridors,
    "chairs": chairs,
    "maze": maze,
    "dead_ends": dead_ends,
    "hidden": hidden,
    "arena": arena,
}
"""What makes the layout of each kind of world with things in it."""


def world_plan(config: WorldConfig, seed: int) -> WorldPlan | None:
    """The plan of a configured world; None for plain ground and for MuJoCo's own files.

    Args:
        config: of the world; its layout's seed goes before the run's.
        seed: of the run.

    Raises:
        ConfigurationError: the world's file is not a plan that the robot can stand in, or the
            configuration has figures that mean nothing in this world.
    """
    config.require_effect()
    layout = seed if config.layout_seed < 0 else config.layout_seed
    if config.name in TERRAIN_WORLDS:
        return terrain_plan(config, stream(layout, f"world.{config.name}"), layout)
    if config.name in PLANNED_WORLDS:
        return make_plan(config.name, layout)
    return read_plan(Path(config.name)) if config.is_planned else None


def make_plan(kind: str, seed: int) -> WorldPlan:
    """A world of a kind with things in it; the same kind and seed give the same world."""
    return KINDS[kind](stream(seed, f"world.{kind}")).plan(kind, seed)
