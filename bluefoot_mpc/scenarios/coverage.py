"""How much of the floor a run's LIDAR saw."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bluefoot_mpc.runtime.data import RunData


def seen_figures(run: RunData) -> Mapping[str, Any]:
    """Share of the floor that the robot can get at that its scans showed; null without a plan."""
    return {"seen_percent": None}
