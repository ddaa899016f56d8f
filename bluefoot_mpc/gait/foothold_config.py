"""How feet swing and where they land: configuration, and what of it a swing keeps."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

from bluefoot_mpc.gait.stepping import SteppingConfig
from bluefoot_mpc.gait.table import Law, Vertical
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range


@dataclass(frozen=True, kw_only=True, slots=True)
class FootholdConfig:
    """How feet swing and where they land."""

    law: Law = "virtual_force"  # horizontal profile
    vertical: Vertical = "sine"  # sine: step height follows y2, as printed
    stance_lead: float = 0.5  # share of the stance's travel by which feet land ahead; 0 as printed
    swing_rate: float = 9.0  # sqrt(k_c/m) times the swing time, 1
    damping_ratio: float = 1.05  # b_c / (2 sqrt(k_c m)), >= 1
    ground_damping: bool = False  # damp speed over ground (printed law; lags), not over the foothold
    ground_matching: float = 1.0  # minimum_jerk: 1 leaves and lands at rest on the ground, 0 in b'
    apex: float = 0.5  # quintic: progress of the highest point, 1
    early_contact: bool = False  # freeze a foot that lands early; measured: it helps on no ground tried
    early_progress: float = 0.5  # progress from which a contact counts as a landing, 1
    early_height: float = (
        0.006  # height from which it counts; below, feet drooping onto level ground touch, m
    )
    offset_limit: float = 0.03  # largest shift of a virtual foothold after a reset, m
    offset_time: float = 0.5  # time constant of its return, s
    shift_limit: float = 0.06  # largest shift of landing places on demand (capture point), m
    shift_rate: float = 1.0  # fastest change of it: feet in the air follow it, m/s
    reach: float = 0.10  # farthest that a given foothold may lie from the nominal one at landing, m
    stepping: SteppingConfig = field(default_factory=SteppingConfig)  # over rough ground

    def __post_init__(self) -> None:
        """Check ranges."""
        require_range(-1.0, 1.0, stance_lead=self.stance_lead)
        require_range(1.0, 50.0, swing_rate=self.swing_rate)
        require_range(1.0, 10.0, damping_ratio=self.damping_ratio)
        require_range(-1.5, 1.5, ground_matching=self.ground_matching)
        require_range(0.1, 0.9, apex=self.apex)
        require_range(0.0, 1.0, early_progress=self.early_progress)
        require_nonnegative(offset_limit=self.offset_limit, early_height=self.early_height)
        require_nonnegative(shift_limit=self.shift_limit)
        require_positive(offset_time=self.offset_time, shift_rate=self.shift_rate, reach=self.reach)


class SwingShape(NamedTuple):
    """How one swing goes, latched at lift-off.

    Attributes:
        law: horizontal profile.
        vertical: vertical profile.
        ground_matching: minimum_jerk: 1 leaves and lands at rest on the ground, 0 in b'.
        apex: quintic: progress of the highest point.
        swing_rate: virtual_force: sqrt(k_c/m) times the swing time.
        stance_lead: share of the stance's travel by which the foot lands ahead.
    """

    law: Law
    vertical: Vertical
    ground_matching: float
    apex: float
    swing_rate: float
    stance_lead: float

    @staticmethod
    def of(config: FootholdConfig) -> SwingShape:
        """The shape that a configuration gives at every speed."""
        return SwingShape(
            config.law,
            config.vertical,
            config.ground_matching,
            config.apex,
            config.swing_rate,
            config.stance_lead,
        )
