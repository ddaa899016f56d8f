"""Model-based control of the BlueFoot quadruped.

The names below are loaded when first used, so that importing the package or one
of its parts does not load the simulator, the viewers or a serial port.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from bluefoot_mpc.model.robot import load_robot as load_robot
    from bluefoot_mpc.scenarios import RunOptions as RunOptions
    from bluefoot_mpc.scenarios import Scenario as Scenario
    from bluefoot_mpc.scenarios import ScenarioConfig as ScenarioConfig
    from bluefoot_mpc.scenarios import run as run

__all__ = ["RunOptions", "Scenario", "ScenarioConfig", "load_robot", "run"]

_HOMES = {
    "RunOptions": "bluefoot_mpc.scenarios",
    "Scenario": "bluefoot_mpc.scenarios",
    "ScenarioConfig": "bluefoot_mpc.scenarios",
    "load_robot": "bluefoot_mpc.model.robot",
    "run": "bluefoot_mpc.scenarios",
}


def __getattr__(name: str) -> Any:
    """Load a root export from where it lives."""
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    """Everything that is there, the exports not loaded yet included."""
    return sorted({*globals(), *__all__})
