"""The law that all tasks share: a wanted acceleration, corrected by errors."""

from __future__ import annotations

from typing import Any


def wanted_acceleration(acceleration: Any, error: Any, error_rate: Any, gains: Any) -> Any:
    """Feed-forward plus proportional and derivative feedback.

    Args:
        acceleration: reference, per s².
        error: reference minus value.
        error_rate: its rate, per s.
        gains: two values, 1/s² and 1/s.
    """
    return acceleration + gains[0] * error + gains[1] * error_rate
