"""Configuration of the gait as a whole."""

from __future__ import annotations

from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.gait.couplings import COUPLINGS
from bluefoot_mpc.gait.cpg import CpgConfig
from bluefoot_mpc.gait.footholds import FootholdConfig
from bluefoot_mpc.gait.reflex import ReflexConfig
from bluefoot_mpc.gait.table import GaitTable
from bluefoot_mpc.gait.timing import GaitTiming
from bluefoot_mpc.settings import require_nonnegative, require_positive


def _walk_timing() -> GaitTiming:
    return GaitTiming(
        swing_share=0.2,
        a_v=300.0,
        a_omega=60.0,
        cycle_min=1.1,
        cycle_max=1.3,
        height_min=0.02,
        height_max=0.03,
    )


def _rough_timing() -> GaitTiming:
    return GaitTiming(
        swing_share=0.2,  # the walk's coupled network swings no shorter
        a_v=300.0,
        a_omega=60.0,
        cycle_min=3.0,
        cycle_max=3.0,
        height_min=0.02,
        height_max=0.03,
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitConfig:
    """Everything that shapes the gait."""

    trot: GaitTiming = field(default_factory=GaitTiming)  # diagonal pairs
    walk: GaitTiming = field(default_factory=_walk_timing)  # one leg after the other
    rough: GaitTiming = field(default_factory=_rough_timing)  # the walk over rough ground
    trot_table: GaitTable = field(default_factory=GaitTable)  # over speed, instead of the laws
    walk_table: GaitTable = field(default_factory=GaitTable)
    rough_table: GaitTable = field(default_factory=GaitTable)
    cpg: CpgConfig = field(default_factory=CpgConfig)
    reflex: ReflexConfig = field(default_factory=ReflexConfig)
    foothold: FootholdConfig = field(default_factory=FootholdConfig)
    blend_time: float = 2.0  # from one gait to another, s
    max_acceleration: float = 0.1  # of the commanded velocity, m/s²
    max_yaw_acceleration: float = 1.0  # of the commanded yaw rate, rad/s²
    style_time: float = 0.3  # time constant with which trunk and nominal feet follow a table, s
    settle_cycles: float = 1.0  # stepping on the spot before the network rests, cycles
    still_speed: float = 1e-4  # commands below this are no motion, m/s and rad/s
    substep: float = 0.01  # s, longest step of the gait loop

    def __post_init__(self) -> None:
        """Check ranges, and that each gait's swings fit between one another."""
        require_positive(
            blend_time=self.blend_time,
            max_acceleration=self.max_acceleration,
            max_yaw_acceleration=self.max_yaw_acceleration,
            substep=self.substep,
            style_time=self.style_time,
        )
        require_nonnegative(settle_cycles=self.settle_cycles, still_speed=self.still_speed)
        for name, gait in COUPLINGS.items():
            shares = self.table(name).swing_share or (self.timing(name).swing_share,)
            share, most = max(shares), 0.25 * (4 - gait.least_stance)
            if share > most:
                raise ConfigurationError(
                    f"{name}.swing_share = {share!r} must not exceed {most:g}: "
                    f"a {name} keeps {gait.least_stance} feet on the ground"
                )

    def timing(self, name: str) -> GaitTiming:
        """Timing of a named gait (one of `COUPLINGS`)."""
        timing: GaitTiming = getattr(self, name)
        return timing

    def table(self, name: str) -> GaitTable:
        """Parameters over speed of a named gait (one of `COUPLINGS`)."""
        table: GaitTable = getattr(self, f"{name}_table")
        return table
