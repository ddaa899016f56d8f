"""Scenarios of a validation that no user runs: ways to end a walk."""

from __future__ import annotations

from bluefoot_mpc.scenarios.base import Scenario
from bluefoot_mpc.scenarios.registry import SHIPPED
from bluefoot_mpc.scenarios.walking import Walk


class ControlledStop(Walk):
    """Walk, then end the gait, sit down and go limp in the middle of a cycle."""

    name = "controlled stop"


class EmergencyStop(Walk):
    """Walk, then lose all torque at once, a moment before the end."""

    name = "emergency stop"


SCENARIOS: dict[str, type[Scenario]] = {
    **SHIPPED,
    ControlledStop.name: ControlledStop,
    EmergencyStop.name: EmergencyStop,
}
"""By name, those that ship included."""
