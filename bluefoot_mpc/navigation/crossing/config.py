"""Everything that shapes how rough ground is crossed."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from bluefoot_mpc.exceptions import ConfigurationError
from bluefoot_mpc.navigation.crossing.follower import FollowerConfig
from bluefoot_mpc.navigation.crossing.pace import PaceConfig
from bluefoot_mpc.settings import require_nonnegative, require_positive, require_range
from bluefoot_mpc.terrain.cloud import CloudConfig
from bluefoot_mpc.terrain.cost import CostConfig
from bluefoot_mpc.terrain.free_space import FreeSpaceConfig
from bluefoot_mpc.terrain.ground import RatingConfig
from bluefoot_mpc.terrain.height_map import LARGEST, MapConfig
from bluefoot_mpc.terrain.merge import MergeConfig
from bluefoot_mpc.terrain.outlook import OutlookConfig
from bluefoot_mpc.terrain.plan import PlanConfig
from bluefoot_mpc.terrain.registration import Bounds
from bluefoot_mpc.terrain.sweep import SweepConfig
from bluefoot_mpc.terrain.treads import TreadConfig

_PLAN = PlanConfig(
    even_radius=0.0,
    k_side=5.0,
    cost=CostConfig(spacing=0.316, k_yaw=10.0, yaw_range=math.radians(20.0)),
    treads=TreadConfig(reach=0.065, least_quality=0.05),
)
"""A way as straight as feet can be placed along it: a crawl follows no wiggles."""
_MAP = MapConfig(cell=0.01, gap=2, gap_trust=0.3)
"""Cells of half the size show edges where they are: of twice as large ones half the ground is edge."""
_FIRST_SWEEP = SweepConfig(dwell_scans=2, pitch_max_deg=34.0)
"""So far down that what is seen begins within the ground that is taken to be even."""
_SWEEP = SweepConfig(dwell_scans=2, pitch_max_deg=26.0)
"""What is nearer an earlier sweep has seen, and on rough ground the nose must not go so low."""


@dataclass(frozen=True, kw_only=True, slots=True)
class CrossingConfig:
    """Configuration of each part, and of what ties them together."""

    first_sweep: SweepConfig = field(default_factory=lambda: _FIRST_SWEEP)
    sweep: SweepConfig = field(default_factory=lambda: _SWEEP)
    cloud: CloudConfig = field(default_factory=CloudConfig)
    map: MapConfig = field(default_factory=lambda: _MAP)
    merge: MergeConfig = field(default_factory=MergeConfig)
    free_space: FreeSpaceConfig = field(default_factory=FreeSpaceConfig)
    align: Bounds = field(default_factory=Bounds)
    rating: RatingConfig = field(default_factory=RatingConfig)
    plan: PlanConfig = field(default_factory=lambda: _PLAN)
    outlook: OutlookConfig = field(default_factory=OutlookConfig)
    pace: PaceConfig = field(default_factory=PaceConfig)
    follower: FollowerConfig = field(default_factory=FollowerConfig)
    start_radius: float = 0.45  # m around the feet at the start, within which the ground is taken to be even
    start_confidence: float = 0.3  # in that ground
    ahead: float = 1.6  # m, of the map, ahead of the robot
    behind: float = 0.7  # m
    aside: float = 0.8  # m to either side
    stretch: float = 0.50  # m that are walked from one sweep to the next
    least_stretch: float = 0.20  # m, where less ground ahead is known
    overlap: float = 0.50  # m ahead that a sweep does not see: known ground is not left nearer than that
    settle_time: float = 0.3  # s for which all feet rest before a sweep
    think_ticks: int = 20  # command periods for mapping and planning
    patience: float = 6.0  # s that a foot may have nowhere to step before the robot looks again
    stall: float = 40.0  # s without progress on the way, before it looks again
    attempts: int = 3  # fruitless sweeps in a row after which it stays
    progress: float = 0.05  # m that count as fruit
    lean_deg: float = 25.0  # degrees by which the trunk may lean otherwise than told
    lean_time: float = 0.5  # s, for that long; then it stays
    incremental: bool = False  # map while walking, rather than stop and sweep
    rethink_time: float = 1.5  # s between two plans on the way, then
    walking_pitch_deg: float = 18.0  # degrees nose down in the mean, then
    walking_swing_deg: float = 4.0  # degrees to either side of it
    walking_period: float = 3.0  # s of that

    def __post_init__(self) -> None:
        require_nonnegative(
            settle_time=self.settle_time, patience=self.patience, overlap=self.overlap,
            progress=self.progress, walking_swing_deg=self.walking_swing_deg,
        )  # fmt: skip
        require_range(0.0, 2.0, start_radius=self.start_radius)
        require_range(0.2, 5.0, ahead=self.ahead, behind=self.behind, aside=self.aside)
        self._require_a_map_of_some_size()
        require_positive(
            stretch=self.stretch, least_stretch=self.least_stretch, rethink_time=self.rethink_time,
            walking_period=self.walking_period, stall=self.stall, lean_deg=self.lean_deg,
            lean_time=self.lean_time,
        )  # fmt: skip
        require_range(0.0, 1.0, start_confidence=self.start_confidence)
        require_range(0.0, 31.0, walking_pitch_deg=self.walking_pitch_deg)
        require_range(1, 500, think_ticks=self.think_ticks)
        require_range(1, 100, attempts=self.attempts)

    def _require_a_map_of_some_size(self) -> None:
        """What a map may have at most must not come up only when the robot stands in it."""
        across = 2.0 * max(math.hypot(max(self.ahead, self.behind), self.aside), self.start_radius)
        cells = (across / self.map.cell + 2.0) ** 2
        if cells > LARGEST:
            raise ConfigurationError(
                f"a map with cells of {self.map.cell:g} m as far as ahead = {self.ahead:g}, behind = "
                f"{self.behind:g} and aside = {self.aside:g} m may have {cells:.3g} cells, and {LARGEST} at "
                "most: make the cells larger, or the map smaller"
            )
