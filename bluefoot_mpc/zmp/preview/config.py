"""Configuration of the preview controller."""

from __future__ import annotations

from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import ConfigurationError, UnknownNameError
from bluefoot_mpc.qp import SOLVERS
from bluefoot_mpc.settings import require_nonnegative, require_positive
from bluefoot_mpc.zmp.support import SupportConfig

MOST_SAMPLES = 300
"""Beyond it building the problem takes minutes."""
LAWS: tuple[str, ...] = ("constrained", "kajita", "unconstrained")
"""Ways to plan: the quadratic program, Kajita's preview gain, the program's cost without its constraints."""


@dataclass(frozen=True, kw_only=True, slots=True)
class PreviewWeights:
    """Cost of a plan, per sample and axis; only ratios matter.

    The first four track references, the next are what a violated constraint costs.
    """

    zmp: float = 1.0  # distance of the ZMP from its reference, 1/m²
    position: float = 0.03  # of the centre of mass from its reference, 1/m²
    velocity: float = 1e-3  # of the centre of mass from its reference, s²/m²
    jerk: float = 2e-7  # s⁶/m²
    support_slack: float = 3e3  # ZMP out of its region, 1/m²
    reach_slack: float = 1e4  # centre of mass out of reach, 1/m²
    capture_slack: float = 1e3  # capture point out of the last region, 1/m²

    def __post_init__(self) -> None:
        require_nonnegative(zmp=self.zmp, position=self.position, velocity=self.velocity)
        require_positive(
            jerk=self.jerk,
            support_slack=self.support_slack,
            reach_slack=self.reach_slack,
            capture_slack=self.capture_slack,
        )
        if self.zmp + self.position <= 0.0:
            raise ConfigurationError("one of the weights zmp and position must be positive")


@dataclass(frozen=True, kw_only=True, slots=True)
class PreviewConfig:
    """Everything that shapes the preview."""

    law: str = "constrained"  # one of LAWS
    solver: str = "daqp"  # quadratic programming backend
    samples: int = 32  # of the horizon, each with its own jerk
    interval: float = 0.04  # s between samples
    height: float = 0.1  # m, nominal distance of the centre of mass above the ground
    support: SupportConfig = field(default_factory=SupportConfig)
    weights: PreviewWeights = field(default_factory=PreviewWeights)
    depth: float = 0.008  # m inside its region, where the ZMP is wanted
    centre_pull: float = 0.0  # share of the way from there to the middle of the feet, 0 to 1
    reach: tuple[float, float] = (0.03, 0.03)  # m, forward and sideways from the nominal place
    rows: tuple[int, ...] = (12, 24, 48)  # of the small problems; the next is for what does not fit
    rounds: int = 8  # problems of one size per plan, before a larger one is posed
    tolerance: float = 1e-7  # m, violation that is none
    nearest_violation: float = 0.006  # m out of a region at which an approximate plan is still used
    shift_time: float = 0.3  # s for which the previous plan stands in for one that failed
    stance_speed: float = 0.05  # m/s towards the middle of the feet when there is no plan

    def __post_init__(self) -> None:
        """Check names and ranges."""
        if self.law not in LAWS:
            raise UnknownNameError("preview law", self.law, LAWS)
        if self.solver not in SOLVERS:
            raise UnknownNameError("solver", self.solver, SOLVERS)
        require_positive(
            interval=self.interval,
            height=self.height,
            tolerance=self.tolerance,
            nearest_violation=self.nearest_violation,
            shift_time=self.shift_time,
            stance_speed=self.stance_speed,
            reach_forward=self.reach[0],
            reach_sideways=self.reach[1],
        )
        if not 0.0 <= self.centre_pull <= 1.0:
            raise ConfigurationError(f"centre_pull must lie in [0, 1], not {self.centre_pull!r}")
        require_nonnegative(depth=self.depth)
        if self.samples > MOST_SAMPLES:
            raise ConfigurationError(
                f"samples = {self.samples!r} must not exceed {MOST_SAMPLES}: a plan is made on every tick"
            )
        for name, least in (("samples", 2), ("rounds", 1)):
            if getattr(self, name) < least:
                raise ConfigurationError(f"{name} must be at least {least}, not {getattr(self, name)!r}")
        if not self.rows or min(self.rows) < 1 or list(self.rows) != sorted(set(self.rows)):
            raise ConfigurationError(f"rows must be positive and grow, not {self.rows!r}")
