"""Arguments of ``bluefoot world``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from bluefoot_mpc.cli.arguments import Common
from bluefoot_mpc.exceptions import ConfigurationError

PICTURES = (".png", ".svg", ".html")

_File = tyro.conf.arg(metavar="FILE", help_behavior_hint="")


@dataclass(frozen=True, kw_only=True)
class WorldCommand(Common):
    """Make a world from a kind and a seed, or check one from a file; draw it from above."""

    kind: Annotated[str, tyro.conf.Positional, tyro.conf.arg(metavar="KIND", help_behavior_hint="")]
    """room, corridors, chairs, maze, dead_ends, hidden or arena; rubble, random_steps, ramp, kerb, gap or
    stones; or a plan's file (.toml)."""
    seed: int = 0
    """Seed of the layout; the same seed gives the same world."""
    set: Annotated[
        tuple[str, ...], tyro.conf.UseAppendAction, tyro.conf.arg(metavar="SIM.WORLD.KEY=VALUE")
    ] = ()
    """One value of the world's configuration, as for a run: sim.world.terrain_height=0.03."""
    out: Annotated[Path | None, _File] = None
    """Write the plan into this TOML file, to change it and to run in it (--world FILE)."""
    picture: Annotated[Path | None, _File] = None
    """Draw the world from above into this file (.html, .png or .svg)."""

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise ConfigurationError(f"--seed = {self.seed} must not be negative")
        if self.out is not None and self.out.suffix != ".toml":
            raise ConfigurationError(f"--out = {self.out}: a plan's file ends with .toml")
        if self.picture is not None and self.picture.suffix not in PICTURES:
            raise ConfigurationError(
                f"--picture = {self.picture}: must end with one of: {', '.join(PICTURES)}"
            )
