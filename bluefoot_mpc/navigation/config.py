"""Everything that shapes how the robot finds its way."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

from bluefoot_mpc.navigation.guard import GuardConfig
from bluefoot_mpc.navigation.limits import LimitConfig
from bluefoot_mpc.navigation.potential_field import FieldConfig
from bluefoot_mpc.navigation.scan import ScanConfig


@dataclass(frozen=True, kw_only=True, slots=True)
class NavigationConfig:
    """Configuration of each part of navigation."""

    scan: ScanConfig = dataclasses.field(default_factory=ScanConfig)
    field: FieldConfig = dataclasses.field(default_factory=FieldConfig)
    guard: GuardConfig = dataclasses.field(default_factory=GuardConfig)
    limits: LimitConfig = dataclasses.field(default_factory=LimitConfig)
