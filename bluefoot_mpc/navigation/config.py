"""Everything that shapes how the robot finds its way."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from bluefoot_mpc.navigation.escape import EscapeConfig
from bluefoot_mpc.navigation.explore import ExploreConfig
from bluefoot_mpc.navigation.grid import GridConfig
from bluefoot_mpc.navigation.guard import GuardConfig
from bluefoot_mpc.navigation.limits import LimitConfig
from bluefoot_mpc.navigation.marker_task import MarkerTaskConfig
from bluefoot_mpc.navigation.memory import MemoryConfig
from bluefoot_mpc.navigation.plan import PlanConfig
from bluefoot_mpc.navigation.potential_field import FieldConfig
from bluefoot_mpc.navigation.route import RouteConfig
from bluefoot_mpc.navigation.scan import ScanConfig
from bluefoot_mpc.navigation.waypoints import WaypointConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class NavigationConfig:
    """Configuration of each part of navigation."""

    scan: ScanConfig = dataclasses.field(default_factory=ScanConfig)
    field: FieldConfig = dataclasses.field(default_factory=FieldConfig)
    memory: MemoryConfig = dataclasses.field(default_factory=MemoryConfig)
    grid: GridConfig = dataclasses.field(default_factory=GridConfig)
    plan: PlanConfig = dataclasses.field(default_factory=PlanConfig)
    route: RouteConfig = dataclasses.field(default_factory=RouteConfig)
    explore: ExploreConfig = dataclasses.field(default_factory=ExploreConfig)
    escape: EscapeConfig = dataclasses.field(default_factory=EscapeConfig)
    waypoints: WaypointConfig = dataclasses.field(default_factory=WaypointConfig)
    marker: MarkerTaskConfig = dataclasses.field(default_factory=MarkerTaskConfig)
    guard: GuardConfig = dataclasses.field(default_factory=GuardConfig)
    limits: LimitConfig = dataclasses.field(default_factory=LimitConfig)
